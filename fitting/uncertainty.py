"""How well the data determine the parameters.

The covariance is the sandwich ``A^-1 B A^-1`` of the estimating equations (White 1980,
Econometrica 48, 817; Liang and Zeger 1986): ``A`` the Gauss-Newton matrix, ``B`` the sum of
the outer products of every row's own gradient, all channels of a row together. It asks
neither that the noise be the same everywhere nor that the channels of one row err
independently; residuals are inflated by their leverage, ``r / (1 - h)`` (HC3, MacKinnon
and White 1985), since the few rows on a peak pull the fit towards themselves.

A variance that rests on few rows is itself uncertain. With the influence ``z_n`` of row n,
of variance ``v_n``, the sum ``sum z_n^2`` has ``(sum v)^2 / sum v^2`` degrees of freedom
(Satterthwaite 1946, Biometrics Bulletin 2, 110), estimated for Gaussian errors, where
``E z^4 = 3 v^2``, by ``3 (sum z^2)^2 / sum z^4 - 2``.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from fitting import reduced
from fitting.reduced import Problem
from fitting.solve import Solution

_ON_BOUND = 1e-9


class Covariance(NamedTuple):
    """Covariance of ``[x of channel 1, x of channel 2, ..., u]`` and active bounds.

    ``freedom`` is the effective number of degrees of freedom of each variance, small where
    a few rows decide about a parameter; intervals use Student's t with it.
    """

    matrix: np.ndarray
    freedom: np.ndarray
    active: np.ndarray


def covariance(problem: Problem, end: Solution) -> Covariance:
    """Sandwich covariance at a minimum; coefficients on a bound count as known."""
    b = jax.device_get(end.blocks)
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
    u, x = jnp.asarray(end.u), jnp.asarray(end.x)
    moments = _moments(problem, u, x, jnp.asarray(bread))
    matrix, fourth = (np.asarray(v) for v in moments)
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = np.diag(matrix) ** 2 / fourth
    freedom = np.where(fourth > 0, np.maximum(3.0 * quotient - 2.0, 1.0), np.inf)
    return Covariance(matrix, freedom, active)


@eqx.filter_jit
def _moments(
    problem: Problem,
    u: Float[Array, " k"],
    x: Float[Array, "c m"],
    bread: Float[Array, "q q"],
) -> tuple[Array, ...]:
    """Sums over rows of the outer product and the fourth power of their influence."""
    c, m, k = *x.shape, u.shape[0]
    channels = jnp.arange(c)
    by_channel = bread[: c * m, : c * m].reshape(c, m, c, m)[channels, :, channels]
    cross = bread[: c * m, c * m :].reshape(c, m, k)
    shared = bread[c * m :, c * m :]

    def moments(r: Array, d: Array, columns_x: Array, columns_u: Array):
        ex, eu = d[:, None] * columns_x, d[:, None] * columns_u
        leverage = (
            jnp.einsum("cmn,cmp,cpn->cn", ex, by_channel, ex)
            + 2.0 * jnp.einsum("cmn,cmk,ckn->cn", ex, cross, eu)
            + jnp.einsum("ckn,kl,cln->cn", eu, shared, eu)
        )
        inflated = (r / (1.0 - jnp.clip(leverage, 0.0, 0.999)))[:, None]
        scores = jnp.concatenate(
            [(ex * inflated).reshape(c * m, -1), jnp.sum(eu * inflated, axis=0)]
        )
        influence = bread @ scores
        return influence @ influence.T, jnp.sum(influence**4, axis=1)

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
        free = scipy.linalg.null_space(rows[own]) if own.any() else np.eye(h.shape[0])
        inverse[i] = free @ _inverse(free.T @ h @ free) @ free.T
    return active, inverse


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse after scaling to a unit diagonal; a tiny ridge keeps it finite.

    What the data say nothing about gets a huge, finite variance.
    """
    if not matrix.size:
        return matrix
    diagonal = np.diag(matrix)
    floor = max(1e-30 * float(diagonal.max()), 1e-100)
    scale = 1.0 / np.sqrt(np.maximum(diagonal, floor))
    unit = matrix * np.outer(scale, scale) + 1e-14 * np.eye(scale.size)
    return np.linalg.inv(unit) * np.outer(scale, scale)
