"""From starts to minima: the scan that finds starts, and the descent from one of them."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting import qp, reduced, row_sums
from fitting.compiled import compiled
from fitting.reduced import Blocks, Problem

# Values of basis functions.
_MANY = 4_000_000


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

    # Loops leave other cores idle, and may not write all basis functions at once.
    size = candidates.shape[0] * problem.kappa.size * max(1, row_sums.n_basis(problem))
    at_once = row_sums.alike(problem) and size <= _MANY
    each = jax.vmap(moments) if at_once else partial(jax.lax.map, moments)
    curvature, slope, cost = each(candidates)
    finite = jnp.isfinite(cost)
    if m:
        # All at once, which no shape may spoil for the others.
        finite &= jnp.all(jnp.isfinite(curvature), axis=(1, 2, 3))
        h = jnp.where(finite[:, None, None, None], curvature, jnp.eye(m))
        g = jnp.where(finite[:, None, None], slope, 0.0)
        x, _ = unknowns.best(h.reshape(-1, m, m), -g.reshape(-1, m))
        x = x.reshape(g.shape)
        cost = cost + jnp.sum((2.0 * g + qp.product(h, x)) * x, axis=(1, 2))
    else:
        x = jnp.zeros_like(slope)
    return jnp.where(finite, jnp.maximum(cost, 0.0), jnp.inf), x
