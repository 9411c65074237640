"""The heart of the fit: one pass over the data for everything that a step needs.

The model is ``f = sum_j a_j(x, u) B_j(u)`` with a handful of shape unknowns ``u`` shared by
all channels and, per channel, coefficients ``x`` that enter (nearly) linearly. The
Gauss-Newton matrix is therefore an arrow. It follows from sums over the rows of products of
*features* (`fitting.row_sums`), which do not depend on the channel: memory is that of the
data, whatever the number of wavelengths, and the Jacobian (rows times channels by
parameters) is never formed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from fitting import objectives, penalties, qp, row_sums
from fitting.geometry import Geometry
from fitting.model import Model
from fitting.parameters import Scale, to_value


class Unknowns(eqx.Module):
    """How the free unknowns make the parameters: what is fixed, tied and bounded.

    Parameter ``p`` is ``factor * free[index] + constant``; ``index`` is -1 if it is fixed.
    ``shape_constant`` has one column, or one per channel where a fixed shape parameter is
    spectral; then the basis functions are too. Free coefficients lie within ``low`` and
    ``high``; ``rows x >= limits`` says the same, and more unless there are ``only_bounds``.
    """

    shape_names: tuple[str, ...] = eqx.field(static=True)
    shape_source: tuple[tuple[int, float], ...] = eqx.field(static=True)
    scales: tuple[Scale, ...] = eqx.field(static=True)
    coefficient_names: tuple[str, ...] = eqx.field(static=True)
    coefficient_source: tuple[tuple[int, float], ...] = eqx.field(static=True)
    n_coefficients: int = eqx.field(static=True)
    shape_constant: Float[Array, "s d"]
    lower: Float[Array, " k"]
    upper: Float[Array, " k"]
    coefficient_constant: Float[Array, "q c"]
    low: Float[Array, "c m"]
    high: Float[Array, "c m"]
    only_bounds: bool = eqx.field(static=True)
    rows: Float[Array, "p m"]
    limits: Float[Array, "c p"]

    @property
    def free_shape(self) -> list[str]:
        """The parameter that each shape unknown is, by name."""
        return _masters(self.shape_names, self.shape_source, self.n_shape)

    @property
    def free_coefficients(self) -> list[str]:
        """The parameter that each free coefficient is, by name."""
        names, source = self.coefficient_names, self.coefficient_source
        return _masters(names, source, self.n_coefficients)

    @property
    def n_shape(self) -> int:
        """Number of free shape unknowns."""
        return len(self.scales)

    @property
    def spectral(self) -> bool:
        """Whether every channel has a shape of its own, by fixed values."""
        return self.shape_constant.shape[1] > 1

    def shape(
        self, u: Float[Array, " k"], constant: Float[Array, " s"] | None = None
    ) -> dict[str, Array]:
        """All shape parameters by name; of one channel, whose constants are given."""
        if constant is None:
            constant = self.shape_constant[:, 0]
        free = [
            to_value(scale, u[i], self.lower[i], self.upper[i])
            for i, scale in enumerate(self.scales)
        ]
        return {
            name: factor * free[index] if index >= 0 else constant[i]
            for i, (name, (index, factor)) in enumerate(
                zip(self.shape_names, self.shape_source, strict=True)
            )
        }

    def coefficients(self, x: Float[Array, "m ..."], c: Float[Array, "q ..."]) -> dict:
        """All coefficients of one channel or several, whose constants are ``c``."""
        return {
            name: factor * x[index] if index >= 0 else c[i]
            for i, (name, (index, factor)) in enumerate(
                zip(self.coefficient_names, self.coefficient_source, strict=True)
            )
        }

    def best(
        self, hessian: Array, linear: Array, near: Array | None = None
    ) -> tuple[Array, Array]:
        """Minimisers ``(p c, m)`` of ``x' H x / 2 - b' x`` for ``p`` times all channels,
        and inverses of ``H (p c, m, m)`` on what no constraint holds.

        ``near`` is a guess, which may save time.
        """
        times = linear.shape[0] // self.low.shape[0]

        def each(v: Array) -> Array:
            return v if times == 1 else jnp.tile(v, (times, 1))

        if self.only_bounds:
            return qp.within(hessian, linear, each(self.low), each(self.high), near)
        found = qp.solve(hessian, linear, self.rows, each(self.limits))
        return found.x, found.inverse


def _masters(
    names: tuple[str, ...], source: tuple[tuple[int, float], ...], count: int
) -> list[str]:
    out = [""] * count
    for name, (index, factor) in zip(names, source, strict=True):
        if index >= 0 and factor == 1.0 and not out[index]:
            out[index] = name
    return out


class Problem(eqx.Module):
    """Everything that one fit needs, padded: rows with weight 0 count for nothing.

    ``target`` is ``phi(y kappa)``; ``linear_target, linear_weight`` are the same residual
    linearised at the data, from which starts are made. ``angles`` are ``sin^2`` and ``cos``
    of the polar angles that occur, where knowing them saves work, and ``angle_rows`` which
    of them every row has, for source and detector. ``scale`` is the sum of squares of
    the weighted target, to which costs and penalties are compared.
    """

    model: Model
    unknowns: Unknowns
    objective: str = eqx.field(static=True)
    robust: bool = eqx.field(static=True)
    chunk: int = eqx.field(static=True)
    penalised: bool = eqx.field(static=True)
    geometry: Geometry
    angles: tuple[Float[Array, " m"], Float[Array, " m"]] | None
    angle_rows: tuple[Int[Array, " n"], Int[Array, " n"]] | None
    kappa: Float[Array, " n"]
    weight: Float[Array, "w n"]
    target: Float[Array, "c n"]
    linear_target: Float[Array, "c n"]
    linear_weight: Float[Array, "w n"]
    robust_width: Float[Array, ""]
    energy_weight: Float[Array, ""]
    reciprocity_weight: Float[Array, ""]
    scale: Float[Array, ""]
    pairs: Geometry

    @property
    def resolves(self) -> bool:
        """Whether the coefficients follow exactly from the shape (a quadratic problem)."""
        return (
            objectives.OBJECTIVES[self.objective].linear
            and not self.robust
            and not self.penalised
            and all(lobe.linear for lobe in self.model.lobes)
        )


class Blocks(NamedTuple):
    """Sum of squares ``r.r`` at a point, with ``J.r`` (half its gradient) and ``J.J``."""

    x: Float[Array, "c m"]
    cost: Float[Array, ""]
    g_u: Float[Array, " k"]
    g_x: Float[Array, "c m"]
    h_uu: Float[Array, "k k"]
    h_xu: Float[Array, "c m k"]
    h_xx: Float[Array, "c m m"]


def amplitudes(problem: Problem, u: Array, x: Array) -> tuple[Array, Array, Array]:
    """``a (c, b)`` and its derivatives in ``x (c, b, m)`` and ``u (c, b, k)``."""
    unknowns = problem.unknowns

    def of_channel(uc: tuple[Array, Array], constant: Array, fixed: Array) -> Array:
        values = unknowns.coefficients(uc[1], constant)
        shape = unknowns.shape(uc[0], fixed)
        out = problem.model.amplitudes(shape, values)
        return jnp.stack([jnp.asarray(a, dtype=u.dtype) for a in out])

    def one(xc: Array, constant: Array, fixed: Array):
        a = of_channel((u, xc), constant, fixed)
        in_u, in_x = jax.jacfwd(of_channel)((u, xc), constant, fixed)
        return a, in_x, in_u

    fixed, along = unknowns.shape_constant.T, 0
    if not unknowns.spectral:
        fixed, along = fixed[0], None
    return jax.vmap(one, (0, 0, along))(x, unknowns.coefficient_constant.T, fixed)


def evaluate(problem: Problem, u: Array, x: Array) -> Blocks:
    """The blocks at ``(u, x)``, or at the best ``x`` if the problem `resolves`."""
    a, da_dx, da_du = amplitudes(problem, u, x)
    gram, gradient, cost = _all_sums(problem, u, a)
    gram = jnp.broadcast_to(gram, (x.shape[0], *gram.shape[1:]))
    n_basis, n_features = a.shape[1], gram.shape[1]
    if problem.resolves and x.shape[1]:
        to_x = jnp.pad(da_dx, ((0, 0), (0, n_features - n_basis), (0, 0)))
        h = jnp.einsum("cfm,cfg,cgn->cmn", to_x, gram, to_x)
        g = jnp.einsum("cfm,cf->cm", to_x, gradient)
        best, _ = problem.unknowns.best(h, qp.product(h, x) - g, x)
        step = qp.product(to_x, best - x)
        change = qp.product(gram, step)
        cost = cost + jnp.sum((2.0 * gradient + change) * step)
        gradient = gradient + change
        x, a = best, a + step[:, :n_basis]
    to_x, to_u = _columns(problem, a, da_dx, da_du)
    gram_x = jnp.einsum("cfg,cgm->cfm", gram, to_x)
    gram_u = jnp.einsum("cfg,cgk->cfk", gram, to_u)
    return Blocks(
        x=x,
        cost=jnp.maximum(cost, 0.0),
        g_u=jnp.einsum("cfk,cf->k", to_u, gradient),
        g_x=jnp.einsum("cfm,cf->cm", to_x, gradient),
        h_uu=jnp.einsum("cfk,cfl->kl", to_u, gram_u),
        h_xu=jnp.einsum("cfm,cfk->cmk", to_x, gram_u),
        h_xx=jnp.einsum("cfm,cfn->cmn", to_x, gram_x),
    )


def _all_sums(problem: Problem, u: Array, a: Array) -> row_sums.Sums:
    total = row_sums.over_rows(problem, u, a)
    if problem.penalised:
        for penalty in penalties.of(problem):
            more = row_sums.of_functions(problem, u, a, *penalty)
            total = row_sums.Sums(*map(jnp.add, total, more))
    return total


def _columns(problem: Problem, a: Array, da_dx: Array, da_du: Array) -> tuple[Array, Array]:
    """How columns of the Jacobian follow from features, ``(c, f, m)`` and ``(c, f, k)``.

    A column of the shape is the derivatives of the basis functions, weighted by their
    amplitudes.
    """
    pairs = row_sums.dependents(problem)
    n_basis = a.shape[1]
    extra = ((0, 0), (0, len(pairs)), (0, 0))
    to_x, to_u = jnp.pad(da_dx, extra), jnp.pad(da_du, extra)
    for t, (j, k) in enumerate(pairs):
        to_u = to_u.at[:, n_basis + t, k].add(a[:, j])
    return to_x, to_u


def sum_over_rows(
    problem: Problem, u: Array, x: Array, function: Callable[..., tuple[Array, ...]]
) -> tuple[Array, ...]:
    """Sum over blocks of rows of ``function(f, r, d, columns_x, columns_u)``.

    ``f, r, d (c, n)`` are value, residual and slope; ``columns_x (c, m, n)`` and
    ``columns_u (c, k, n)`` the derivatives of the value in the unknowns.
    """
    a, da_dx, da_du = amplitudes(problem, u, x)
    columns = _columns(problem, a, da_dx, da_du)
    return row_sums.by_function(problem, u, a, columns, function)
