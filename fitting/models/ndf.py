"""Distributions of microfacet normals, ``int D(h) cos(theta_h) dh = 1``."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array


def ggx(h2: Array, hz: Array, area: Array) -> Array:
    """GGX: ``D = 1 / (pi ax ay ((hx/ax)^2 + (hy/ay)^2 + hz^2)^2)``, 1/sr.

    Walter et al. 2007, eq. 33, in components: exact to rounding for any width, where
    ``cos^2 (a^2 - 1) + 1`` cancels.
    """
    return 1.0 / (jnp.pi * area * (h2 + hz * hz) ** 2)
