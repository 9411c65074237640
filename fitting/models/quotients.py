"""Quotients whose derivatives take no division of their own.

Divisions are what a pass over the rows spends most of its time with, and JAX's own rules
take another one, or two, for a derivative; the compiler does not know that they are alike.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero


def reciprocal(y: Array) -> Array:
    """``1 / y``; numpy or JAX."""
    # Numbers of numpy's remain that, with their precision.
    return _reciprocal(y) if isinstance(y, Array) else 1.0 / y


def half_excess(t2: Array, z: Array) -> Array:
    """``(sqrt(z^2 + t2) - z) / 2`` for ``t2, z >= 0``, not both 0, without cancellation.

    Numpy or JAX.
    """
    if isinstance(t2, Array) or isinstance(z, Array):
        return _half_excess(t2, z)
    return 0.5 * t2 / (np.sqrt(z * z + t2) + z)


@jax.custom_jvp
def _reciprocal(y: Array) -> Array:
    return 1.0 / y


@_reciprocal.defjvp
def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    r = _reciprocal(*primals)
    # The square of r alone may overflow.
    return r, -(r * tangents[0]) * r


@jax.custom_jvp
def _half_excess(t2: Array, z: Array) -> Array:
    return 0.5 * t2 / (jnp.sqrt(z * z + t2) + z)


def _tangent_of_half_excess(
    primals: tuple[Array, Array], tangents: tuple[Array | SymbolicZero, ...]
) -> tuple[Array, Array]:
    t2, z = primals
    value = _half_excess(t2, z)
    over_root = _reciprocal(jnp.sqrt(z * z + t2))
    out = jnp.zeros_like(value)
    for tangent, slope in zip(tangents, (0.25, -value), strict=True):
        if not isinstance(tangent, SymbolicZero):
            out = out + slope * over_root * tangent
    return value, out


_half_excess.defjvp(_tangent_of_half_excess, symbolic_zeros=True)
