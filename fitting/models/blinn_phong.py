"""Blinn-Phong: a power of the half vector's cosine, for metal flakes and older fits."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, shape


class BlinnPhong(Lobe):
    """``f = (n + 2)(n + 4) / (8 pi (2^(-n/2) + n)) cos(theta_h)^n F(cos_d)``.

    Blinn 1977, normalised so that the albedo at normal incidence with ``F = 1`` is 1 for
    every exponent (the usual ``(n + 8) / (8 pi)`` is up to 7.5 % too bright). There is no
    shadowing and no ``1 / (cos_i cos_o)``: the lobe loses energy towards grazing.
    """

    NAME: ClassVar[str] = "blinn_phong"
    REFERENCE: ClassVar[str] = "Blinn 1977, normalised at normal incidence"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    RETRO: ClassVar[bool] = True

    fresnel: fresnel.Fresnel = eqx.field(static=True, default="schlick")

    @property
    def linear(self) -> bool:
        return fresnel.linear(self.fresnel)

    def parameters(self) -> tuple[Parameter, ...]:
        exponent = shape(
            "exponent", 50.0, (0.1, 1e8), "exponent of cos(theta_h)", start=(2.0, 1e4)
        )
        return (exponent, *fresnel.parameters(self.fresnel))

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, n = geometry, shape["exponent"]
        up = g.reflects
        hz = jnp.where(up, g.hz, 1.0)
        # cos = (1 + tan^2)^(-1/2): 1 - cos^2 has no digits left in a narrow peak.
        tan2 = (g.hx * g.hx + g.hy * g.hy) / (hz * hz)
        power = jnp.exp(-0.5 * n * jnp.log1p(tan2))
        factor = (n + 2.0) * (n + 4.0) / (8.0 * jnp.pi * (jnp.exp2(-0.5 * n) + n))
        value = jnp.where(up, factor * power, 0.0)
        return fresnel.split(self.fresnel, shape, value, g.cos_d)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return fresnel.amplitudes(self.fresnel, coefficients)

    def peak(self, shape: Shape) -> SlopeWidths:
        alpha = jnp.sqrt(2.0 / (shape["exponent"] + 2.0))
        return SlopeWidths(alpha, alpha, jnp.zeros_like(alpha))
