"""Retro: a lobe around the mirror direction, turned to shine back at the source."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Peak, Shape
from fitting.parameters import Parameter


class Retro(Lobe):
    """``f(wi, wo) = f_inner(R wi, wo)``, where ``R`` turns by 180 degrees about the normal.

    The half vector of ``R wi`` and ``wo`` is the back vector of Belcour et al. 2014. The
    lobe is as reciprocal as the inner one, because turning both directions changes nothing,
    and has its directional albedo, because turning is a change of variables.
    """

    NAME: ClassVar[str] = "retro"
    REFERENCE: ClassVar[str] = "Belcour et al. 2014, the back vector"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    PER_ANGLE: ClassVar[bool] = True

    inner: Lobe

    @property
    def linear(self) -> bool:
        return self.inner.linear

    @property
    def relative_error(self) -> float:
        return self.inner.relative_error

    @property
    def albedo_bound(self) -> float | None:
        return self.inner.albedo_bound

    def parameters(self) -> tuple[Parameter, ...]:
        return self.inner.parameters()

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return self.inner.basis(shape, geometry.turned)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return self.inner.amplitudes(shape, coefficients)

    def peak(self, shape: Shape) -> Peak:
        return self.inner.peak(shape)
