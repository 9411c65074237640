"""Features of rows: the basis functions and their derivatives in the shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import jax
import jax.extend.core as jex
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry

if TYPE_CHECKING:
    from fitting.reduced import Problem

# Operations on a row.
_LIGHT = 2000
# What cannot be inlined into a loop over rows, or had better not be.
_HEAVY = frozenset(
    ("gather", "dot_general", "scan", "while", "cond", "sort", "cumsum", "reduce_sum",
     "reduce_max", "reduce_min", "conv_general_dilated", "scatter", "scatter-add")
)  # fmt: skip

Functions = Callable[[Array], tuple[Array, ...]]


def dependents(problem: Problem) -> tuple[tuple[int, int], ...]:
    """Pairs (basis function, shape unknown) where the one depends on the other."""
    unknowns, model = problem.unknowns, problem.model
    out: list[tuple[int, int]] = []
    first = 0
    for i, lobe in enumerate(model.lobes):
        declared = {f"{model.labels[i]}.{p.name}" for p in lobe.parameters()}
        own = {
            index
            for name, (index, _) in zip(
                unknowns.shape_names, unknowns.shape_source, strict=True
            )
            if name in declared and index >= 0
        }
        count = model.n_basis(i)
        out += [(first + j, k) for j in range(count) for k in sorted(own)]
        first += count
    return tuple(sorted(out, key=lambda jk: (jk[1], jk[0])))


def number(problem: Problem) -> int:
    """How many features there are."""
    return n_basis(problem) + len(dependents(problem))


def n_basis(problem: Problem) -> int:
    """How many of them are basis functions."""
    model = problem.model
    return sum(model.n_basis(i) for i in range(len(model.lobes)))


def basis(problem: Problem, u: Array, functions: Callable) -> Array:
    """Basis functions, ``(b, n)``, or ``(c, b, n)`` where shapes are spectral.

    ``functions(shape)`` gives one array per basis function.
    """
    return _per_shape(problem, functions, lambda of: jnp.stack(of(u)))


def features(problem: Problem, u: Array, functions: Callable) -> Array:
    """The same and their needed derivatives, ``(f, n)`` or ``(c, f, n)``."""
    return _per_shape(
        problem, functions, lambda of: jnp.stack(_with_tangents(problem, of, u))
    )


def listed(problem: Problem, u: Array, geometry: Geometry) -> list[Array]:
    """Features of rows, one array each; of shapes that all channels share."""
    return _listed(problem, u, problem.unknowns.shape_constant[:, 0], geometry)


def inlinable(problem: Problem, u: Array) -> Callable[[Geometry], list[Array]] | None:
    """A function that lists the features of all rows, if that is cheap: elementwise
    operations, and not too many."""
    if problem.unknowns.spectral or problem.angles is not None:
        return None
    constant = problem.unknowns.shape_constant[:, 0]

    def function(u: Array, constant: Array, geometry: Geometry) -> list[Array]:
        return _listed(problem, u, constant, geometry)

    closed = jax.make_jaxpr(function)(u, constant, problem.geometry)
    names = list(_operations(closed.jaxpr, problem.kappa.size))
    if len(names) > _LIGHT or _HEAVY.intersection(names):
        return None
    return lambda g: jex.jaxpr_as_fun(closed)(*jax.tree.leaves((u, constant, g)))


def _listed(problem: Problem, u: Array, constant: Array, geometry: Geometry) -> list[Array]:
    def functions(v: Array) -> tuple[Array, ...]:
        return problem.model.basis(problem.unknowns.shape(v, constant), geometry)

    return _with_tangents(problem, functions, u)


def _with_tangents(problem: Problem, functions: Functions, u: Array) -> list[Array]:
    """Functions of ``u`` (a tuple of arrays) and their needed derivatives."""
    value, derivatives = functions(u), {}
    for k in range(problem.unknowns.n_shape):
        unit = jnp.asarray(np.eye(u.shape[0])[k], dtype=u.dtype)
        value, derivatives[k] = jax.jvp(functions, (u,), (unit,))
    return [*value, *(derivatives[k][j] for j, k in dependents(problem))]


def _per_shape(
    problem: Problem, functions: Callable, made: Callable[[Functions], Array]
) -> Array:
    """What is made of functions of ``u``, for every channel where shapes are spectral."""
    unknowns = problem.unknowns

    def of(constant: Array) -> Array:
        return made(lambda v: functions(unknowns.shape(v, constant)))

    if unknowns.spectral:
        return jax.vmap(of)(unknowns.shape_constant.T)
    return of(unknowns.shape_constant[:, 0])


def _operations(jaxpr: jex.Jaxpr, n_rows: int) -> Iterator[str]:
    """Names of the operations on arrays as long as the rows; one on more counts as more."""
    for equation in jaxpr.eqns:
        inner = [
            p.jaxpr if isinstance(p, jex.ClosedJaxpr) else p
            for p in equation.params.values()
            if isinstance(p, jex.ClosedJaxpr | jex.Jaxpr)
        ]
        name = equation.primitive.name
        if inner and name not in _HEAVY:
            for one in inner:
                yield from _operations(one, n_rows)
            continue
        variables = (*equation.invars, *equation.outvars)
        size = max((getattr(v.aval, "size", 1) for v in variables), default=0)
        for _ in range(size // n_rows):
            yield name
