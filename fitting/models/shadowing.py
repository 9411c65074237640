"""Masking and shadowing, as the visibility ``V = G2 / (4 cos_i cos_o)``."""

from __future__ import annotations

import math

import jax.numpy as jnp
from jax.scipy.special import erfc
from jaxtyping import Array


def ggx_visibility(i2: Array, o2: Array, cos_i: Array, cos_o: Array) -> Array:
    """Height-correlated Smith for GGX, divided by ``4 cos_i cos_o``.

    ``V = 0.5 / (cos_o sqrt(i2 + cos_i^2) + cos_i sqrt(o2 + cos_o^2))`` (Heitz 2014,
    eq. 99), finite wherever one of the two cosines is positive; the caller masks the rest.
    """
    below = cos_o * jnp.sqrt(i2 + cos_i**2) + cos_i * jnp.sqrt(o2 + cos_o**2)
    return 0.5 / below


def beckmann_visibility(i2: Array, o2: Array, cos_i: Array, cos_o: Array) -> Array:
    """Height-correlated Smith for Beckmann, divided by ``4 cos_i cos_o``.

    ``G2 = 1 / (1 + Lambda_i + Lambda_o)`` with the exact ``Lambda`` of Walter et al. 2007,
    eq. 26 (not its rational approximation). Multiplied through by the cosines, all terms
    are positive and ``cos Lambda`` stays finite at grazing; the caller masks where both
    cosines are zero.
    """
    below = (
        cos_i * cos_o
        + cos_o * _cos_lambda_beckmann(i2, cos_i)
        + cos_i * _cos_lambda_beckmann(o2, cos_o)
    )
    return 0.25 / below


def _cos_lambda_beckmann(t2: Array, cosine: Array) -> Array:
    """``cosine Lambda(x)``, ``x = cosine / sqrt(t2)``.

    ``x Lambda = (exp(-x^2) / sqrt(pi) - x erfc(x)) / 2``: no pole at grazing. Beyond
    ``x = 7`` it is below 1e-24 and is set to zero, which also keeps the derivative of the
    root away from normal incidence, where ``t2 = 0``.
    """
    shadowed = t2 * 49.0 > cosine * cosine
    t = jnp.sqrt(jnp.where(shadowed, t2, 1.0))
    x = jnp.where(shadowed, cosine, 0.0) / t
    x_lambda = 0.5 * (jnp.exp(-x * x) / math.sqrt(math.pi) - x * erfc(x))
    return jnp.where(shadowed, t * x_lambda, 0.0)
