"""How well the directions of one texel determine its unknowns.

The covariance of `fitting.uncertainty`: the sandwich of White (1980), all channels of a
row together, residuals inflated by their leverage (HC2, MacKinnon and White 1985). It is
the sum of squares of every row's influence on an unknown, in one pass over the rows.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.reduced import Blocks
from fitting.texels import small
from fitting.texels.arrow import add_up, columns
from fitting.texels.descent import on_free
from fitting.texels.seen import Seen, misfit, of_channel
from fitting.texels.task import Task

# A row that determines an unknown all by itself says nothing about its error.
_LEAST_FREEDOM = 1e-3


class Spread(NamedTuple):
    """Standard uncertainties of the unknowns, NaN of a coefficient that a bound holds; and
    the data's cost at ``(u, x)``."""

    u: Float[Array, " k"]
    x: Float[Array, "c m"]
    cost: Float[Array, ""]


def spread(
    task: Task, seen: Seen, b: Blocks, u: Float[Array, " k"], x: Float[Array, "c m"]
) -> Spread:
    """The square roots of the sandwich's diagonal at ``(u, x)``, where blocks still hold
    that are those of the data alone."""
    (channels, m), k = b.x.shape, u.shape[0]
    free, h_xx, h_xu = on_free(task, b)
    units = [[jnp.full(channels, float(i == j)) for i in range(m)] for j in range(m)]
    solved = small.solve(h_xx, [*h_xu, *units])
    responses, inverse = solved[:k], solved[k:]
    schur = [
        [b.h_uu[p, q] - jnp.sum(jnp.asarray(small.dot(h_xu[p], r)))
         for q, r in enumerate(responses)]
        for p in range(k)
    ]  # fmt: skip
    unit = [[jnp.asarray(float(p == q)) for p in range(k)] for q in range(k)]
    of_u = small.solve(schur, unit)

    pulls, own, squares = [], [], []
    for c, (value, in_x, in_u) in enumerate(columns(task, u, x)):
        misfitted, w = misfit(task, of_channel(seen, c), value)
        in_x = [jnp.where(free[c, i], w * v, 0.0) for i, v in enumerate(in_x)]
        # What a row tells of the shape when the coefficients have followed.
        alone = [
            w * v - small.dot([responses[q][i][c] for i in range(m)], in_x)
            for q, v in enumerate(in_u)
        ]
        ahead = [small.dot([inverse[j][i][c] for j in range(m)], in_x) for i in range(m)]
        leverage = small.dot(in_x, ahead)
        leverage = leverage + small.dot(alone, [small.dot(r, alone) for r in of_u])
        rest = jnp.maximum(1.0 - leverage, _LEAST_FREEDOM)
        r = misfitted / jnp.sqrt(rest)
        squares.append(misfitted * misfitted)
        pulls.append([v * r for v in alone])
        own.append([v * r for v in ahead])
    moved = [small.dot(row, [sum(p[q] for p in pulls) for q in range(k)]) for row in of_u]
    influence = [*moved]
    for c in range(channels):
        influence += [
            own[c][i] - small.dot([responses[q][i][c] for q in range(k)], moved)
            for i in range(m)
        ]
    *sums, cost = add_up([*(v * v for v in influence), sum(squares[1:], squares[0])])
    found = jnp.sqrt(jnp.stack(sums)) if sums else jnp.zeros(0)
    of_x = found[k:].reshape(channels, m)
    return Spread(found[:k], jnp.where(free, of_x, jnp.nan), cost)
