"""What is known of a texel at the end: parameters, their uncertainties, how it went."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting.parameters import is_flat
from fitting.texels.arrow import evaluate, penalty_cost
from fitting.texels.descent import State
from fitting.texels.seen import Seen
from fitting.texels.spread import Spread, spread
from fitting.texels.task import Task

# Of a promise, and of the cost, whose sums are rounded and where nothing is to be gained.
_SURPRISING, _ROUNDING = 0.1, 1e-9


class Outcome(NamedTuple):
    """One texel's: all shape parameters and coefficients, in the unknowns' order.

    Uncertainties (k = 1) are NaN for what is fixed, held by a bound or of no influence; all
    is NaN where too few values are known in a channel. ``used`` counts values of all
    channels. ``as_promised`` tells whether the last step gained what the quadratic said:
    where it gained less by a share ``s``, about ``s^2`` of the promise is left.
    """

    shape: Float[Array, " s"]
    coefficients: Float[Array, "q c"]
    shape_uncertainty: Float[Array, " s"]
    coefficient_uncertainty: Float[Array, "q c"]
    cost: Float[Array, ""]
    converged: Bool[Array, ""]
    steps: Int[Array, ""]
    used: Int[Array, ""]
    as_promised: Bool[Array, ""]


def outcome(task: Task, seen: Seen, state: State, used: Int[Array, " c"]) -> Outcome:
    """The outcome of a descent, of a texel with so many known values per channel."""
    unknowns, b = task.problem.unknowns, state.blocks
    k, m = state.u.shape[0], b.x.shape[1]
    number = jnp.sum(used)
    # As many values as coefficients in every channel, and as unknowns in all.
    known, last = _at_the_end(task, seen, state)
    better = last <= b.cost
    u = jnp.where(better, state.next_u, state.u)
    x = jnp.where(better, state.next_x, b.x)
    cost = jnp.where(better, last, b.cost)
    surprise = jnp.abs(b.cost - last - state.predicted)
    as_promised = surprise <= _SURPRISING * state.predicted + _ROUNDING * b.cost
    enough = jnp.all(used >= m) & (number >= m * used.size + k) & jnp.isfinite(cost)
    # With no more values than unknowns nothing is left over to judge errors by.
    known = known._replace(
        u=jnp.where(number > m * used.size + k, _certain(known.u), jnp.nan),
        x=jnp.where((used > m)[:, None], _certain(known.x), jnp.nan),
    )

    def kept(rows: list[Array], *size: int) -> Array:
        if not rows:
            return jnp.zeros((0, *size), dtype=b.x.dtype)
        wide = [jnp.broadcast_to(jnp.asarray(r, b.x.dtype), size) for r in rows]
        return jnp.where(enough, jnp.stack(wide), jnp.nan)

    shape = unknowns.shape(u)
    values_x = jax.vmap(unknowns.coefficients)(x, unknowns.coefficient_constant.T)
    channels = used.size
    return Outcome(
        shape=kept([shape[n] for n in unknowns.shape_names]),
        coefficients=kept([values_x[n] for n in unknowns.coefficient_names], channels),
        shape_uncertainty=kept(_of_shapes(task, u, known)),
        coefficient_uncertainty=kept(_of_coefficients(task, known), channels),
        cost=jnp.where(enough, cost, jnp.nan),
        converged=state.done & enough,
        steps=state.steps,
        used=number,
        as_promised=as_promised,
    )


def _at_the_end(task: Task, seen: Seen, state: State) -> tuple[Spread, Array]:
    """What is known after the last step, and the cost there.

    Penalties move the minimum but are no data: the information is that of the data alone.
    """
    u, x = state.next_u, state.next_x
    if not task.problem.penalised:
        known = spread(task, seen, state.blocks, u, x)
        return known, known.cost
    nothing = seen._replace(scale=jnp.zeros_like(state.damping))
    blocks = evaluate(task, nothing, u, x)
    # Which coefficients are held at a bound is decided with the penalties.
    known = spread(task, seen, blocks._replace(g_x=state.blocks.g_x), u, x)
    return known, known.cost + penalty_cost(task, seen, u, x)


def _certain(uncertainty: Array) -> Array:
    """NaN of what has no influence on the data, which is no certainty."""
    return jnp.where(uncertainty > 0, uncertainty, jnp.nan)


def _of_shapes(task: Task, u: Array, known: Spread) -> list[Array]:
    """Every shape parameter depends on one unknown, through the map onto its support."""
    unknowns = task.problem.unknowns
    slopes = jax.jacfwd(unknowns.shape)(u)
    own = jnp.where(is_flat(unknowns.scales, u), jnp.nan, known.u)
    return [
        jnp.abs(slopes[name][index]) * own[index] if index >= 0 else jnp.asarray(jnp.nan)
        for name, (index, _) in zip(
            unknowns.shape_names, unknowns.shape_source, strict=True
        )
    ]


def _of_coefficients(task: Task, known: Spread) -> list[Array]:
    source = task.problem.unknowns.coefficient_source
    return [
        factor * known.x[:, index] if index >= 0 else jnp.asarray(jnp.nan)
        for index, factor in source
    ]
