"""Beckmann: the microfacet lobe of Gaussian slopes, for polished and ground surfaces."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter

_FACETS = microfacet.Facets(ndf.beckmann, shadowing.cos_lambda_beckmann)


class Beckmann(Lobe):
    """``f = D(h) F(cos_d) G2 / (4 cos_i cos_o)`` with the Beckmann distribution.

    Walter et al. 2007, eq. 20 and 25, with the exact Smith shadowing of a Gaussian surface
    (eq. 26), height-correlated (Heitz 2014, eq. 99). The skirt falls off far faster than
    that of GGX. Single scattering: the white albedo falls to 0.46 at alpha = 1; the option
    ``ms`` adds the rest.
    """

    NAME: ClassVar[str] = "beckmann"
    REFERENCE: ClassVar[str] = "Walter et al. 2007, eq. 20, 25 and 26; Heitz 2014, eq. 99"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    RETRO: ClassVar[bool] = True
    PER_ANGLE: ClassVar[bool] = True

    anisotropic: bool = eqx.field(static=True, default=False)
    fresnel: fresnel.Fresnel = eqx.field(static=True, default="schlick")
    shadowing: shadowing.Shadowing = eqx.field(static=True, default="correlated")
    multiple_scattering: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        microfacet.check(self.anisotropic, self)

    @property
    def linear(self) -> bool:
        return microfacet.linear(self)

    @property
    def albedo_bound(self) -> float:
        """1, and with multiple scattering what its interpolation may add."""
        return 1.003 if self.multiple_scattering else 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        return microfacet.width_parameters(self.anisotropic) + fresnel.parameters(
            self.fresnel
        )

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return microfacet.basis(self, _FACETS, shape, geometry)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return microfacet.amplitudes(self, _FACETS, shape, coefficients)

    def peak(self, shape: Shape) -> SlopeWidths:
        return microfacet.slope_widths(shape)
