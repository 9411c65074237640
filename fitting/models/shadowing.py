"""Masking and shadowing, as the visibility ``V = G2 / (4 cos_i cos_o)``."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array


def ggx_visibility(i2: Array, o2: Array, cos_i: Array, cos_o: Array) -> Array:
    """Height-correlated Smith for GGX, divided by ``4 cos_i cos_o``.

    ``V = 0.5 / (cos_o sqrt(i2 + cos_i^2) + cos_i sqrt(o2 + cos_o^2))`` (Heitz 2014,
    eq. 99), finite wherever one of the two cosines is positive; the caller masks the rest.
    """
    below = cos_o * jnp.sqrt(i2 + cos_i**2) + cos_i * jnp.sqrt(o2 + cos_o**2)
    return 0.5 / below
