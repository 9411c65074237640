"""Levenberg-Marquardt for one texel, a few steps at a time, mapped over many.

The step is that of `fitting.solve`, cheaper: where the coefficients follow from the shape,
those at a bound that their gradient pushes against are held there (Bertsekas 1982, SIAM J.
Control Optim. 20, 221) instead of a quadratic program per proposal; else such a program is
solved by trying which of a few bounds hold.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.reduced import Blocks
from fitting.texels import small
from fitting.texels.arrow import evaluate
from fitting.texels.box import best_of_choices, held_at
from fitting.texels.seen import Seen, size
from fitting.texels.task import Task

# What a last step, whose end is not looked at again, may leave to be gained, as a share of
# the cost: that is far within 1e-3 of a standard uncertainty of the minimum. A step that
# gained less or more than was promised, by a share of that, leaves the promise times the
# share's square. It is not counted on to be smaller than the second figure, which stands
# for the first step too; of this one `fitting.texels.outcome` checks the gain.
_LEFT = 1e-9
_LEAST_SURPRISE = 0.01
# Of the weighted data: nothing.
_NO_STEP = 1e-20
_MAX_SHAPE_STEP = 1.5
_FIRST_DAMPING = 1e-3
_NOTICEABLE = 1e-10
_MAX_IDLE = 8
_STUCK = 1e12


class State(NamedTuple):
    """Where a texel is (``u``, the blocks there) and what it will try next.

    At the end the last step is still ahead.
    """

    u: Float[Array, " k"]
    blocks: Blocks
    next_u: Float[Array, " k"]
    next_x: Float[Array, "c m"]
    damping: Float[Array, ""]
    growth: Float[Array, ""]
    predicted: Float[Array, ""]
    idle: Int[Array, ""]
    steps: Int[Array, ""]
    done: Bool[Array, ""]


def begin(task: Task, u: Float[Array, " k"], x: Float[Array, "c m"]) -> State:
    """The state before the first evaluation."""
    c, m = x.shape
    k = u.shape[0]

    def zeros(*shape: int) -> Array:
        return jnp.zeros(shape, dtype=x.dtype)

    nowhere = jnp.asarray(jnp.inf, dtype=x.dtype)
    blocks = Blocks(
        x, nowhere, zeros(k), zeros(c, m), zeros(k, k), zeros(c, m, k), zeros(c, m, m)
    )
    return State(
        u, blocks, u, x, zeros() + _FIRST_DAMPING, zeros() + 2.0, nowhere,
        idle=jnp.asarray(0), steps=jnp.asarray(0), done=jnp.asarray(False),
    )  # fmt: skip


def descend(
    task: Task, seen: Seen, state: State, until: Int[Array, ""] | np.ndarray
) -> State:
    """Steps until the texel is finished or has taken ``until`` of them."""
    scale = size(task, seen)

    def step(s: State) -> State:
        new = evaluate(task, seen, s.next_u, s.next_x)
        first = s.steps == 0
        gained = s.blocks.cost - new.cost
        accept = jnp.isfinite(new.cost) & (first | (gained > 0))
        gain = jnp.where(first, 0.5, gained / s.predicted)
        shrink = jnp.maximum(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
        damping = s.damping * jnp.where(accept, jnp.where(first, 1.0, shrink), s.growth)
        damping = jnp.maximum(damping, 1e-14)
        growth = jnp.where(accept, 2.0, s.growth * 2.0)

        def choose(a, b):
            return jax.tree.map(lambda p, q: jnp.where(accept, p, q), a, b)

        u, blocks = choose((s.next_u, new), (s.u, s.blocks))
        noticed = first | (gained > _NOTICEABLE * new.cost)
        idle = jnp.where(accept, jnp.where(noticed, 0, s.idle + 1), s.idle)
        next_u, next_x, predicted, whole = propose(task, u, blocks, damping)
        surprise = jnp.where(first, 0.0, jnp.maximum(jnp.abs(1.0 - gain), damping))
        near = whole * surprise.clip(_LEAST_SURPRISE, 1.0) ** 2 <= _LEFT * blocks.cost
        near = near | (whole <= _NO_STEP * scale)
        stuck = (damping > _STUCK) | (idle >= _MAX_IDLE)
        next_u = jnp.where(stuck, u, next_u)
        next_x = jnp.where(stuck, blocks.x, next_x)
        done = near | stuck
        return State(
            u, blocks, next_u, next_x, damping, growth, predicted, idle, s.steps + 1, done
        )

    return jax.lax.while_loop(lambda s: ~s.done & (s.steps < until), step, state)


def propose(
    task: Task, u: Array, b: Blocks, damping: Array
) -> tuple[Array, Array, Array, Array]:
    """The next shape and coefficients, and the decrease that the quadratic promises: there,
    and where it is least."""
    if task.problem.resolves or not task.box.is_small:
        return _with_held(task, u, b, damping)
    return _within_box(task, u, b, damping)


def _with_held(
    task: Task, u: Array, b: Blocks, damping: Array
) -> tuple[Array, Array, Array, Array]:
    """Coefficients at a bound stay there that their gradient pushes against it."""
    x, k, m = b.x, u.shape[0], b.x.shape[1]
    free, h_xx, h_xu = on_free(task, b)
    pull = [jnp.where(free[:, i], b.g_x[:, i], 0.0) for i in range(m)]
    # Where the coefficients follow exactly, only the shape needs holding back.
    stiffer = 1.0 if task.problem.resolves else 1.0 + damping
    *responses, along = small.solve(_stiffened(h_xx, stiffer), [*h_xu, pull])
    promise = jnp.sum(jnp.asarray(small.dot(pull, along)))
    whole = promise * stiffer
    x_step = [-v for v in along]
    if k:
        step, gain, more = _shape(b, h_xu, responses, x_step, damping)
        whole, promise = whole + more, promise + gain
        for r, v in zip(responses, step, strict=True):
            x_step = [s - p * v for s, p in zip(x_step, r, strict=True)]
        u = u + jnp.stack(step)
    if m:
        x = jnp.clip(x + jnp.stack(x_step, axis=-1), task.box.low, task.box.high)
    return u, x, jnp.maximum(promise, 0.0), whole


def _within_box(
    task: Task, u: Array, b: Blocks, damping: Array
) -> tuple[Array, Array, Array, Array]:
    """The best coefficients within their bounds, before and after the shape moves."""
    x, k, m = b.x, u.shape[0], b.x.shape[1]
    h_xx = [[b.h_xx[:, i, j] for j in range(m)] for i in range(m)]
    h_xu = [[b.h_xu[:, i, p] for i in range(m)] for p in range(k)]
    own, g_x = [x[:, i] for i in range(m)], [b.g_x[:, i] for i in range(m)]
    stiff = _stiffened(h_xx, 1.0 + damping)
    rest = [small.dot(row, own) - g for row, g in zip(stiff, g_x, strict=True)]
    ends = [task.box.ends(i) for i in range(m)]

    def best(step: small.Vector) -> list[Array]:
        linear = [
            v - small.dot([h_xu[p][i] for p in range(k)], step) for i, v in enumerate(rest)
        ]
        return best_of_choices(stiff, linear, ends)[0] if m else []

    alone = best([0.0] * k)
    low, high = task.box.low, task.box.high
    held = [(v <= low[:, i]) | (v >= high[:, i]) for i, v in enumerate(alone)]
    x_step = [v - w for v, w in zip(alone, own, strict=True)]
    bent = [2.0 * g + small.dot(row, x_step) for g, row in zip(g_x, h_xx, strict=True)]
    promise = jnp.maximum(-jnp.sum(jnp.asarray(small.dot(bent, x_step))), 0.0)
    whole = promise * (1.0 + damping)
    if k:
        masked = [
            [jnp.where(held[i] | held[j], float(i == j), v) for j, v in enumerate(row)]
            for i, row in enumerate(stiff)
        ]
        free_xu = [
            [jnp.where(h, 0.0, v) for h, v in zip(held, r, strict=True)] for r in h_xu
        ]
        responses = small.solve(masked, free_xu)
        step, gain, more = _shape(b, h_xu, responses, x_step, damping)
        whole, promise = whole + more, promise + jnp.maximum(gain, 0.0)
        u, alone = u + jnp.stack(step), best(step)
    return u, jnp.stack(alone, axis=-1) if m else x, promise, whole


def _stiffened(matrix: small.Matrix, factor: Array | float) -> list[list[Array]]:
    return [
        [v * factor if i == j else v for j, v in enumerate(row)]
        for i, row in enumerate(matrix)
    ]


def _shape(
    b: Blocks,
    h_xu: small.Matrix,
    responses: small.Matrix,
    x_step: small.Vector,
    damping: Array,
) -> tuple[list[Array], Array, Array]:
    """The step of the shape after one of the coefficients, which respond to it; what it
    gains, and what would be gained without damping."""
    every = range(len(h_xu))
    schur = [
        [b.h_uu[p, q] - jnp.sum(jnp.asarray(small.dot(h_xu[p], responses[q])))
         for q in every]
        for p in every
    ]  # fmt: skip
    gradient = [b.g_u[p] + jnp.sum(jnp.asarray(small.dot(h_xu[p], x_step))) for p in every]
    step, most = _shape_step(schur, gradient, jnp.diagonal(b.h_uu), damping)
    bent = [2.0 * g + small.dot(row, step) for g, row in zip(gradient, schur, strict=True)]
    return step, -jnp.asarray(small.dot(bent, step)), most


def _shape_step(
    schur: small.Matrix, gradient: small.Vector, diagonal: Array, damping: Array
) -> tuple[list[Array], Array]:
    """The damped step, no longer than `_MAX_SHAPE_STEP` in any unknown; and what that
    without damping would gain."""
    plain, damped = [list(row) for row in schur], [list(row) for row in schur]
    for p, row in enumerate(schur):
        least = jnp.maximum(row[p], 1e-12 * diagonal[p])
        plain[p][p] = least + 1e-300
        damped[p][p] = row[p] + damping * least + 1e-300
    down = [-g for g in gradient]
    (step,), (free,) = small.solve(damped, [down]), small.solve(plain, [down])
    longest = functools.reduce(jnp.maximum, [abs(v) for v in step])
    share = jnp.minimum(1.0, _MAX_SHAPE_STEP / jnp.maximum(longest, 1e-300))
    return [v * share for v in step], jnp.asarray(small.dot(down, free))


def on_free(
    task: Task, b: Blocks
) -> tuple[Bool[Array, "c m"], list[list[Array]], list[list[Array]]]:
    """Which coefficients no bound holds, and by element ``h_xx`` and, for each shape
    unknown, ``h_xu``, with the identity and nothing for those that are held."""
    k, m = b.h_uu.shape[0], b.x.shape[1]
    free = ~held_at(task.box, b.x, b.g_x)
    h_xx = [
        [
            jnp.where(free[:, i] & free[:, j], b.h_xx[:, i, j], float(i == j))
            for j in range(m)
        ]
        for i in range(m)
    ]
    h_xu = [
        [jnp.where(free[:, i], b.h_xu[:, i, p], 0.0) for i in range(m)] for p in range(k)
    ]
    return free, h_xx, h_xu
