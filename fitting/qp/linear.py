"""Small symmetric matrices, a batch of them at once, and the units they are solved in."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

_RIDGE = 1e-14


def inverse(matrix: Float[Array, "m m *b"]) -> Float[Array, "m m *b"]:
    """Inverse of symmetric positive definite matrices by the sweep operator.

    One rank-one update per row (Goodnight 1979, The American Statistician 33, 149):
    elementwise over the batch, a few fused operations per row, quick to compile. Pivots
    are kept above `_RIDGE` times the diagonal, which makes a singular matrix usable in
    the directions that the data determine.
    """
    m = matrix.shape[0]
    floor = _RIDGE * jnp.abs(jnp.einsum("ii...->i...", matrix)) + 1e-300
    number = jnp.arange(m).reshape(m, *(1,) * (matrix.ndim - 2))

    def sweep(i: Array, a: Array) -> Array:
        here = number == i
        row = a[i]
        pivot = jnp.maximum(row[i], floor[i])
        row = jnp.where(here, -1.0, row) / pivot
        column = jnp.where(here, -1.0, row * pivot)
        rest = jnp.where(here[:, None] | here, 0.0, a)
        return rest - column[:, None] * row

    return -jax.lax.fori_loop(0, m, sweep, matrix)


def product(matrix: Float[Array, "*b m k"], x: Float[Array, "*b k"]) -> Array:
    """Matrix times vector over the batch, as a fused sum instead of many small GEMMs."""
    return jnp.sum(matrix * x[..., None, :], axis=-1)


def times(matrix: Array, x: Array) -> Array:
    """Matrix times vector for every channel, the last axis of both."""
    return jnp.sum(matrix * x, axis=1)


class Units(NamedTuple):
    """What a batch of problems is scaled by: unknowns by ``size / roots``."""

    roots: Float[Array, "m c"]
    size: Float[Array, " c"]

    def back(self, x: Array, free: Array) -> tuple[Array, Array]:
        """A point ``(c, m)`` and an inverse ``(c, m, m)`` in the units of before."""
        across = self.roots[:, None] * self.roots
        return (x * self.size / self.roots).T, jnp.moveaxis(free / across, -1, 0)


def scaled(
    hessian: Float[Array, "c m m"], linear: Float[Array, "c m"]
) -> tuple[Float[Array, "m m c"], Float[Array, "m c"], Units]:
    """Matrices with a unit diagonal, right-hand sides of 1 at most, and their units.

    The channels are last, for loops in vector registers over them.
    """
    g, b = jnp.moveaxis(hessian, 0, -1), linear.T
    diagonal = jnp.einsum("iic->ic", g)
    d = jnp.sqrt(jnp.where(diagonal > 0, diagonal, 1.0))
    g = g / (d[:, None] * d) + _RIDGE * jnp.eye(d.shape[0], dtype=g.dtype)[:, :, None]
    b = b / d
    # Far from the least number, of which products would be taken for 0.
    size = jnp.maximum(jnp.max(jnp.abs(b), axis=0), 1e-200)
    return g, b / size, Units(d, size)
