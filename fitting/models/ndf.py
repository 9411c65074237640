"""Distributions of microfacet normals, ``int D(h) cos(theta_h) dh = 1``."""

from __future__ import annotations

import math

import jax.numpy as jnp
from jaxtyping import Array


def ggx(h2: Array, hz: Array, area: Array) -> Array:
    """GGX: ``D = 1 / (pi ax ay ((hx/ax)^2 + (hy/ay)^2 + hz^2)^2)``, 1/sr.

    Walter et al. 2007, eq. 33, in components: exact to rounding for any width, where
    ``cos^2 (a^2 - 1) + 1`` cancels.
    """
    return 1.0 / (jnp.pi * area * (h2 + hz * hz) ** 2)


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
