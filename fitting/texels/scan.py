"""Where texels begin: the cost of all of them at all candidate shapes, by matrix products.

The best candidate of one shape unknown is moved to the minimum beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.texels import between
from fitting.texels.quadratics import at_candidates, minimised
from fitting.texels.seen import Seen, linear_weights
from fitting.texels.task import Task

# In the scale of unknowns: candidates as close as this lead to the same minimum.
_APART = 0.7


class Starts(NamedTuple):
    """The best distinct starts of every texel, best first, with their candidates' costs."""

    u: Float[Array, "t s k"]
    cost: Float[Array, "t s"]
    x: Float[Array, "t s c m"]


def scan(task: Task, seen: Seen, count: int) -> Starts:
    """The ``count`` best candidates that are far from each other, for texels ``(t, ...)``.

    The residual is linearised at the data. Weights have a leading 1 where they are those of
    all. A cost is infinite where there is no further candidate.
    """
    exact = seen.values.dtype
    heavy = linear_weights(task, seen)
    if heavy.shape[0] > 1:
        # Of no weight is the square out of range.
        largest = jnp.max(heavy, axis=(1, 2), keepdims=True)
        heavy = heavy / jnp.where(largest > 0, largest, 1.0)
    # Half the precision and time: what is found here is only where to begin.
    task, heavy, values = jax.tree.map(_single, (task, heavy, seen.values))
    quadratics = at_candidates(task, heavy, values)
    every = between.EVERY if task.even else 1
    points, shape = task.points[::every], (values.shape[1], values.shape[0])
    _, cost = minimised(task, jax.tree.map(lambda v: v[:, ::every], quadratics))
    cost = jnp.broadcast_to(cost, (points.shape[0], shape[1]))
    left = jnp.where(jnp.isfinite(cost), jnp.maximum(cost, 0.0), jnp.inf)
    u, x, costs = [], [], []
    for i in range(count):
        best = jax.lax.argmin(left, 0, jnp.int32)
        costs.append(jnp.min(left, axis=0))
        far = jnp.max(jnp.abs(points[:, None] - points[best]), axis=-1, initial=0) > _APART
        left = jnp.where(far, left, jnp.inf)
        if task.even and i == 0:
            place, at = between.minimum(task, quadratics, cost, best)
        else:
            place = points[best]
            at, _ = minimised(task, quadratics.at(best * every))
        u.append(place)
        x.append([jnp.broadcast_to(v, shape) for v in at])
    found = jnp.asarray(x).reshape(count, -1, *shape)
    starts = Starts(
        jnp.stack(u, axis=1), jnp.stack(costs, axis=1), jnp.transpose(found, (3, 0, 2, 1))
    )
    return jax.tree.map(lambda v: v.astype(exact), starts)


def _single(v: Array) -> Array:
    return v.astype(jnp.float32) if v.dtype == jnp.float64 else v
