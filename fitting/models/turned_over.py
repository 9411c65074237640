"""Turned over: a lobe at the back of the sample instead of at its front."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import TURNED_OVER, Lobe, Passage, Peak, Shape, Way
from fitting.parameters import Parameter


class TurnedOver(Lobe):
    """``f(wi, wo) = f_inner(Z wi, Z wo)``, where ``Z`` reverses the normal.

    What the inner lobe does at the front this one does at the back, and what it sends from
    the front to the back this one sends the other way.
    """

    NAME: ClassVar[str] = "turned_over"
    REFERENCE: ClassVar[str] = "front and back exchanged"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    PER_ANGLE: ClassVar[bool] = True

    inner: Lobe

    @property
    def ways(self) -> tuple[Way, ...]:
        return tuple(TURNED_OVER[w] for w in self.inner.ways)

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
        return self.inner.basis(shape, geometry.turned_over)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return self.inner.amplitudes(shape, coefficients)

    def peak(self, shape: Shape) -> Peak:
        return self.inner.peak(shape)

    def passage(self, shape: Shape) -> Passage | None:
        return self.inner.passage(shape)

    def relative_index(self, shape: Shape) -> Array | float:
        return 1.0 / self.inner.relative_index(shape)
