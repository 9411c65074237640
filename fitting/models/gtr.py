"""GTR: a microfacet lobe with a free tail, as in Disney's principled materials."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, shape


class GTR(Lobe):
    """``f = D F(cos_d) G2 / (4 cos_i cos_o)``, ``D = N / (1 + (alpha^2 - 1) hz^2)^gamma``.

    Burley 2012, appendix B. ``gamma = 2`` is GGX, 1 is Berry's longer tail. Other than
    ``gamma = 2`` it is not invariant to a stretch of the slopes, so there is no anisotropic
    form, and Smith's shadowing is integrated (56 nodes; relative error below 1e-6), where
    Disney takes that of GGX, which does not bound the albedo.
    """

    NAME: ClassVar[str] = "gtr"
    REFERENCE: ClassVar[str] = "Burley 2012, Physically based shading at Disney, appendix B"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    RETRO: ClassVar[bool] = True
    PER_ANGLE: ClassVar[bool] = True

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
        return 4e-7 if self.shadowing in ("correlated", "uncorrelated") else 0.0

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape("alpha", 0.2, (1e-4, 1.0), "slope width", start=(0.01, 0.9)),
            shape(
                "gamma", 1.8, (0.5, 10.0), "exponent of the tail; 2 is GGX",
                start=(0.8, 4.0),
            ),
            *fresnel.parameters(self.fresnel),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        return microfacet.basis(self, _facets(shape), shape, geometry)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return microfacet.amplitudes(self, _facets(shape), shape, coefficients)

    def peak(self, shape: Shape) -> SlopeWidths:
        """Nodes between the width and 1, over which a tail below ``gamma = 2`` reaches."""
        alpha = shape["alpha"]
        reach = jnp.minimum((shape["gamma"] - 0.2) / 1.8, 1.0)
        width = jnp.exp(reach * jnp.log(alpha))
        return SlopeWidths(width, width, jnp.zeros_like(alpha))


def _facets(shape: Shape) -> microfacet.Facets:
    alpha, gamma = shape["alpha"], shape["gamma"]

    def density(h2: Array, hz: Array, area: Array | None = None) -> Array:
        return ndf.gtr(h2, hz, alpha, gamma)

    def cos_lambda(t2: Array, cosine: Array) -> Array:
        return shadowing.cos_lambda_gtr(t2 / alpha**2, cosine, alpha, density)

    return microfacet.Facets(density, cos_lambda)
