"""How well the data determine the parameters.

The covariance is the sandwich ``A^-1 B A^-1`` of the estimating equations (White 1980,
Econometrica 48, 817; Liang and Zeger 1986): ``A`` the Gauss-Newton matrix, ``B`` the sum of
the outer products of every row's own gradient, all channels of a row together. It asks
neither that the noise be the same everywhere nor that the channels of one row err
independently; residuals are inflated by their leverage, ``r / sqrt(1 - h)`` (HC2,
MacKinnon and White 1985), since the few rows on a peak pull the fit towards themselves.

A variance that rests on few rows is itself uncertain. With the influence ``z_n`` of row n,
of variance ``v_n``, the sum ``sum z_n^2`` has ``(sum v)^2 / sum v^2`` degrees of freedom
(Satterthwaite 1946, Biometrics Bulletin 2, 110; Bell and McCaffrey 2002, Survey
Methodology 28, 169). ``v`` comes from relative and absolute noise fitted to the residuals.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting import reduced, row_sums
from fitting.compiled import compiled
from fitting.reduced import Problem
from fitting.solve import Solution

_ON_BOUND = 1e-9
_NOISE_STEPS = 4
_RIDGE = 1e-14


class Covariance(NamedTuple):
    """Covariance of ``[x of channel 1, x of channel 2, ..., u]`` and active bounds.

    ``freedom`` is the effective number of degrees of freedom of each variance, small where
    a few rows decide about a parameter; intervals use Student's t with it. ``penalty`` is
    the share of the penalties in the cost.
    """

    matrix: np.ndarray
    freedom: np.ndarray
    active: np.ndarray
    penalty: float = 0.0


def covariance(problem: Problem, end: Solution) -> Covariance:
    """Sandwich covariance at a minimum; coefficients on a bound count as known.

    Penalties move the minimum but are no data: the information is that of the data alone.
    """
    u, x = jax.device_put((end.u, end.x))
    blocks = _data_blocks(problem, u, x) if problem.penalised else end.blocks
    b = jax.device_get(blocks)
    c, m, k = b.h_xu.shape
    active, inverse = _on_free_directions(problem, np.asarray(end.x), b.h_xx)
    response = inverse @ b.h_xu
    schur = b.h_uu - np.einsum("cmk,cml->kl", b.h_xu, response)
    schur_inverse = _inverse(schur)
    spread = np.concatenate([-response.reshape(c * m, k), np.eye(k)])
    bread = spread @ schur_inverse @ spread.T
    for i in range(c):
        own = slice(i * m, (i + 1) * m)
        bread[own, own] += inverse[i]
    noise = _fitted_noise(problem, u, x)
    matrix, first, second = (
        np.asarray(v) for v in _moments(problem, u, x, *jax.device_put((bread, noise)))
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = np.where(second > 0, np.maximum(first * (first / second), 1.0), np.inf)
    whole = float(end.cost)
    penalty = max(1.0 - float(b.cost) / whole, 0.0) if whole > 0 else 0.0
    return Covariance(matrix, freedom, active, penalty)


def begin(problem: Problem, u: jax.ShapeDtypeStruct, x: jax.ShapeDtypeStruct) -> None:
    """Compile in the background what `covariance` needs at such unknowns."""
    noise = jax.ShapeDtypeStruct((2,), u.dtype)
    size = math.prod(x.shape) + math.prod(u.shape)
    _noise_sums.begin(problem, u, x, noise)
    _moments.begin(problem, u, x, jax.ShapeDtypeStruct((size, size), u.dtype), noise)


@compiled(row_sums.FAST)
def _data_blocks(
    problem: Problem, u: Float[Array, " k"], x: Float[Array, "c m"]
) -> reduced.Blocks:
    # The energy weight, not the flag: without penalty rows a quadratic problem would move
    # its coefficients to their own best values.
    zero = jnp.zeros_like(problem.energy_weight)
    plain = dataclasses.replace(problem, energy_weight=zero, reciprocity_weight=zero)
    return reduced.evaluate(plain, u, x)


def _fitted_noise(problem: Problem, u: Array, x: Array) -> np.ndarray:
    """Relative and absolute noise variance: ``r^2 ~ noise[0] (d f)^2 + noise[1] d^2``.

    By iteratively weighted least squares; the weights come from the noise before.
    """
    noise = np.ones(2)
    for _ in range(_NOISE_STEPS):
        a, b, c, *right = sums = np.asarray(
            _noise_sums(problem, u, x, jax.device_put(noise))
        )
        if not np.all(np.isfinite(sums)):
            # An exact fit leaves nothing but rounding, whose squares' squares underflow.
            break
        noise = _not_negative(np.array([[a, b], [b, c]]), np.array(right))
    return noise


@compiled(row_sums.FAST)
def _noise_sums(
    problem: Problem,
    u: Float[Array, " k"],
    x: Float[Array, "c m"],
    noise: Float[Array, 2],
) -> Float[Array, 5]:
    """Upper half of the normal matrix of the noise's two variances, and its right side."""

    def sums(f: Array, r: Array, d: Array, *_: Array) -> tuple[Array]:
        relative, absolute = (d * f) ** 2, d**2
        expected = noise[0] * relative + noise[1] * absolute
        some = expected > 0
        weight = jnp.where(some, 1.0 / jnp.where(some, expected, 1.0) ** 2, 0.0)
        left, right = weight * relative, weight * absolute
        terms = (left * relative, left * absolute, right * absolute)
        return (row_sums.add_up([*terms, left * r**2, right * r**2]),)

    (total,) = reduced.sum_over_rows(problem, u, x, sums)
    return total


def _not_negative(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The two unknowns above 0 that minimise ``x' A x / 2 - b' x``, where ``b`` is."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    unit = matrix * np.outer(scale, scale) + _RIDGE * np.eye(2)
    b = right * scale
    x = np.linalg.solve(unit, b)
    if np.min(x) < 0:
        x = np.where(np.arange(2) == np.argmax(b), b, 0.0)
    return x * scale


@compiled()
def _moments(
    problem: Problem,
    u: Float[Array, " k"],
    x: Float[Array, "c m"],
    bread: Float[Array, "q q"],
    noise: Float[Array, " t"],
) -> tuple[Array, ...]:
    """Sums over rows of the outer product of their influence, and of ``v`` and ``v^2``."""
    c, m, k = *x.shape, u.shape[0]
    channels = jnp.arange(c)
    by_channel = bread[: c * m, : c * m].reshape(c, m, c, m)[channels, :, channels]
    cross = bread[: c * m, c * m :].reshape(c, m, k)
    shared = bread[c * m :, c * m :]
    to_x = jnp.moveaxis(bread[:, : c * m].reshape(c * m + k, c, m), 1, 0)
    to_u = bread[:, c * m :]

    def moments(f: Array, r: Array, d: Array, columns_x: Array, columns_u: Array):
        ex, eu = d[:, None] * columns_x, d[:, None] * columns_u
        leverage = (
            jnp.einsum("cmn,cmp,cpn->cn", ex, by_channel, ex)
            + 2.0 * jnp.einsum("cmn,cmk,ckn->cn", ex, cross, eu)
            + jnp.einsum("ckn,kl,cln->cn", eu, shared, eu)
        )
        inflated = (r / jnp.sqrt(1.0 - jnp.clip(leverage, 0.0, 0.999)))[:, None]
        scores = jnp.concatenate(
            [(ex * inflated).reshape(c * m, r.shape[1]), jnp.sum(eu * inflated, axis=0)]
        )
        influence = bread @ scores
        expected = noise[0] * (d * f) ** 2 + noise[1] * d**2

        def add(total: Array, channel: tuple[Array, ...]) -> tuple[Array, None]:
            own, own_x, own_u, variance = channel
            return total + (own @ own_x + to_u @ own_u) ** 2 * variance, None

        start = jnp.zeros_like(influence)
        v, _ = jax.lax.scan(add, start, (to_x, ex, eu, expected))
        return influence @ influence.T, jnp.sum(v, axis=1), jnp.sum(v**2, axis=1)

    return reduced.sum_over_rows(problem, u, x, moments)


def _on_free_directions(
    problem: Problem, x: np.ndarray, hessian: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which constraints hold with equality, and the inverse Hessian on what is left."""
    rows = np.asarray(problem.unknowns.rows)
    limits = np.asarray(problem.unknowns.limits)
    slack = x @ rows.T - limits
    active = slack <= _ON_BOUND * np.maximum(np.abs(limits), 1e-3)
    inverse = np.zeros_like(hessian)
    for i, (own, h) in enumerate(zip(active, hessian, strict=True)):
        free = _null_space(rows[own]) if own.any() else np.eye(h.shape[0])
        inverse[i] = free @ _inverse(free.T @ h @ free) @ free.T
    return active, inverse


def _null_space(rows: np.ndarray) -> np.ndarray:
    """Orthonormal columns that are perpendicular to rows ``(r, m)``.

    scipy.linalg has it too, and takes a tenth of a second to load.
    """
    _, size, v = np.linalg.svd(rows)
    rank = np.sum(size > np.finfo(float).eps * max(rows.shape) * size[0])
    return v[rank:].T


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse after scaling to a unit diagonal; a tiny ridge keeps it finite.

    What the data say nothing about gets a huge, finite variance.
    """
    if not matrix.size:
        return matrix
    diagonal = np.diag(matrix)
    floor = max(1e-30 * float(diagonal.max()), 1e-100)
    scale = 1.0 / np.sqrt(np.maximum(diagonal, floor))
    unit = matrix * np.outer(scale, scale) + _RIDGE * np.eye(scale.size)
    return np.linalg.inv(unit) * np.outer(scale, scale)
