"""Cross-validation: the fit on angles of incidence that it has not seen."""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting import judge
from fitting.model import Model
from fitting.options import FitOptions
from fitting.result import AngleError, CrossValidation
from fitting.rows import Rows
from fitting.search import predicted_by, problems
from fitting.solve import refine
from fitting.summary import Found


def cross_validation(
    rows: Rows,
    model: Model,
    objective: str,
    options: FitOptions,
    found: list[Found],
    width: float,
) -> CrossValidation | None:
    """Refit without each angle of incidence, from the minimum of the whole."""
    theta = judge.theta_i_of(rows)
    errors: list[AngleError] = []
    total, count, squares = 0.0, 0, 0.0
    for held in judge.folds(rows):
        keep = np.ones(rows.index.size)
        keep[held] = 0.0
        ends = []
        kwargs: dict[str, Any] = {"robust_width": width, "row_weights": keep}
        kwargs["penalised"] = found[0].problem.penalised
        for p, f in zip(problems(rows, model, options, **kwargs), found, strict=True):
            u, x = jnp.asarray(f.solution.u), jnp.asarray(f.solution.x)
            ends.append(Found(p, jax.device_get(refine(p, u, x)), ()))
        predicted = predicted_by(ends, rows)
        r = judge.residuals(rows, predicted, objective, options)
        errors.append(judge.angle_error(rows, r, predicted, theta, held))
        total += float(np.sum(r[held] ** 2))
        count += int(rows.valid[held].sum())
        squares += errors[-1].l2 ** 2 * held.size
    if not errors:
        return None
    return CrossValidation(
        objective=math.sqrt(total / max(count, 1)),
        typical=math.exp(np.mean([math.log(max(e.objective, 1e-300)) for e in errors])),
        l2=math.sqrt(squares / rows.index.size),
        by_angle=errors,
    )
