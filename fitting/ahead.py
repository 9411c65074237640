"""What a fit is going to need, compiled or read while it is still at its first steps."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from fitting import uncertainty, violations
from fitting.reduced import Problem
from fitting.solve import refine


def begin(problem: Problem, *, last: bool) -> None:
    """Of a problem that is about to be searched: descents, albedos and uncertainties.

    The latter two if this search is the ``last``, unless penalties are needed after all.
    """
    unknowns = problem.unknowns
    shape = (problem.target.shape[0], unknowns.n_coefficients)
    u = jax.ShapeDtypeStruct((unknowns.n_shape,), jnp.float64)
    x = jax.ShapeDtypeStruct(shape, jnp.float64)
    refine.begin(problem, u, x)
    if last:
        uncertainty.begin(problem, u, x)
        violations.begin(problem)
