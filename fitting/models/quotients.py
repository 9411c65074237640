"""Quotients whose derivatives take no division of their own.

Divisions are what a pass over the rows spends most of its time with, and JAX's own rules
take another one, or two, for a derivative; the compiler does not know that they are alike.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array


@jax.custom_jvp
def reciprocal(y: Array) -> Array:
    """``1 / y``."""
    return 1.0 / y


@reciprocal.defjvp
def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    r = reciprocal(*primals)
    # The square of r alone may overflow.
    return r, -(r * tangents[0]) * r


@jax.custom_jvp
def half_excess(t2: Array, z: Array) -> Array:
    """``(sqrt(z^2 + t2) - z) / 2`` for ``t2, z >= 0``, not both 0, without cancellation."""
    return 0.5 * t2 / (jnp.sqrt(z * z + t2) + z)


def _tangent_of_half_excess(
    primals: tuple[Array, Array], tangents: tuple[Array | SymbolicZero, ...]
) -> tuple[Array, Array]:
    t2, z = primals
    value = half_excess(t2, z)
    over_root = reciprocal(jnp.sqrt(z * z + t2))
    out = jnp.zeros_like(value)
    for tangent, slope in zip(tangents, (0.25, -value), strict=True):
        if not isinstance(tangent, SymbolicZero):
            out = out + slope * over_root * tangent
    return value, out


half_excess.defjvp(_tangent_of_half_excess, symbolic_zeros=True)
