"""Minnaert: a power of the cosines, for the moon, soils and limb-darkened surfaces."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape

FLOOR = 1e-6


class Minnaert(Lobe):
    """``f = albedo (k + 1) / (2 pi) (cos_i cos_o)^(k - 1)``.

    Minnaert 1941; ``k = 1`` is Lambert, below it brightens towards the limb, above it
    darkens. The directional albedo is ``albedo cos^(k - 1)``, without bound for ``k < 1``,
    where there is a pole at the horizon: both cosines are taken as at least 1e-6.
    """

    NAME: ClassVar[str] = "minnaert"
    REFERENCE: ClassVar[str] = "Minnaert 1941"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "k", 0.8, (0.0, 3.0), "exponent of limb darkening",
                scale="linear", start=(0.5, 1.5),
            ),
            coefficient("albedo", 0.5, "albedo at normal incidence"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, k = geometry, shape["k"]
        both = jnp.maximum(g.cos_i, FLOOR) * jnp.maximum(g.cos_o, FLOOR)
        value = (k + 1.0) / (2.0 * jnp.pi) * jnp.power(both, k - 1.0)
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None
