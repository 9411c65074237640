"""Ashikhmin-Shirley's diffuse term: a matt base under a coat, dark towards grazing."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient


class AshikhminShirleyDiffuse(Lobe):
    """``f = 28 rd / (23 pi) (1 - (1 - cos_i / 2)^5) (1 - (1 - cos_o / 2)^5)``.

    Diffuse term of Ashikhmin and Shirley 2000, eq. 5. The paper's factor ``1 - Rs`` of the
    coat is a part of ``rd`` here: nothing can tell the two apart. The directional albedo is
    ``rd (1 - (1 - cos / 2)^5)``.
    """

    NAME: ClassVar[str] = "ashikhmin_shirley_diffuse"
    REFERENCE: ClassVar[str] = "Ashikhmin and Shirley 2000, eq. 5"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 31.0 / 32.0

    def parameters(self) -> tuple[Parameter, ...]:
        return (coefficient("rd", 0.5, "factor of the lobe, Rd (1 - Rs) of the paper"),)

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        value = 28.0 / (23.0 * jnp.pi) * _entering(g.cos_i) * _entering(g.cos_o)
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None


def _entering(cosine: Array) -> Array:
    """``1 - (1 - cos / 2)^5`` as a product, which keeps its digits at grazing."""
    x = 0.5 * cosine
    p = 1.0 - x
    return x * (1.0 + p * (1.0 + p * (1.0 + p * (1.0 + p))))
