"""Lambert's law for transmitted light: opal glass, paper, leaves, diffusers."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import THROUGH, Lobe, Shape, Way
from fitting.parameters import Parameter, coefficient, shape


class LambertTransmission(Lobe):
    """``f = transmittance / pi`` for light from the front that leaves at the back.

    The same from back to front. With the option ``media`` the medium behind the surface
    has the index ``eta`` relative to the one in front, and light from the back has
    ``transmittance / (pi eta^2)``, as generalised reciprocity ``f(wi, wo) / n_o^2 = f(wo,
    wi) / n_i^2`` wants it (Walter et al. 2007, sec. 4.2).
    """

    NAME: ClassVar[str] = "lambert_transmission"
    REFERENCE: ClassVar[str] = "J. H. Lambert, Photometria, 1760"
    WAYS: ClassVar[tuple[Way, ...]] = THROUGH
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    media: bool = eqx.field(static=True, default=False)

    def parameters(self) -> tuple[Parameter, ...]:
        own = (coefficient("transmittance", 0.3, "hemispherical transmittance from front"),)
        if not self.media:
            return own
        return (
            shape(
                "eta", 1.5, (1.0, 4.0), "index of the back relative to the front",
                scale="linear", start=(1.1, 2.0),
            ),
            *own,
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        value = jnp.where(geometry.transmits, 1.0 / jnp.pi, 0.0)
        if self.media:
            _, back = geometry.from_front
            value = jnp.where(back, value / shape["eta"] ** 2, value)
        return (value.astype(jnp.result_type(geometry.cos_i)),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None

    def relative_index(self, shape: Shape) -> Array | float:
        return shape["eta"] if self.media else 1.0
