"""Student-t: a microfacet lobe whose tail is fitted, from beyond GGX to Beckmann."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, shape


class StudentT(Lobe):
    """``f = D(h) F(cos_d) G2 / (4 cos_i cos_o)`` with Student's t as slope distribution.

    Ribardiere et al. 2017. ``gamma = 2`` is GGX, infinity is Beckmann, and below 2 the tail
    is longer than that of GGX. Smith's shadowing is exact, by quadrature (error of ``G1``
    below 1e-8), not the paper's rational fit, which is off by up to 0.7 %. The tail needs
    two decades of skirt in the data to be told from the width.
    """

    NAME: ClassVar[str] = "student_t"
    REFERENCE: ClassVar[str] = "Ribardiere et al. 2017, Student's t-distribution (STD)"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    RETRO: ClassVar[bool] = True
    PER_ANGLE: ClassVar[bool] = True

    anisotropic: bool = eqx.field(static=True, default=False)
    fresnel: fresnel.Fresnel = eqx.field(static=True, default="schlick")
    shadowing: shadowing.Shadowing = eqx.field(static=True, default="correlated")

    @property
    def multiple_scattering(self) -> bool:
        """There is no such option: the shadowing alone is a quadrature."""
        return False

    @property
    def linear(self) -> bool:
        return fresnel.linear(self.fresnel)

    @property
    def relative_error(self) -> float:
        """That of the shadowing's quadrature."""
        return 2e-8 if self.shadowing in ("correlated", "uncorrelated") else 0.0

    def parameters(self) -> tuple[Parameter, ...]:
        gamma = shape(
            "gamma", 2.5, (1.6, 40.0), "exponent of the tail; 2 is GGX", start=(1.8, 8.0)
        )
        widths = microfacet.width_parameters(self.anisotropic)
        return (*widths, gamma, *fresnel.parameters(self.fresnel))

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return microfacet.basis(self, _facets(shape), shape, geometry)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return microfacet.amplitudes(self, _facets(shape), shape, coefficients)

    def peak(self, shape: Shape) -> SlopeWidths:
        return microfacet.slope_widths(shape)


def _facets(shape: Shape) -> microfacet.Facets:
    gamma = shape["gamma"]
    return microfacet.Facets(
        lambda h2, hz, area: ndf.student_t(h2, hz, area, gamma),
        lambda t2, cosine: shadowing.cos_lambda_student_t(t2, cosine, gamma),
    )
