"""Passes over the rows of a problem."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
from jaxtyping import Array

from fitting.row_sums import reductions
from fitting.row_sums.features import basis, features, inlinable
from fitting.row_sums.products import contracted, half_gram, moments, weighted
from fitting.row_sums.rows import (
    Data,
    alike,
    cut,
    data_of,
    geometry_of,
    residual,
    sum_blocks,
)
from fitting.row_sums.sums import Sums, symmetric

if TYPE_CHECKING:
    from fitting.reduced import Problem


def over_rows(problem: Problem, u: Array, a: Array) -> Sums:
    """The sums at a shape ``u``, for amplitudes ``a (c, b)`` of the basis functions."""
    # Else what does not depend on u is moved out of the solver's loop, written, and read
    # again: 140 bytes a row, at twice the time.
    data = problem.geometry, problem.kappa, problem.weight, problem.target
    u, (geometry, kappa, weight, target) = jax.lax.optimization_barrier((u, data))
    problem = dataclasses.replace(
        problem, geometry=geometry, kappa=kappa, weight=weight, target=target
    )
    listed = inlinable(problem, u) if reductions.all_at_once(problem) else None
    if listed is not None:
        return reductions.inlined(problem, listed, a)
    if problem.unknowns.spectral or not reductions.some_at_once(problem):
        return _by_products(problem, u, a)
    return reductions.held(problem, u, a)


def _by_products(problem: Problem, u: Array, a: Array) -> Sums:
    def block(first: Array | int) -> Sums:
        f, r, d = _of_block(problem, u, a, first)[1:]
        return contracted(f, r, d)

    return sum_blocks(problem, block)


def _of_block(
    problem: Problem, u: Array, a: Array, first: Array | int
) -> tuple[Array, Array, Array, Array]:
    """Value, features, residual and slope of a block of rows."""
    geometry = geometry_of(problem, first)
    f = features(problem, u, lambda s: problem.model.basis(s, geometry))
    value = weighted(a, f[..., : a.shape[1], :])
    data = Data(*(cut(problem, v, first) for v in data_of(problem)))
    return value, f, *residual(problem, value, data)


def of_functions(
    problem: Problem,
    u: Array,
    a: Array,
    functions: Callable[[dict[str, Array]], tuple[Array, ...]],
    residual: Callable[[Array], tuple[Array, Array]],
) -> Sums:
    """The same sums over what penalties look at instead of rows."""
    f = features(problem, u, functions)
    return contracted(f, *residual(weighted(a, f[..., : a.shape[1], :])))


def by_function(
    problem: Problem,
    u: Array,
    a: Array,
    columns: tuple[Array, Array],
    function: Callable[..., tuple[Array, ...]],
) -> tuple[Array, ...]:
    """Sum over blocks of rows of ``function(f, r, d, columns_x, columns_u)``.

    ``f, r, d (c, n)`` are value, residual and slope; ``columns_x (c, m, n)`` and
    ``columns_u (c, k, n)`` the derivatives of the value in the unknowns, which follow from
    the features by ``columns (c, f, m), (c, f, k)``.
    """

    def block(first: Array | int) -> tuple[Array, ...]:
        value, f, r, d = _of_block(problem, u, a, first)
        axes = "fn" if f.ndim == 2 else "cfn"
        return function(
            value,
            r,
            jnp.broadcast_to(d, r.shape),
            jnp.einsum(f"cfm,{axes}->cmn", columns[0], f),
            jnp.einsum(f"cfk,{axes}->ckn", columns[1], f),
        )

    return sum_blocks(problem, block)


def linear_moments(problem: Problem, u: Array) -> tuple[Array, Array, Array]:
    """Of the residual linearised at the data, ``w (f - y)``: ``gram (1 or c, b, b)`` of the
    basis functions times ``w``, their products ``(c, b)`` with ``w y``, and its square."""

    def block(first: Array | int) -> tuple[Array, Array, Array]:
        geometry = geometry_of(problem, first)
        f = basis(problem, u, lambda s: problem.model.basis(s, geometry))
        weight = cut(problem, problem.linear_weight, first)
        value = cut(problem, problem.linear_target, first)
        if reductions.few_moments(problem):
            return reductions.moments(f, weight[0], value)
        heavy = weight * weight
        shared = alike(problem)
        return (
            reductions.half_gram(f, weight[0]) if shared else half_gram(f, heavy),
            moments(heavy * value, f),
            jnp.sum(heavy * value * value),
        )

    half, moment, square = sum_blocks(problem, block)
    return symmetric(half, moment.shape[-1]), moment, square
