"""Rows of a problem, a block after the other, and what is left of them by a model."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array

from fitting import objectives
from fitting.geometry import Geometry, PolarAngles

if TYPE_CHECKING:
    from fitting.reduced import Problem

T = TypeVar("T")


class Data(NamedTuple):
    """Of rows: ``kappa (n,)``, ``target (c, n)``, ``weight`` as well, or ``(1, n)``."""

    kappa: Array
    weight: Array
    target: Array


def data_of(problem: Problem) -> Data:
    """The data from whose residuals the cost is made."""
    return Data(problem.kappa, problem.weight, problem.target)


def residual(problem: Problem, f: Array, data: Data) -> tuple[Array, Array]:
    """Residual ``(c, n)`` and its slope in ``f``, which may be one for all channels."""
    v = f * data.kappa
    r = data.weight * (objectives.transform(problem.objective, v) - data.target)
    d = data.weight * data.kappa
    if not objectives.OBJECTIVES[problem.objective].linear:
        d = d * objectives.slope(problem.objective, v)
    if problem.robust:
        r, inner = objectives.pseudo_huber(r, problem.robust_width)
        d = d * inner
    return r, d


def slope_is_shared(problem: Problem) -> bool:
    """Whether the residual's slope is ``weight kappa``, the same for all channels."""
    linear = objectives.OBJECTIVES[problem.objective].linear
    return linear and not problem.robust and problem.weight.shape[0] == 1


def alike(problem: Problem) -> bool:
    """Whether channels share basis functions and the weights of the residual linearised at
    the data."""
    return len(problem.linear_weight) == 1 and not problem.unknowns.spectral


def cut(problem: Problem, array: Array, first: Array | int) -> Array:
    """The rows of a block, which are last in an array."""
    if array.shape[-1] == problem.chunk:
        return array
    return jax.lax.dynamic_slice_in_dim(array, first, problem.chunk, -1)


def geometry_of(problem: Problem, first: Array | int) -> Geometry:
    """Geometry of a block, which knows the table of the polar angles if there is one."""
    geometry = jax.tree.map(lambda v: cut(problem, v, first), problem.geometry)
    if problem.angles is None or problem.angle_rows is None:
        return geometry
    index_i, index_o = (cut(problem, v, first) for v in problem.angle_rows)
    return dataclasses.replace(
        geometry, polar=PolarAngles(*problem.angles, index_i, index_o)
    )


def sum_blocks(problem: Problem, block: Callable[[Array | int], T]) -> T:
    """Sum of ``block(first row)`` over blocks of rows: memory does not grow with them."""
    blocks = problem.kappa.shape[0] // problem.chunk
    if blocks == 1:
        return block(0)

    def add(carry: T, i: Array) -> tuple[T, None]:
        return jax.tree.map(jnp.add, carry, block(i * problem.chunk)), None

    zero = jax.tree.map(
        lambda s: jnp.zeros(s.shape, s.dtype), jax.eval_shape(lambda: block(0))
    )
    return jax.lax.scan(add, zero, jnp.arange(blocks))[0]
