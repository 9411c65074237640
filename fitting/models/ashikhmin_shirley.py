"""Ashikhmin-Shirley: anisotropic Phong lobe around the half vector, brushed metals."""

from __future__ import annotations

import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, shape

EXPONENT_SUPPORT = (0.1, 1e8)
FLOOR = 1e-6


class AshikhminShirley(Lobe):
    """``f = sqrt((nu + 1)(nv + 1)) / (8 pi) ch^e F(cos_d) / (cos_d max(cos_i, cos_o))``.

    Specular term of Ashikhmin and Shirley 2000, eq. 4, with ``e = (nu hx^2 + nv hy^2) /
    (hx^2 + hy^2)`` in the tangent frame and ``ch = cos(theta_h)``; ``e = n`` where round.
    The value has a kink at ``cos_i = cos_o``. It has a pole where both directions are
    horizontal and opposite, so ``cos_d`` and the larger cosine are taken as at least 1e-6.
    """

    NAME: ClassVar[str] = "ashikhmin_shirley"
    REFERENCE: ClassVar[str] = "Ashikhmin and Shirley 2000, eq. 4"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    RETRO: ClassVar[bool] = True

    anisotropic: bool = eqx.field(static=True, default=False)
    fresnel: fresnel.Fresnel = eqx.field(static=True, default="schlick")

    @property
    def linear(self) -> bool:
        return fresnel.linear(self.fresnel)

    def parameters(self) -> tuple[Parameter, ...]:
        return _exponents(self.anisotropic) + fresnel.parameters(self.fresnel)

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, up = geometry, geometry.reflects
        hz = jnp.where(up, g.hz, 1.0)
        if "exponent" in shape:
            n = shape["exponent"]
            log = -0.5 * n * jnp.log1p((g.hx * g.hx + g.hy * g.hy) / (hz * hz))
            factor = n + 1.0
        else:
            nu, nv = shape["exponent_u"], shape["exponent_v"]
            c, s = jnp.cos(shape["angle"]), jnp.sin(shape["angle"])
            hu2, hv2 = (c * g.hx + s * g.hy) ** 2, (c * g.hy - s * g.hx) ** 2
            log = (nu * hu2 + nv * hv2) * _log_cosine(g.hx * g.hx + g.hy * g.hy, hz)
            factor = jnp.sqrt(nu + 1.0) * jnp.sqrt(nv + 1.0)
        larger = jnp.maximum(jnp.maximum(g.cos_i, g.cos_o), FLOOR)
        below = 8.0 * jnp.pi * jnp.maximum(g.cos_d, FLOOR) * larger
        # In two halves, so that no skirt underflows that the pole brings back.
        half = jnp.exp(0.5 * log)
        value = jnp.where(up, half * (factor / below) * half, 0.0)
        return fresnel.split(self.fresnel, shape, value, g.cos_d)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return fresnel.amplitudes(self.fresnel, coefficients)

    def peak(self, shape: Shape) -> SlopeWidths:
        if "exponent" in shape:
            alpha = _width(shape["exponent"])
            return SlopeWidths(alpha, alpha, jnp.zeros_like(alpha))
        return SlopeWidths(
            _width(shape["exponent_u"]), _width(shape["exponent_v"]), shape["angle"]
        )


def _exponents(anisotropic: bool) -> tuple[Parameter, ...]:
    start = (2.0, 1e4)
    if not anisotropic:
        return (
            shape(
                "exponent", 50.0, EXPONENT_SUPPORT, "exponent of cos(theta_h)", start=start
            ),
        )
    return (
        shape(
            "exponent_u", 50.0, EXPONENT_SUPPORT, "exponent along the tangent", start=start
        ),
        shape(
            "exponent_v", 20.0, EXPONENT_SUPPORT, "exponent across the tangent",
            start=start,
        ),
        shape(
            "angle", 0.4, (0.0, math.pi), "azimuth of the tangent",
            unit="rad", scale="periodic", start=(0.0, math.pi),
        ),
    )  # fmt: skip


def _log_cosine(sine2: Array, cosine: Array) -> Array:
    """``ln(cos) / sin^2`` of an angle, which is ``-1/2`` at 0: a Gaussian peak."""
    away = sine2 > 1e-8
    known = jnp.where(away, sine2, 1.0)
    ratio = -0.5 * jnp.log1p(known / (cosine * cosine)) / known
    # The series to the second order is exact to rounding: 1e-8 squared over 3.
    return jnp.where(away, ratio, -0.5 - 0.25 * sine2)


def _width(exponent: Array) -> Array:
    return jnp.sqrt(2.0 / (exponent + 2.0))
