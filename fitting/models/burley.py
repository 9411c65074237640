"""Burley: Disney's diffuse base, with a bright rim on rough surfaces."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape


class Burley(Lobe):
    """``f = albedo / pi (1 + (f90 - 1) (1 - cos_i)^5) (1 + (f90 - 1) (1 - cos_o)^5)``.

    Burley 2012, section 5.3, with ``f90 = 1/2 + 2 roughness cos_d^2``. It is fitted to
    measured retro-reflection and does not conserve energy: with ``albedo = 1`` the
    directional albedo is 0.5 to 1.5576, both at grazing (roughness 0 and 1).
    """

    NAME: ClassVar[str] = "burley"
    REFERENCE: ClassVar[str] = "Burley 2012, section 5.3"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.5576

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "roughness", 0.5, (0.0, 1.0), "roughness, square root of a slope width",
                scale="linear", start=(0.1, 0.9),
            ),
            coefficient("albedo", 0.5, "factor of the lobe, about its albedo"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        f90 = 0.5 + 2.0 * shape["roughness"] * g.cos_d * g.cos_d
        value = rim(f90, g.cos_i) * rim(f90, g.cos_o) / jnp.pi
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None


def rim(f90: Array, cosine: Array) -> Array:
    """Schlick's ``1 + (f90 - 1) (1 - cos)^5``, a sum of what is not negative."""
    p = 1.0 - cosine
    return cosine * (1.0 + p * (1.0 + p * (1.0 + p * (1.0 + p)))) + f90 * p**5
