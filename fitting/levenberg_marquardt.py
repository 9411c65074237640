"""Levenberg-Marquardt on the arrow, as a solver of optimistix.

optimistix runs the iteration and reports its outcome; what is ours is the step, which
eliminates the coefficients of every channel exactly, under their bounds, and so has to
deal with the few shared shape unknowns only.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox.internal as eqxi
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

from fitting import qp, reduced
from fitting.reduced import Blocks, Problem
from fitting.solve import Solution

_MAX_STEPS = 200
_MAX_SHAPE_STEP = 1.5
_FIRST_DAMPING = 1e-3
_NOTICEABLE = 1e-10
_MAX_IDLE = 8


def descend(problem: Problem, u0: Array, x0: Array, rtol: Array | None = None) -> Solution:
    """From a start to the nearest minimum."""
    solver = ArrowLevenbergMarquardt()
    if rtol is not None:
        solver = ArrowLevenbergMarquardt(rtol)  # pyright: ignore[reportArgumentType]

    def fn(y, args):
        return reduced.evaluate(args, y[0], y[1])

    out = optx.least_squares(
        fn, solver, (u0, x0), args=problem, max_steps=_MAX_STEPS,
        adjoint=_PlainLoop(), throw=False,
    )  # fmt: skip
    u, x = out.value
    return Solution(
        u, x, out.stats["blocks"].cost, out.stats["blocks"], out.stats["num_steps"],
        out.result == optx.RESULTS.successful,
    )  # fmt: skip


class _State(NamedTuple):
    accepted: Any
    at: tuple[Array, Array]
    damping: Array
    growth: Array
    predicted: Array
    idle: Array
    started: Array
    done: Array


class ArrowLevenbergMarquardt(optx.AbstractLeastSquaresSolver):
    """Levenberg-Marquardt for problems whose function returns `Blocks`.

    Damping is scaled by the diagonal (Marquardt) and updated by Nielsen's rule (Madsen,
    Nielsen and Tingleff 2004, eq. 2.21). Stops when the decrease that the quadratic model
    still promises is below ``rtol`` of the cost or ``atol``, or when eight accepted steps
    in a row gained less than 1e-10 of the cost.
    """

    rtol: float = 1e-13
    atol: float = 1e-28
    norm: Callable = optx.max_norm

    def init(self, fn, y, args, options, f_struct, aux_struct, tags):
        del fn, args, options, aux_struct, tags
        zero = jnp.zeros((), dtype=jnp.float64)
        blocks = jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), f_struct)
        no = jnp.asarray(False)
        start = (zero + _FIRST_DAMPING, zero + 2.0, zero + jnp.inf)
        return _State(blocks, y, *start, idle=jnp.asarray(0), started=no, done=no)

    def step(self, fn, y, args, options, state, tags):
        del options, tags
        problem: Problem = args
        new, aux = fn(y, args)
        gain = (state.accepted.cost - new.cost) / state.predicted
        finite = jnp.isfinite(new.cost)
        accept = finite & (~state.started | (new.cost < state.accepted.cost))
        shrink = jnp.maximum(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
        damping = jnp.where(accept, state.damping * shrink, state.damping * state.growth)
        damping = jnp.where(state.started, jnp.maximum(damping, 1e-14), state.damping)
        growth = jnp.where(accept, 2.0, state.growth * 2.0)

        def choose(a, b):
            return jax.tree.map(lambda p, q: jnp.where(accept, p, q), a, b)

        blocks = choose(new, state.accepted)
        at = choose((y[0], new.x), state.at)
        proposal, predicted = propose(problem, at, blocks, damping)
        small = predicted <= self.rtol * blocks.cost + self.atol * problem.scale
        stuck = damping > 1e12
        # On a flat valley the model keeps promising what rounding then eats.
        gained = state.accepted.cost - new.cost > _NOTICEABLE * new.cost
        idle = jnp.where(accept & state.started & ~gained, state.idle + 1, state.idle)
        idle = jnp.where(accept & gained, 0, idle)
        done = (state.started | accept) & (small | stuck | (idle >= _MAX_IDLE))
        state = _State(
            blocks, at, damping, growth, predicted, idle, state.started | accept, done
        )
        return proposal, state, aux

    def terminate(self, fn, y, args, options, state, tags):
        del fn, y, args, options, tags
        return state.done, optx.RESULTS.successful

    def postprocess(self, fn, y, aux, args, options, state, tags, result):
        del fn, y, args, options, tags, result
        return state.at, aux, {"blocks": state.accepted}


def propose(
    problem: Problem, at: tuple[Array, Array], b: Blocks, damping: Array
) -> tuple[tuple[Array, Array], Array]:
    """Next point and the decrease of the cost that the quadratic model promises.

    The promise is that of the reduced problem: what the coefficients gain alone plus what
    the shape gains while they follow. It is never negative, also where a bound stops a
    coefficient on the way; the next evaluation then tells whether the step was too long.
    """
    u, x = at
    unknowns = problem.unknowns
    m, k = x.shape[1], u.shape[0]
    diagonal = jnp.einsum("cmm->cm", b.h_xx)
    damped = b.h_xx + (damping * diagonal)[:, :, None] * jnp.eye(m, dtype=x.dtype)

    def coefficients(step: Array) -> tuple[Array, Array]:
        pull = qp.product(damped, x) - b.g_x
        pull = pull - jnp.einsum("cmk,k->cm", b.h_xu, step)
        best, inverse = unknowns.best(damped, pull, x)
        return best - x, jnp.einsum("cmn,cnk->cmk", inverse, b.h_xu)

    def shape_step(x_step: Array, response: Array) -> tuple[Array, Array]:
        schur = b.h_uu - jnp.einsum("cmk,cml->kl", b.h_xu, response)
        gradient = b.g_u + jnp.einsum("cmk,cm->k", b.h_xu, x_step)
        scale = jnp.maximum(jnp.diagonal(b.h_uu) * 1e-12, jnp.diagonal(schur))
        matrix = schur + jnp.diag(damping * scale + 1e-300)
        step = -qp.product(qp.inverse(matrix), gradient)
        longest = jnp.max(jnp.abs(step)).clip(1e-300)
        step = step * jnp.minimum(1.0, _MAX_SHAPE_STEP / longest)
        change = 2.0 * jnp.dot(gradient, step) + jnp.dot(step, schur @ step)
        return step, jnp.maximum(-change, 0.0)

    def coefficient_gain(x_step: Array) -> Array:
        slope = 2.0 * b.g_x + qp.product(b.h_xx, x_step)
        return jnp.maximum(-jnp.sum(slope * x_step), 0.0)

    step, x_step = jnp.zeros_like(u), jnp.zeros_like(x)
    promise = jnp.zeros((), dtype=x.dtype)
    if m and k:
        # Once to see how the coefficients respond, once more after the shape has moved;
        # in a loop, so that the quadratic program is compiled once.
        def alternate(i: Array, carry: tuple[Array, Array, Array]):
            x_step, response = coefficients(carry[0])
            step, gain = shape_step(x_step, response)
            gain = gain + coefficient_gain(x_step)
            first = i == 0
            kept = jnp.where(first, step, carry[0]), jnp.where(first, gain, carry[2])
            return kept[0], x_step, kept[1]

        step, x_step, promise = jax.lax.fori_loop(0, 2, alternate, (step, x_step, promise))
    elif m:
        x_step, _ = coefficients(step)
        promise = coefficient_gain(x_step)
    elif k:
        step, promise = shape_step(x_step, jnp.zeros_like(b.h_xu))
    return (u + step, x + x_step), promise


class _PlainLoop(optx.AbstractAdjoint):
    """Run the iteration without a derivative rule; fits are not differentiated through."""

    def apply(self, primal_fn, rewrite_fn, inputs, tags):
        del rewrite_fn, tags

        def loop(cond, body, init, *, max_steps):
            return eqxi.while_loop(cond, body, init, max_steps=max_steps, kind="lax")

        return primal_fn((*inputs, loop))
