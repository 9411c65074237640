"""From starts to minima: the scan that finds starts, and the descent from one of them."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting import qp, reduced, row_sums
from fitting.compiled import compiled
from fitting.reduced import Blocks, Problem


class Solution(NamedTuple):
    """Where a start ended: unknowns, the blocks there, and how it got there."""

    u: Float[Array, " k"]
    x: Float[Array, "c m"]
    cost: Float[Array, ""]
    blocks: Blocks
    steps: Int[Array, ""]
    converged: Bool[Array, ""]


@compiled(row_sums.FAST)
def refine(
    problem: Problem,
    u0: Float[Array, " k"],
    x0: Float[Array, "c m"],
    rtol: Float[Array, ""] | None = None,
) -> Solution:
    """Run the solver from one start to the nearest minimum.

    ``rtol`` is that of `ArrowLevenbergMarquardt`, whose own is as tight as rounding allows.
    """
    # Only where it has to be traced: loading optimistix takes longer than the fit.
    from fitting.levenberg_marquardt import descend

    return descend(problem, u0, x0, rtol)


@compiled(row_sums.FAST)
def scan(
    problem: Problem, candidates: Float[Array, "p k"]
) -> tuple[Float[Array, " p"], Float[Array, "p c m"]]:
    """Cost and coefficients of many shapes, with the residual linearised at the data.

    Without penalties. The cost of a shape at which the model is not finite is infinite.
    """
    unknowns = problem.unknowns
    c, m = problem.target.shape[0], unknowns.n_coefficients

    def moments(u: Array) -> tuple[Array, Array, Array]:
        a, da_dx, _ = reduced.amplitudes(problem, u, jnp.zeros((c, m), dtype=u.dtype))
        gram, moment, square = row_sums.linear_moments(problem, u)
        here = qp.product(gram, a)
        slope = jnp.einsum("cbm,cb->cm", da_dx, here - moment)
        gram = jnp.broadcast_to(gram, (c, *gram.shape[1:]))
        curvature = jnp.einsum("cbm,cbd,cdn->cmn", da_dx, gram, da_dx)
        return curvature, slope, square + jnp.sum(a * (here - 2.0 * moment))

    curvature, slope, cost = jax.lax.map(moments, candidates)
    finite = jnp.isfinite(cost)
    if m:
        # All at once, which no shape may spoil for the others.
        finite &= jnp.all(jnp.isfinite(curvature), axis=(1, 2, 3))
        h = jnp.where(finite[:, None, None, None], curvature, jnp.eye(m))
        g = jnp.where(finite[:, None, None], slope, 0.0)
        limits = jnp.tile(unknowns.limits, (cost.shape[0], 1))
        pull = -g.reshape(-1, m)
        x = qp.solve(h.reshape(-1, m, m), pull, unknowns.rows, limits).x.reshape(g.shape)
        cost = cost + jnp.sum((2.0 * g + qp.product(h, x)) * x, axis=(1, 2))
    else:
        x = jnp.zeros_like(slope)
    return jnp.where(finite, jnp.maximum(cost, 0.0), jnp.inf), x
