"""Tiny matrices as lists of rows whose elements are arrays: of texels, of channels, ...

A batch of many thousand 3 by 3 systems is a few fused loops this way, where a call per
system into a library, or a loop over pivots, costs more than the arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

# Pivots are kept above this share of the diagonal, in roundings: singular systems stay
# usable in the directions that the data determine.
_RIDGE = 50.0

# A number where it is known when the code is compiled.
Element = Array | float
Vector = Sequence[Any]
Matrix = Sequence[Vector]


def solve(matrix: Matrix, rights: Sequence[Vector]) -> list[list[Array]]:
    """Solutions of a symmetric positive definite system, by ``L D L'``."""
    lower, pivots = factored(matrix)
    inverse = [1.0 / d for d in pivots]
    return [solved(lower, inverse, right) for right in rights]


def factored(matrix: Matrix) -> tuple[list[list[Array]], list[Array]]:
    """``L``, without its diagonal, and ``D``."""
    pivots: list[Array] = []
    lower: list[list[Array]] = []
    for i in range(len(matrix)):
        row: list[Array] = []
        for j in range(i):
            known = [row[p] * pivots[p] * lower[j][p] for p in range(j)]
            row.append((matrix[i][j] - sum(known)) / pivots[j])
        left = matrix[i][i] - sum(row[p] * row[p] * pivots[p] for p in range(i))
        rounding = jnp.finfo(left.dtype)
        least = _RIDGE * rounding.eps * jnp.abs(matrix[i][i]) + rounding.tiny
        pivots.append(jnp.maximum(left, least))
        lower.append(row)
    return lower, pivots


def solved(lower: Matrix, inverse: Vector, right: Vector) -> list[Array]:
    """The solution for one right side, of a matrix with ``L`` and ``1 / D``."""
    m = len(right)
    z: list[Array] = []
    for i in range(m):
        z.append(right[i] - sum(lower[i][j] * z[j] for j in range(i)))
    x = [z[i] * inverse[i] for i in range(m)]
    for i in reversed(range(m)):
        x[i] = x[i] - sum(lower[j][i] * x[j] for j in range(i + 1, m))
    return x


def product(a: Matrix, b: Matrix) -> list[list[Array]]:
    """Matrix product; elements that are the number 0 cost nothing."""
    return [[dot(row, [r[j] for r in b]) for j in range(len(b[0]))] for row in a]


def inner(a: Matrix, b: Matrix) -> list[list[Array]]:
    """``a' b``."""
    return product([*map(list, zip(*a, strict=True))], b)


def dot(a: Vector, b: Vector) -> Any:
    """``a . b``, the number 0 if nothing is to be added."""
    terms = [p * q for p, q in zip(a, b, strict=True) if not (is_zero(p) or is_zero(q))]
    return sum(terms[1:], terms[0]) if terms else 0.0


def is_zero(element: Element) -> bool:
    """Whether it is the number 0, and not an array."""
    return isinstance(element, float) and element == 0.0


def stacked(matrix: Matrix, size: tuple[int, int], like: Array) -> Array:
    """The elements as an array ``(c, *size)``, each ``(c,)`` as ``like`` or a number."""
    if 0 in size:
        return jnp.zeros((*like.shape, *size), dtype=like.dtype)

    def wide(element: Element) -> Array:
        return jnp.broadcast_to(jnp.asarray(element, dtype=like.dtype), like.shape)

    return jnp.stack([jnp.stack([*map(wide, r)], axis=-1) for r in matrix], axis=-2)


def column(vector: Vector) -> list[list[Any]]:
    """As a matrix of one column."""
    return [[v] for v in vector]


def only_column(matrix: Matrix) -> list[Any]:
    """Elements of the only column."""
    return [row[0] for row in matrix]
