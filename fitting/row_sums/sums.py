"""What a pass over the rows gives, and its parts that are symmetric."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float


class Sums(NamedTuple):
    """Over all rows: ``gram (1 or c, f, f)`` of the features times the residual's slope,
    their product with the residual ``gradient (c, f)``, and ``cost``, its square."""

    gram: Float[Array, "d f f"]
    gradient: Float[Array, "c f"]
    cost: Float[Array, ""]


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Row and column of the upper half of a matrix."""
    rows, columns = np.triu_indices(count)
    return rows, columns


def symmetric(half: Float[Array, "d h"], count: int) -> Float[Array, "d f f"]:
    """Matrices of ``count`` rows from their upper halves."""
    upper = pairs(count)
    where = np.zeros((count, count), dtype=int)
    where[upper] = where[upper[::-1]] = np.arange(upper[0].size)
    return half[:, where]
