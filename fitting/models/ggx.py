"""GGX: the microfacet lobe with long tails, first choice for most real surfaces."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter


class GGX(Lobe):
    """``f = D(h) F(cos_d) G2 / (4 cos_i cos_o)`` with the GGX distribution.

    Walter et al. 2007, eq. 20 and 33; height-correlated Smith shadowing of Heitz 2014,
    eq. 99. Single scattering: the white albedo falls to 0.31 at alpha = 1.
    """

    NAME: ClassVar[str] = "ggx"
    REFERENCE: ClassVar[str] = "Walter et al. 2007, eq. 20 and 33; Heitz 2014, eq. 99"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    anisotropic: bool = eqx.field(static=True, default=False)
    fresnel: fresnel.Fresnel = eqx.field(static=True, default="schlick")

    def parameters(self) -> tuple[Parameter, ...]:
        return microfacet.width_parameters(self.anisotropic) + fresnel.parameters(
            self.fresnel
        )

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        up = g.reflects
        s = microfacet.stretched(shape, g)
        d = ndf.ggx(s.h2, g.hz, s.area)
        cos_i, cos_o = jnp.where(up, g.cos_i, 1.0), jnp.where(up, g.cos_o, 1.0)
        v = shadowing.ggx_visibility(s.i2, s.o2, cos_i, cos_o)
        return fresnel.split(self.fresnel, shape, jnp.where(up, d * v, 0.0), g.cos_d)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return microfacet.slope_widths(shape)
