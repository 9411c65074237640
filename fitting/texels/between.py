"""Between the candidates of one shape unknown: where the cost of texels is least there.

All that the cost takes from the data at a shape are a few products, smooth functions of
that shape. Polynomials through their values at neighbouring candidates, which are evenly
apart, stand for them, so that a minimum is found without looking at a direction again.
What is left to be done with the exact functions is mostly one step.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from fitting.texels import small
from fitting.texels.quadratics import Quadratics, at, minimised
from fitting.texels.task import Task

# Of a polynomial, the nearest candidate in the middle if there are enough to each side.
_NODES = 9
_HALF = _NODES // 2
# Of the candidates, that many times fewer are enough to find the best.
EVERY = 2
_THREE = np.arange(-1, 2, dtype=np.int32)
_FURTHEST = 0.6
# Coefficients of powers, by node, of the polynomial that is 1 there and 0 at the others.
_POWERS = np.linalg.inv(np.vander(np.arange(-_HALF, _HALF + 1.0), increasing=True)).T


def minimum(
    task: Task, q: Quadratics, cost: Float[Array, "s t"], best: Int[Array, " t"]
) -> tuple[Float[Array, "t 1"], list[Array]]:
    """The shape with the least cost near the best candidate, and coefficients ``(c, t)``.

    ``cost`` is that of every `EVERY`-th candidate, of which the ``best`` is one. A parabola
    through three costs, and from its minimum a step of Newton's method.
    """
    middle = jnp.clip(best, 1, cost.shape[0] - 2)
    three = middle + _THREE[:, None]
    below, here, above = at(cost[None], three)[0]
    step = _step(0.5 * (above - below), below - 2.0 * here + above)
    place = EVERY * (middle.astype(cost.dtype) + step)
    nearest = jnp.round(place).astype(best.dtype)
    centre = jnp.clip(nearest, _HALF, task.points.shape[0] - 1 - _HALF)
    place = place - centre.astype(place.dtype)
    slope, bend, x = _profile(task, q, centre, place)
    place = jnp.clip(place + _step(slope, bend), -_HALF, _HALF)
    apart = task.points[1] - task.points[0]
    return task.points[centre] + place[:, None] * apart, x


def _step(slope: Array, bend: Array) -> Array:
    """To where a quadratic is least, in units between two candidates."""
    usable = (bend > 0) & jnp.isfinite(slope) & jnp.isfinite(bend)
    step = jnp.where(usable, -slope / jnp.where(usable, bend, 1.0), 0.0)
    return jnp.clip(step, -_FURTHEST, _FURTHEST)


def _profile(
    task: Task, q: Quadratics, centre: Array, place: Array
) -> tuple[Array, Array, list[Array]]:
    """Derivatives ``(t,)`` of the least cost along the shape, and its coefficients."""
    m = len(q.linear)
    h, b, k = _interpolated(q, centre, place)
    value = [[e[0] for e in row] for row in h]
    x, _ = minimised(task, Quadratics(value, [e[0] for e in b], k[0]))
    low, high = task.box.low, task.box.high
    held = [(v <= low[:, i, None]) | (v >= high[:, i, None]) for i, v in enumerate(x)]
    free = [
        [jnp.where(held[i] | held[j], float(i == j), value[i][j]) for j in range(m)]
        for i in range(m)
    ]
    turned = [small.dot([e[1] for e in row], x) for row in h]
    pull = [jnp.where(w, 0.0, e[1] - v) for w, e, v in zip(held, b, turned, strict=True)]
    (follow,) = small.solve(free, [pull])
    bent = [small.dot([e[2] for e in row], x) for row in h]
    slope = k[1] - 2.0 * small.dot([e[1] for e in b], x) + small.dot(turned, x)
    bend = k[2] - 2.0 * small.dot([e[2] for e in b], x) + small.dot(bent, x)
    bend = bend - 2.0 * small.dot(pull, follow)
    wide = (task.channels, place.size)
    slope, bend = jnp.broadcast_to(slope, wide), jnp.broadcast_to(bend, wide)
    return jnp.sum(slope, axis=0), jnp.sum(bend, axis=0), x


def _interpolated(q: Quadratics, centre: Array, place: Array) -> Any:
    """Value and two derivatives in the place of every element, at places ``(t,)`` from the
    middle of the nodes; what does not depend on the shape has no derivatives."""
    nodes = centre + np.arange(-_HALF, _HALF + 1, dtype=centre.dtype)[:, None]
    leaves, tree = jax.tree.flatten(q)
    moving = [v for v in leaves if v.shape[1] > 1]
    # All in one array, written once: a few loops instead of hundreds.
    known = jax.lax.optimization_barrier(jnp.concatenate([at(v, nodes) for v in moving]))
    found = jnp.sum(_weights(place)[:, None] * known, axis=2)
    found = jax.lax.optimization_barrier(found)
    ends = np.cumsum([v.shape[0] for v in moving])
    parts = iter(jnp.split(found, ends[:-1], axis=1))
    every = [[*next(parts)] if v.shape[1] > 1 else [v[:, 0], 0.0, 0.0] for v in leaves]
    return jax.tree.unflatten(tree, every)


def _weights(place: Array) -> Float[Array, "3 nodes t"]:
    """Of every node, for the value and two derivatives at places ``(t,)``."""
    powers = jnp.asarray(_POWERS, dtype=place.dtype)[:, :, None]
    value, slope, bend = powers[:, -1] + 0.0 * place, 0.0 * place, 0.0 * place
    for i in reversed(range(_NODES - 1)):
        bend = bend * place + 2.0 * slope
        slope = slope * place + value
        value = value * place + powers[:, i]
    return jax.lax.optimization_barrier(jnp.stack([value, slope, bend]))
