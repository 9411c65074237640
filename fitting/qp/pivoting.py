"""Where there are bounds only: a guess of what is held at one, and exchanges."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.qp.linear import inverse, scaled, times

# Of problems scaled to a unit diagonal and a right-hand side of 1 at most.
_NEGLIGIBLE = 1e-12
_PATIENCE = 3
_REFINEMENTS = 3
_RIDGE = 1e-12
_MOST_EXCHANGES = 40


def within(
    hessian: Float[Array, "c m m"],
    linear: Float[Array, "c m"],
    low: Float[Array, "c m"],
    high: Float[Array, "c m"],
    near: Float[Array, "c m"] | None = None,
) -> tuple[Float[Array, "c m"], Float[Array, "c m m"]]:
    """Minimise ``x' H x / 2 - b' x`` within bounds, for every channel.

    Returns the minimiser and the inverse of the Hessian on what is not at a bound. Block
    principal pivoting (Júdice and Pires 1994, Computers & Operations Research 21, 587;
    Kim and Park 2011, SIAM J. Sci. Comput. 33, 3261): all unknowns whose sign is wrong are
    exchanged at once, and where that does not lessen their number, one at a time, which
    ends for positive definite matrices. A ridge far above rounding makes all of them that,
    also where columns are alike; what it adds is taken away in the end. ``near`` is where
    to begin.
    """
    g, b, units = scaled(hessian, linear)
    ends = jnp.stack([low.T, high.T]) * units.roots / units.size
    number = jnp.arange(b.shape[0])[:, None]
    unit = (number == number.T)[:, :, None]
    ridged = g + _RIDGE * unit

    def solved(at: Array) -> tuple[Array, Array, Array]:
        """The point where so many are held, its inverse, and where they should be."""
        free = at == 0
        held = jnp.where(free, 0.0, jnp.where(at < 0, *ends))
        both = free[:, None] & free
        inverted = inverse(jnp.where(both, ridged, unit))
        inverted = jnp.where(both, inverted, 0.0)
        x = held + times(inverted, b - times(ridged, held))
        # Again, since the inverse of what is nearly singular is not exact.
        for _ in range(_REFINEMENTS):
            x = x + times(inverted, b - times(ridged, x))
        slope = times(ridged, x) - b
        slack = _NEGLIGIBLE * jnp.maximum(1.0, jnp.abs(x))
        beyond = (x > ends[1] + slack).astype(at.dtype) - (x < ends[0] - slack)
        leaves = at * slope > _NEGLIGIBLE
        return x, inverted, jnp.where(leaves, 0, jnp.where(free, beyond, at))

    def value(x: Array) -> Array:
        return jnp.sum((0.5 * times(g, x) - b) * x, axis=0)

    def unfinished(carry) -> Array:
        at, to, *_, steps = carry
        return (steps == 0) | jnp.any(at != to) & (steps <= _MOST_EXCHANGES)

    def exchange(carry):
        at, to, _, _, least, patience, steps = carry
        wrong = at != to
        count = jnp.sum(wrong, axis=0)
        fewer = count < least
        all_at_once = fewer | (patience > 0)
        last = jnp.max(jnp.where(wrong, number, -1), axis=0)
        at = jnp.where(all_at_once | (number == last), to, at)
        patience = jnp.where(fewer, _PATIENCE, patience - 1)
        # At first there is nothing to exchange: that is no success.
        least = jnp.where(steps > 0, jnp.minimum(count, least), least)
        x, inverted, to = solved(at)
        return at, to, x, inverted, least, patience, steps + 1

    first = jnp.zeros(b.shape, dtype=jnp.int32)
    if near is not None:
        first = (near >= high).T.astype(jnp.int32) - (near <= low).T
    many = jnp.full(b.shape[1:], b.shape[0] + 1)
    carry = (first, first, b, g, many, jnp.full_like(many, _PATIENCE), 0)
    _, _, x, inverted, *_ = jax.lax.while_loop(unfinished, exchange, carry)
    exact = x = jnp.clip(x, *ends)
    for _ in range(_REFINEMENTS):
        exact = exact + times(inverted, b - times(g, exact))
    exact = jnp.clip(exact, *ends)
    x = jnp.where(value(exact) <= value(x), exact, x)
    at_low, at_high = (x <= ends[0]).T, (x >= ends[1]).T
    x, inverted = units.back(x, inverted)
    # Exactly there; and within, where rounding has moved it beyond.
    x = jnp.where(at_low, low, jnp.where(at_high, high, jnp.clip(x, low, high)))
    return x, inverted
