"""ABC: a microfacet lobe with a power-law skirt, for gloss with wide skirts."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.abg import power_law_peak
from fitting.models.fresnel import dielectric
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape

HORIZON = 1e-6


class ABC(Lobe):
    """``f = a / (1 + b (1 - cos(theta_h)))^c F(cos_d; eta) G / (pi cos_i cos_o)``.

    Low et al. 2012, the microfacet model, with the ``1 / pi`` that its published fits
    need: ``G = min(1, 2 cos(theta_h) cos_i / cos_d, 2 cos(theta_h) cos_o / cos_d)`` of
    V-shaped grooves and the exact reflectance ``F`` of a dielectric. ``a`` is no density
    of facets: nothing keeps the albedo below 1. There is a pole where both directions are
    grazing and mirrored, so cosines below 1e-6 count as 1e-6 in ``G / (cos_i cos_o)``.
    """

    NAME: ClassVar[str] = "abc"
    REFERENCE: ClassVar[str] = "Low et al. 2012, ACM TOG 31(1), the microfacet model"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "b", 1e3, (1.0, 1e8), "narrowness of the peak, 2 / width^2",
                start=(10.0, 1e6),
            ),
            shape(
                "c", 1.0, (0.01, 4.0), "fall of the skirt, theta_h^(-2 c)",
                start=(0.3, 2.0),
            ),
            shape(
                "eta", 1.5, (1.01, 100.0), "index of refraction relative to the outside",
                start=(1.3, 3.0),
            ),
            coefficient("a", 1.0, "factor of the lobe"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        up = g.reflects
        # 1 - cos(theta_h) has no digits left in a narrow peak.
        depth = (g.hx * g.hx + g.hy * g.hy) / (1.0 + g.hz)
        power = jnp.exp(-shape["c"] * jnp.log1p(shape["b"] * depth))
        # G / (cos_i cos_o) with the smaller cosine cancelled: finite where it is 0.
        larger = jnp.maximum(jnp.where(up, jnp.maximum(g.cos_i, g.cos_o), 1.0), HORIZON)
        smaller = jnp.maximum(jnp.minimum(g.cos_i, g.cos_o), HORIZON)
        groove = g.cos_d / (2.0 * jnp.where(up, g.hz, 1.0))
        visible = 1.0 / (larger * jnp.maximum(smaller, groove))
        value = power * visible * dielectric(g.cos_d, shape["eta"]) / jnp.pi
        return (jnp.where(up, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return power_law_peak((0.5 * shape["b"]) ** -0.5, 2.0 * shape["c"])
