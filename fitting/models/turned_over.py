"""Turned over: a lobe at the back of the sample instead of at its front."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import TURNED_OVER, Shape, Way
from fitting.models.wrapper import Wrapper


class TurnedOver(Wrapper):
    """``f(wi, wo) = f_inner(Z wi, Z wo)``, where ``Z`` reverses the normal.

    What the inner lobe does at the front this one does at the back, and what it sends from
    the front to the back this one sends the other way.
    """

    NAME: ClassVar[str] = "turned_over"
    REFERENCE: ClassVar[str] = "front and back exchanged"

    @property
    def ways(self) -> tuple[Way, ...]:
        return tuple(TURNED_OVER[w] for w in self.inner.ways)

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return self.inner.basis(shape, geometry.turned_over)

    def relative_index(self, shape: Shape) -> Array | float:
        return 1.0 / self.inner.relative_index(shape)
