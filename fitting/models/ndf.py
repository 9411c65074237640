"""Distributions of microfacet normals, ``int D(h) cos(theta_h) dh = 1``."""

from __future__ import annotations

import math

import jax.numpy as jnp
from jaxtyping import Array

from fitting.models.quotients import reciprocal


def ggx(h2: Array, hz: Array, area: Array) -> Array:
    """GGX: ``D = 1 / (pi ax ay ((hx/ax)^2 + (hy/ay)^2 + hz^2)^2)``, 1/sr.

    Walter et al. 2007, eq. 33, in components: exact to rounding for any width, where
    ``cos^2 (a^2 - 1) + 1`` cancels.
    """
    r = reciprocal(h2 + hz * hz)
    return r * r * reciprocal(jnp.pi * area)


def beckmann(h2: Array, hz: Array, area: Array) -> Array:
    """Beckmann: ``D = exp(-t) / (pi ax ay hz^4)``, ``t = ((hx/ax)^2 + (hy/ay)^2) / hz^2``.

    Walter et al. 2007, eq. 25, 1/sr. Where ``exp(-t)`` would underflow the value and its
    derivatives are exactly zero; elsewhere ``hz^4`` is far from zero, because no width
    exceeds 1.5, so nothing overflows at grazing half vectors.
    """
    cap = -0.9 * math.log(jnp.finfo(jnp.result_type(h2)).tiny)
    near = h2 < cap * (hz * hz)
    hz2 = jnp.where(near, hz * hz, 1.0)
    t = jnp.where(near, h2, 0.0) / hz2
    return jnp.where(near, jnp.exp(-t) / (jnp.pi * area * hz2 * hz2), 0.0)


def student_t(h2: Array, hz: Array, area: Array, gamma: Array) -> Array:
    """Student-t: ``D = (1 + t / (gamma - 1))^-gamma / (pi ax ay hz^4)``, 1/sr.

    Ribardiere et al. 2017, ``t`` as for Beckmann. GGX at ``gamma = 2``, Beckmann as
    ``gamma`` goes to infinity. Taken in logarithms, in which the pole of ``hz^-4`` and the
    zero of the bracket meet without overflow.
    """
    z2 = hz * hz
    some = z2 > 0
    z2 = jnp.where(some, z2, 1.0)
    spread = jnp.log1p(h2 / ((gamma - 1.0) * z2))
    exponent = -gamma * spread - 2.0 * jnp.log(z2)
    return jnp.where(some, jnp.exp(exponent) / (jnp.pi * area), 0.0)


def gtr(h2: Array, hz: Array, alpha: Array, gamma: Array) -> Array:
    """GTR: ``D = N / (1 + (alpha^2 - 1) hz^2)^gamma``, isotropic, 1/sr.

    Burley 2012, appendix B, with ``s2 = hx^2 + hy^2`` as ``N alpha^(-2
    gamma) (1 + s2 (1 - alpha^2) / alpha^2)^-gamma`` and the normaliser in a form without
    the holes at ``gamma = 1`` and ``alpha = 1``: with ``l = 2 ln(alpha)`` and
    ``y = (gamma - 1) l``, ``N alpha^(-2 gamma) = (expm1(l) / l) (y / expm1(y)) /
    (pi alpha^2)``.
    """
    logarithm = 2.0 * jnp.log(alpha)
    ratio = _over_expm1((gamma - 1.0) * logarithm) / _over_expm1(logarithm)
    normaliser = ratio / (jnp.pi * alpha * alpha)
    spread = jnp.log1p(h2 * ((1.0 - alpha) * (1.0 + alpha)))
    return normaliser * jnp.exp(-gamma * spread)


def _over_expm1(x: Array) -> Array:
    """``x / expm1(x)``, which is 1 at 0, for ``x`` that does not overflow ``exp``."""
    away = jnp.abs(x) > 1e-3
    safe = jnp.where(away, x, 1.0)
    series = 1.0 - x * (0.5 - x * (1.0 / 12.0 - x * x / 720.0))
    return jnp.where(away, safe / jnp.expm1(safe), series)
