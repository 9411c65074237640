"""Lambert: the same radiance in every direction."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient


class Lambert(Lobe):
    """``f = albedo / pi``. Lambert 1760, Photometria."""

    NAME: ClassVar[str] = "lambert"
    REFERENCE: ClassVar[str] = "J. H. Lambert, Photometria, 1760"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        return (coefficient("albedo", 0.5, "directional-hemispherical reflectance"),)

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return (jnp.where(geometry.reflects, 1.0 / jnp.pi, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None
