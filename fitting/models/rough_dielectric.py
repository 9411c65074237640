"""A rough interface between two clear media: ground glass, frosted covers, diffusers."""

from __future__ import annotations

import dataclasses
from typing import ClassVar, Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing, slab
from fitting.models.lobe import Lobe, Passage, Shape, SlopeWidths, Way
from fitting.parameters import Parameter, shape

Distribution = Literal["ggx", "beckmann"]

FACETS: dict[Distribution, microfacet.Facets] = {
    "ggx": microfacet.Facets(ndf.ggx, shadowing.cos_lambda_ggx),
    "beckmann": microfacet.Facets(ndf.beckmann, shadowing.cos_lambda_beckmann),
}


class RoughDielectric(Lobe):
    """Reflection and transmission of facets between media of index 1 and ``eta``.

    The front is the rare side; turn it over with the option ``back``. With ``n_o`` the
    index on the detector's side, ``H = -(w_f + eta w_b)`` of the directions in front and
    behind, ``i, o`` their cosines to ``H`` and ``N = |H|``::

        f_r = D(h) F(cos_d) G2 / (4 cos_i cos_o)
        f_t = |i o| / |cos_i cos_o| n_o^2 (1 - F(i)) G2 D(H / N) / N^2

    Walter et al. 2007, eq. 20 and 21, with their ``G2 = G1(i) G1(o)`` (eq. 23) and exact
    Fresnel terms; in radiance, so that ``f_t / n_o^2`` is the same in both directions,
    which it is here to rounding: ``H`` and ``N`` do not know where the light comes from.
    Single scattering: a rough one loses light between its facets.

    ``N`` is a length and not the paper's ``n_i i + n_o o``, which cancels. There is no
    transmission without refraction: the index cannot go to 1, where ``f_t`` is a delta.
    """

    NAME: ClassVar[str] = "rough_dielectric"
    REFERENCE: ClassVar[str] = "Walter et al. 2007, eq. 20, 21 and 23"
    WAYS: ClassVar[tuple[Way, ...]] = ("front", "back", "down", "up")
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    PER_ANGLE: ClassVar[bool] = True

    anisotropic: bool = eqx.field(static=True, default=False)
    distribution: Distribution = eqx.field(static=True, default="ggx")

    @property
    def shadowing(self) -> shadowing.Shadowing:
        """Of both directions on their own: correlated heights have no simple law here."""
        return "uncorrelated"

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            *microfacet.width_parameters(self.anisotropic),
            shape(
                "eta", 1.5, (1.02, 4.0), "index of the back relative to the front",
                scale="linear", start=(1.3, 2.0),
            ),
            *slab.factors(),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        eta = shape["eta"]
        single = microfacet.single_scattering(
            self.shadowing, FACETS[self.distribution], shape
        )
        front, back = geometry.from_front
        index = jnp.where(back, 1.0 / eta, eta)
        reflected = single(front) * fresnel.dielectric(front.cos_d, index)
        refracting, factor = _refracting(geometry, eta)
        return reflected, single(refracting) * factor

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return microfacet.slope_widths(shape)

    def passage(self, shape: Shape) -> Passage:
        return Passage(microfacet.slope_widths(shape), shape["eta"])

    def relative_index(self, shape: Shape) -> Array:
        return shape["eta"]


def _refracting(g: Geometry, eta: Array) -> tuple[Geometry, Array]:
    """Both directions above facets with the half vector of refraction, and what multiplies
    ``D G2 / (4 cos_i cos_o)`` of them: ``4 n_o^2 |i o| (1 - F) / N^2``, or 0.

    ``1 - F`` is the mean of ``4 i eta o / (i + eta o)^2`` and ``4 i eta o / (eta i +
    o)^2``: with the cosines on both sides known there is no root and no total reflection.
    """
    down, step = g.cos_i > 0, eta - 1.0
    x, y, z = g.refracting(eta)
    # w_f . w_b = 2 cos_d^2 - 1.
    sum2 = 2.0 * g.cos_d * g.cos_d
    i, o = step - eta * sum2, step + sum2
    passes = g.transmits & (i > 0) & (z > 0)
    i, o = jnp.where(passes, i, 1.0), jnp.where(passes, o, 1.0)
    x, y, z = (jnp.where(passes, a, b) for a, b in ((x, 0.0), (y, 0.0), (z, 1.0)))
    n2 = x * x + y * y + z * z
    n = jnp.sqrt(n2)
    product = eta * i * o
    enters = 2.0 * product * ((i + eta * o) ** -2.0 + (eta * i + o) ** -2.0)
    factor = 4.0 * i * o * enters / (n2 * n2)
    factor = jnp.where(down, factor * eta * eta, factor)
    facets = dataclasses.replace(
        g,
        cos_i=jnp.where(passes, abs(g.cos_i), -1.0),
        cos_o=jnp.where(passes, abs(g.cos_o), -1.0),
        hx=x / n, hy=y / n, hz=z / n, cos_d=i / n,
    )  # fmt: skip
    return facets, jnp.where(passes, factor, 0.0)
