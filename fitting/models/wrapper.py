"""What lobes that turn another one share: everything but where it looks."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array

from fitting.models.lobe import Lobe, Passage, Peak, Shape, Way
from fitting.parameters import Parameter


class Wrapper(Lobe):
    """A lobe inside of another, which sees its directions turned.

    As reciprocal as the inner one and with its albedo, because both directions are turned
    alike, or because turning one is a change of variables.
    """

    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    PER_ANGLE: ClassVar[bool] = True

    inner: Lobe

    @property
    def ways(self) -> tuple[Way, ...]:
        return self.inner.ways

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

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return self.inner.amplitudes(shape, coefficients)

    def peak(self, shape: Shape) -> Peak:
        return self.inner.peak(shape)

    def passage(self, shape: Shape) -> Passage | None:
        return self.inner.passage(shape)
