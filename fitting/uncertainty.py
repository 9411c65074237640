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
from jaxtyping import Array, Bool, Float

from fitting import qp, reduced
from fitting.reduced import Problem


class Covariance(NamedTuple):
    """Covariance of ``[x of channel 1, x of channel 2, ..., u]`` and active bounds.

    ``freedom`` is the effective number of degrees of freedom of each variance, small where
    a few rows decide about a parameter; intervals use Student's t with it.
    """

    matrix: Float[Array, "q q"]
    freedom: Float[Array, " q"]
    active: Bool[Array, "c p"]


@eqx.filter_jit
def covariance(
    problem: Problem, u: Float[Array, " k"], x: Float[Array, "c m"]
) -> Covariance:
    """Sandwich covariance at a minimum; coefficients on a bound count as known."""
    no = jnp.asarray(False)
    b = reduced.evaluate(problem, u, x, no)
    unknowns = problem.unknowns
    c, m, k = *x.shape, u.shape[0]
    solved = qp.solve(b.h_xx, qp.product(b.h_xx, x) - b.g_x, unknowns.rows, unknowns.limits)
    inverse = solved.inverse
    response = jnp.einsum("cmn,cnk->cmk", inverse, b.h_xu)
    schur = b.h_uu - jnp.einsum("cmk,cml->kl", b.h_xu, response)
    schur_inverse = qp.inverse(schur) if k else schur

    spread = jnp.concatenate([-response.reshape(c * m, k), jnp.eye(k, dtype=u.dtype)])
    bread = spread @ schur_inverse @ spread.T
    blocks = jnp.zeros((c, m, c, m), u.dtype)
    blocks = blocks.at[jnp.arange(c), :, jnp.arange(c), :].set(inverse)
    bread = bread.at[: c * m, : c * m].add(blocks.reshape(c * m, c * m))

    own = jax.vmap(
        lambda i: jax.lax.dynamic_slice(bread, (i * m, i * m), (m, m))
    )(jnp.arange(c))  # fmt: skip
    cross = bread[: c * m, c * m :].reshape(c, m, k)

    def scores(r: Array, d: Array, columns_x: Array, columns_u: Array) -> Array:
        ex, eu = d[:, None] * columns_x, d[:, None] * columns_u
        leverage = (
            jnp.einsum("cmn,cmp,cpn->cn", ex, own, ex)
            + 2.0 * jnp.einsum("cmn,cmk,ckn->cn", ex, cross, eu)
            + jnp.einsum("ckn,kl,cln->cn", eu, schur_inverse, eu)
        )
        inflated = r / (1.0 - jnp.clip(leverage, 0.0, 0.999))
        in_x = (ex * inflated[:, None]).reshape(c * m, -1)
        return jnp.concatenate([in_x, jnp.sum(eu * inflated[:, None], axis=0)])

    def moments(*columns: Array) -> tuple[Array, Array]:
        influence = bread @ scores(*columns)
        return influence @ influence.T, jnp.sum(influence**4, axis=1)

    matrix, fourth = reduced.sum_over_rows(problem, u, x, moments)
    variance = jnp.diagonal(matrix)
    quotient = variance**2 / jnp.where(fourth > 0, fourth, 1.0)
    freedom = jnp.where(fourth > 0, jnp.maximum(3.0 * quotient - 2.0, 1.0), jnp.inf)
    return Covariance(matrix, freedom, solved.active)
