"""Oren-Nayar: rough matt surfaces, flatter than Lambert and brighter towards the source."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape


class OrenNayar(Lobe):
    """``f = albedo / pi (A + B max(s, 0) / max(cos_i, cos_o))``.

    Qualitative model of Oren and Nayar 1994: facets whose slope angles have the
    standard deviation ``sigma``; ``A = 1 - 0.5 sigma^2 / (sigma^2 + 0.33)``,
    ``B = 0.45 sigma^2 / (sigma^2 + 0.09)``, ``s = wi.wo - cos_i cos_o``. Not energy
    preserving: with ``albedo = 1`` the directional albedo is ``A`` at normal incidence and
    ``A + B / 2`` at grazing, which is 1.0152 at ``sigma = 0.199`` and falls to 0.79 at 1.5.
    """

    NAME: ClassVar[str] = "oren_nayar"
    REFERENCE: ClassVar[str] = "Oren and Nayar 1994, the qualitative model"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0152

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "sigma", 0.3, (0.0, 1.5), "standard deviation of the facets' slope angles",
                unit="rad", scale="linear", start=(0.1, 0.8),
            ),
            coefficient("albedo", 0.5, "factor of the lobe, albedo of a facet"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        up = g.reflects
        variance = shape["sigma"] ** 2
        a = 1.0 - 0.5 * variance / (variance + 0.33)
        b = 0.45 * variance / (variance + 0.09)
        s = jnp.maximum(g.wix * g.wox + g.wiy * g.woy, 0.0)
        larger = jnp.where(up, jnp.maximum(g.cos_i, g.cos_o), 1.0)
        return (jnp.where(up, (a + b * s / larger) / jnp.pi, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None
