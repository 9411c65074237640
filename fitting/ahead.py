"""What a fit is going to need, compiled or read while it is still at its first steps."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from fitting import predict, uncertainty, violations
from fitting.reduced import Problem
from fitting.solve import refine
from fitting.summary import values_at


def begin(problem: Problem, *, last: bool, whole: bool) -> None:
    """Of a problem that is about to be searched: descents; and uncertainties, albedos and
    predictions if this search is the ``last``, unless penalties are needed after all.
    Predictions are made of the ``whole``, not of one channel of several.
    """
    unknowns = problem.unknowns
    shape = (problem.target.shape[0], unknowns.n_coefficients)
    u = jax.ShapeDtypeStruct((unknowns.n_shape,), jnp.float64)
    x = jax.ShapeDtypeStruct(shape, jnp.float64)
    refine.begin(problem, u, x)
    if not last:
        return
    uncertainty.begin(problem, u, x)
    values = values_at(problem, np.zeros(u.shape), np.zeros(x.shape))
    violations.begin(problem, values)
    if whole:
        for rows in (problem.kappa.size, problem.pairs.cos_i.size):
            predict.begin(problem.model, values, rows)
