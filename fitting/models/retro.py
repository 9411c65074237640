"""Retro: a lobe around the mirror direction, turned to shine back at the source."""

from __future__ import annotations

from typing import ClassVar

from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Shape
from fitting.models.wrapper import Wrapper


class Retro(Wrapper):
    """``f(wi, wo) = f_inner(R wi, wo)``, where ``R`` turns by 180 degrees about the normal.

    The half vector of ``R wi`` and ``wo`` is the back vector of Belcour et al. 2014. The
    lobe is as reciprocal as the inner one, because turning both directions changes nothing,
    and has its directional albedo, because turning is a change of variables.
    """

    NAME: ClassVar[str] = "retro"
    REFERENCE: ClassVar[str] = "Belcour et al. 2014, the back vector"

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return self.inner.basis(shape, geometry.turned)
