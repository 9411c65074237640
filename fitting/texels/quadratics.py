"""What the cost of texels is at given shapes: bounded quadratics in a few coefficients.

Directions are shared, and so are the basis functions at a shape: products with the values
of many texels are one matrix product.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from fitting import qp
from fitting.texels.box import best_of_choices
from fitting.texels.task import Task


class Quadratics(NamedTuple):
    """``constant - 2 b' x + x' H x`` of channels, candidates, texels, by element.

    Of the size ``(c, p, t)``, where 1 stands for all.
    """

    hessian: list[list[Array]]
    linear: list[Array]
    constant: Array

    def at(self, index: Int[Array, " t"]) -> Quadratics:
        """Those of one candidate for every texel; gives ``(c, t)``, of which 1 is all."""
        return jax.tree.map(lambda v: at(v, index), self)


def at(v: Float[Array, "c p t"], index: Int[Array, "*s t"]) -> Float[Array, "c *s t"]:
    """Elements of chosen candidates of every texel."""
    if v.shape[1] == 1:
        return v[:, 0]
    texel = jnp.arange(v.shape[2], dtype=index.dtype) if v.shape[2] > 1 else 0
    return v.at[:, index, texel].get(mode="promise_in_bounds")


def minimised(task: Task, q: Quadratics) -> tuple[list[Array], Array]:
    """The best coefficients, by element, and the cost ``(p, t)`` of all channels.

    With or without an axis of candidates.
    """
    m = len(q.linear)
    if task.box.is_small:
        axes = (-1, *(1,) * (q.constant.ndim - 1))
        ends = [[(s, v.reshape(axes)) for s, v in task.box.ends(i)] for i in range(m)]
        x, gain = best_of_choices(q.hessian, q.linear, ends)
    else:
        x, gain = _by_pivoting(task, q)
    return x, jnp.sum(q.constant - 2.0 * gain, axis=0)


def _by_pivoting(task: Task, q: Quadratics) -> tuple[list[Array], Array]:
    """The same where there are too many coefficients to try what is at a bound."""
    m = len(q.linear)
    shape = jnp.broadcast_shapes(*(v.shape for v in jax.tree.leaves(q[:2])))

    def flat(v: Array) -> Array:
        return jnp.broadcast_to(v, shape).reshape(-1)

    h = jnp.stack([jnp.stack([*map(flat, row)], axis=-1) for row in q.hessian], axis=-2)
    b = jnp.stack([*map(flat, q.linear)], axis=-1)

    def ends(v: Array) -> Array:
        v = jnp.expand_dims(v, tuple(range(1, len(shape))))
        return jnp.broadcast_to(v, (*shape, m)).reshape(-1, m)

    x, _ = qp.within(h, b, ends(task.box.low), ends(task.box.high))
    gain = jnp.sum(x * (b - 0.5 * qp.product(h, x)), axis=-1)
    return [x[:, i].reshape(shape) for i in range(m)], gain.reshape(shape)


def at_candidates(task: Task, heavy: Array, values: Array) -> Quadratics:
    """All products of texels with candidates, one matrix product per kind."""
    offset, m = task.offset, len(task.moving)
    columns = [
        task.columns[:, i] if moves else task.columns[:, i, :1]
        for i, moves in enumerate(task.moving)
    ]
    per_texel = heavy.shape[0] > 1
    square = heavy * heavy
    weighed = square * values

    def with_values(wide: Array) -> Array:
        """``(c, p, t)``: weighted values times functions ``(d, p, n)`` of candidates."""
        by_channel = [
            jnp.einsum("tn,pn->pt", weighed[:, c], wide[min(c, wide.shape[0] - 1)])
            for c in range(values.shape[1])
        ]
        return jnp.stack(by_channel)

    def among(one: Array, other: Array) -> Array:
        """The weighted sum of a product of functions, ``(1 or c, p, 1 or t)``."""
        both = one * other
        if not per_texel:
            return jnp.sum(square[0][:, None, :] * both, axis=-1)[..., None]
        if both.shape[0] == 1:
            return jnp.einsum("tcn,pn->cpt", square, both[0])
        return jnp.einsum("tcn,cpn->cpt", square, both)

    hessian: list[list[Array]] = [[] for _ in range(m)]
    for i in range(m):
        for j in range(i + 1):
            hessian[i].append(among(columns[i], columns[j]))
    full = [[hessian[max(i, j)][min(i, j)] for j in range(m)] for i in range(m)]
    linear = [with_values(columns[i]) for i in range(m)]
    constant = jnp.sum(weighed * values, axis=-1).T[:, None]
    if task.shifted or not m:
        linear = [b - among(columns[i], offset) for i, b in enumerate(linear)]
        constant = constant - 2.0 * with_values(offset) + among(offset, offset)
    return Quadratics(full, linear, constant)
