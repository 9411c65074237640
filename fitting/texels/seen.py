"""What is seen of a texel, and the residual there of a model's value."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting import objectives
from fitting.reduced import Problem
from fitting.row_sums.rows import Data, residual

if TYPE_CHECKING:
    from fitting.texels.task import Task


class Seen(NamedTuple):
    """Of a texel, or with more axes in front of many.

    ``heavy`` are weights of the residual as in `Task.heavy`, 0 where a value is unknown.
    What belongs to a texel as a whole is None where it is not needed: ``unit``, the factor
    of an objective with a scale (1 over the median), the ``width`` of robust residuals, and
    the ``scale`` to which penalties are compared.
    """

    heavy: Float[Array, "w n"]
    values: Float[Array, "c n"]
    unit: Float[Array, ""] | None
    width: Float[Array, ""] | None
    scale: Float[Array, ""] | None


def of_channel(seen: Seen, c: int) -> Seen:
    """What is seen in one channel, ``(n,)``."""
    weight = seen.heavy[min(c, seen.heavy.shape[0] - 1)]
    return seen._replace(heavy=weight, values=seen.values[c])


def misfit(task: Task, seen: Seen, value: Array) -> tuple[Array, Array]:
    """The residual of a model's value, and its slope in that."""
    if task.quadratic:
        return seen.heavy * (value - seen.values), seen.heavy
    problem, kappa = own_problem(task, seen), _kappa(task, seen.unit)
    target = objectives.transform(problem.objective, seen.values * kappa)
    return residual(problem, value, Data(kappa, seen.heavy, target))


def size(task: Task, seen: Seen) -> Array:
    """The sum of squares of the weighted target."""
    if task.quadratic:
        return jnp.sum((seen.heavy * seen.values) ** 2)
    kappa = _kappa(task, seen.unit)
    target = objectives.transform(task.problem.objective, seen.values * kappa)
    return jnp.sum((seen.heavy * target) ** 2)


def linear_weights(task: Task, seen: Seen) -> Array:
    """Weights of the residual linearised at the data, ``(t, c, n)`` of texels ``(t, ...)``,
    or ``heavy`` as it is where they are these."""
    if task.quadratic:
        return seen.heavy
    unit = None if seen.unit is None else seen.unit[:, None, None]
    kappa = _kappa(task, unit)
    slope = objectives.slope(task.problem.objective, seen.values * kappa)
    return seen.heavy * (kappa * slope)


def own_problem(task: Task, seen: Seen) -> Problem:
    """The problem of a texel, with its width and the weights of its penalties."""
    problem = task.problem
    if seen.width is not None:
        problem = dataclasses.replace(problem, robust_width=seen.width)
    if seen.scale is not None:
        problem = dataclasses.replace(
            problem,
            energy_weight=problem.energy_weight * seen.scale,
            reciprocity_weight=problem.reciprocity_weight * seen.scale,
        )
    return problem


def _kappa(task: Task, unit: Array | None) -> Array:
    kappa = task.problem.kappa
    return kappa if unit is None else kappa * unit
