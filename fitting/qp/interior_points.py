"""An interior-point method, which needs no branching: all channels run together."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from fitting.qp.linear import inverse, scaled, times

_MAX_STIFFNESS = 1e10
_TOLERANCE = 1e-15
_MAX_STEPS = 40


class QPSolution(NamedTuple):
    """Minimiser, inverse of the Hessian on the free directions, and active constraints."""

    x: Float[Array, "c m"]
    inverse: Float[Array, "c m m"]
    active: Bool[Array, "c p"]


def solve(
    hessian: Float[Array, "c m m"],
    linear: Float[Array, "c m"],
    rows: Float[Array, "p m"],
    limits: Float[Array, "c p"],
) -> QPSolution:
    """Minimise ``x' H x / 2 - b' x`` subject to ``rows x >= limits``, for every channel.

    Mehrotra's predictor-corrector method (Nocedal and Wright, Numerical Optimization,
    alg. 16.4) on the problem scaled to a unit diagonal; its last matrix is the inverse. A
    coefficient whose constraint ends up active is put exactly on it where the constraint
    is a bound.
    """
    g, b, units = scaled(hessian, linear)
    if rows.shape[0] == 0:
        free = inverse(g)
        none = jnp.zeros((g.shape[-1], 0), dtype=bool)
        return QPSolution(*units.back(times(free, b), free), none)

    a = rows[:, :, None] / units.roots
    norm = jnp.sqrt(jnp.sum(a * a, axis=1))
    a = a / norm[:, None]
    h = limits.T / (norm * units.size)

    def gram(weight: Array) -> Array:
        return jnp.sum(weight[:, None, None] * a[:, :, None] * a[:, None], axis=0)

    def transposed(z: Array) -> Array:
        return jnp.sum(a * z[:, None], axis=0)

    def step_length(v: Array, dv: Array) -> Array:
        ratio = jnp.where(dv < 0, -v / jnp.where(dv < 0, dv, -1.0), jnp.inf)
        return jnp.minimum(1.0, jnp.min(ratio, axis=0))

    def body(carry):
        x, s, z, steps, _ = carry
        dual = times(g, x) - b - transposed(z)
        primal = times(a, x) - h - s
        mu = jnp.mean(s * z, axis=0)
        newton = inverse(g + gram(z / s))

        def direction(target: Array) -> tuple[Array, Array, Array]:
            dx = times(newton, transposed((target - z * primal) / s) - dual)
            ds = times(a, dx) + primal
            return dx, ds, (target - z * ds) / s

        _, ds, dz = direction(-s * z)
        reach_s, reach_z = step_length(s, ds), step_length(z, dz)
        mu_ahead = jnp.mean((s + reach_s * ds) * (z + reach_z * dz), axis=0)
        centring = (mu_ahead / mu) ** 3
        dx, ds, dz = direction(centring * mu - s * z - ds * dz)
        reach = 0.995 * jnp.minimum(step_length(s, ds), step_length(z, dz))
        x, s, z = x + reach * dx, s + reach * ds, z + reach * dz
        s, z = jnp.maximum(s, 1e-30), jnp.maximum(z, 1e-30)
        gap = jnp.mean(s * z, axis=0) + jnp.max(jnp.abs(reach * dx), axis=0) ** 2 * 1e-2
        return x, s, z, steps + 1, jnp.max(gap)

    def unfinished(carry):
        *_, steps, gap = carry
        return (steps < _MAX_STEPS) & (gap > _TOLERANCE)

    x0 = jnp.zeros_like(b)
    s0 = jnp.maximum(-h, 1.0)
    z0 = jnp.ones_like(s0)
    gap0 = jnp.full((), jnp.inf, dtype=b.dtype)
    x, s, z, _, _ = jax.lax.while_loop(unfinished, body, (x0, s0, z0, 0, gap0))

    stiffness = jnp.minimum(z / s, _MAX_STIFFNESS)
    x, free = units.back(x, inverse(g + gram(stiffness)))
    active = (z > s).T
    return QPSolution(_put_on_bounds(x, rows, limits, active), free, active)


def _put_on_bounds(x: Array, rows: Array, limits: Array, active: Array) -> Array:
    is_bound = jnp.sum(rows != 0, axis=1) == 1
    which = (rows != 0) & is_bound[:, None]
    value = limits[:, :, None] / jnp.where(which, rows, 1.0)[None]
    on = active[:, :, None] & which[None]
    count = jnp.sum(on, axis=1)
    target = jnp.sum(jnp.where(on, value, 0.0), axis=1) / jnp.maximum(count, 1)
    return jnp.where(count > 0, target, x)
