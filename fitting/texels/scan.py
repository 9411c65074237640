"""Where texels begin: the cost of all of them at all candidate shapes, by matrix products.

Directions are shared, and so are the basis functions at a candidate shape: products with
the values of many texels are one matrix product, and what is left per texel, candidate and
channel is a bounded quadratic in a few coefficients.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting import qp
from fitting.texels.box import best_of_choices
from fitting.texels.task import Task


class Starts(NamedTuple):
    """The best distinct starts of every texel, best first, with their candidates' costs."""

    u: Float[Array, "t s k"]
    cost: Float[Array, "t s"]
    x: Float[Array, "t s c m"]


class _Quadratics(NamedTuple):
    """``constant - 2 b' x + x' H x`` for texels, channels and candidates, by element.

    Leading sizes of 1 stand for all texels, all channels or all candidates.
    """

    hessian: list[list[Array]]
    linear: list[Array]
    constant: Array

    def at(self, index: Array) -> _Quadratics:
        """Those of chosen candidates ``(t, s)`` of every texel."""

        def chosen(v: Array) -> Array:
            if v.shape[-1] == 1:
                return v
            wide = jnp.broadcast_to(v, (index.shape[0], *v.shape[1:]))
            return jnp.take_along_axis(wide, index[:, None, :], axis=2)

        hessian = [[chosen(v) for v in row] for row in self.hessian]
        return _Quadratics(hessian, [*map(chosen, self.linear)], chosen(self.constant))


def scan(
    task: Task, heavy: Float[Array, "t w n"], values: Float[Array, "t c n"], count: int
) -> Starts:
    """The ``count`` best candidates that are far from each other, for texels.

    ``heavy`` has a leading 1 where all texels have the same weights. A cost is infinite
    where there is no further candidate.
    """
    exact = values.dtype
    # Half the precision and time: what is found here is only where to begin.
    task, heavy, values = jax.tree.map(_single, (task, heavy, values))
    quadratics = _quadratics(task, heavy, values)
    _, cost = _minimised(task, quadratics)
    left = jnp.where(jnp.isfinite(cost), jnp.maximum(cost, 0.0), jnp.inf)
    chosen, places, costs = [], [], []
    for _ in range(count):
        best = jnp.argmin(left, axis=1)
        chosen.append(best)
        places.append(_between(task, cost, best))
        costs.append(jnp.take_along_axis(left, best[:, None], axis=1)[:, 0])
        left = jnp.where(task.apart[best], left, jnp.inf)
    index = jnp.stack(chosen, axis=1)
    x, _ = _minimised(task, quadratics.at(index))
    shape = (values.shape[0], values.shape[1], count)
    if not x:
        found = jnp.zeros((*shape, 0), dtype=values.dtype)
    else:
        found = jnp.stack([jnp.broadcast_to(v, shape) for v in x], axis=-1)
    starts = Starts(
        jnp.stack(places, axis=1), jnp.stack(costs, axis=1), jnp.swapaxes(found, 1, 2)
    )
    return jax.tree.map(lambda v: v.astype(exact), starts)


def _single(v: Array) -> Array:
    return v.astype(jnp.float32) if v.dtype == jnp.float64 else v


def _between(task: Task, cost: Array, best: Array) -> Array:
    """The shape ``(t, k)`` of the best candidate; of one unknown, whose candidates are in
    order, the minimum of the parabola through its neighbours."""
    points = task.points
    if points.shape[1] != 1 or points.shape[0] < 3:
        return points[best]
    middle = jnp.clip(best, 1, points.shape[0] - 2)
    below, here, above = (
        jnp.take_along_axis(cost, (middle + d)[:, None], axis=1)[:, 0] for d in (-1, 0, 1)
    )
    bend = below - 2.0 * here + above
    slope = below - above
    usable = (bend > 0) & jnp.isfinite(bend) & (middle == best)
    step = jnp.where(usable, 0.5 * slope / jnp.where(usable, bend, 1.0), 0.0)
    lower, centre, upper = (points[middle + d] for d in (-1, 0, 1))
    step = jnp.clip(step, -0.6, 0.6)[:, None]
    between = centre + step * (
        0.5 * (upper - lower) + 0.5 * step * (upper - 2 * centre + lower)
    )
    return jnp.where(usable[:, None], between, points[best])


def _minimised(task: Task, q: _Quadratics) -> tuple[list[Array], Array]:
    """The best coefficients, by element, and the cost ``(t, p)`` of all channels."""
    m = len(q.linear)
    if task.box.is_small:
        ends = [[(s, v[:, None]) for s, v in task.box.ends(i)] for i in range(m)]
        x, gain = best_of_choices(q.hessian, q.linear, ends)
    else:
        x, gain = _by_interior_points(task, q)
    return x, jnp.sum(q.constant - 2.0 * gain, axis=1)


def _by_interior_points(task: Task, q: _Quadratics) -> tuple[list[Array], Array]:
    """The same where there are too many coefficients to try what is at a bound."""
    m, shape = len(q.linear), q.linear[0].shape

    def flat(v: Array) -> Array:
        return jnp.broadcast_to(v, shape).reshape(-1)

    h = jnp.stack([jnp.stack([*map(flat, row)], axis=-1) for row in q.hessian], axis=-2)
    b = jnp.stack([*map(flat, q.linear)], axis=-1)
    unknowns = task.problem.unknowns
    limits = unknowns.limits[None, :, None, :]
    limits = jnp.broadcast_to(limits, (*shape, limits.shape[-1])).reshape(b.shape[0], -1)
    x = qp.solve(h, b, unknowns.rows, limits).x
    gain = jnp.sum(x * (b - 0.5 * qp.product(h, x)), axis=-1)
    return [x[:, i].reshape(shape) for i in range(m)], gain.reshape(shape)


def _quadratics(task: Task, heavy: Array, values: Array) -> _Quadratics:
    """All products of texels with candidates, one matrix product per kind."""
    columns, offset = task.columns, task.offset
    m = columns.shape[1]
    per_texel = heavy.shape[0] > 1
    square = heavy * heavy
    weighed = square * values

    def with_values(wide: Array) -> Array:
        """``(t, c, p)``: weighted values times functions ``(d, p, n)`` of candidates."""
        if wide.shape[0] == 1:
            return jnp.einsum("tcn,pn->tcp", weighed, wide[0])
        return jnp.einsum("tcn,cpn->tcp", weighed, wide)

    def among(one: Array, other: Array) -> Array:
        """The weighted sum of a product of functions, ``(1 or t, 1 or c, p)``."""
        both = one * other
        if not per_texel:
            return jnp.sum(square[0][:, None, :] * both, axis=-1)[None]
        if both.shape[0] == 1:
            return jnp.einsum("tcn,pn->tcp", square, both[0])
        return jnp.einsum("tcn,cpn->tcp", square, both)

    hessian: list[list[Array]] = [[] for _ in range(m)]
    for i in range(m):
        for j in range(i + 1):
            hessian[i].append(among(columns[:, i], columns[:, j]))
    full = [[hessian[max(i, j)][min(i, j)] for j in range(m)] for i in range(m)]
    linear = [with_values(columns[:, i]) for i in range(m)]
    constant = jnp.sum(weighed * values, axis=-1)[:, :, None]
    if task.shifted or not m:
        linear = [b - among(columns[:, i], offset) for i, b in enumerate(linear)]
        constant = constant - 2.0 * with_values(offset) + among(offset, offset)
    return _Quadratics(full, linear, constant)
