"""Cross-validation: the fit on angles of incidence that it has not seen."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fitting import judge
from fitting.model import Model
from fitting.options import FitOptions
from fitting.result import CrossValidation
from fitting.rows import Rows
from fitting.search import predicted_by, problems, refined
from fitting.summary import Found


def cross_validation(
    rows: Rows,
    model: Model,
    objective: str,
    options: FitOptions,
    found: list[Found],
    width: float,
) -> CrossValidation | None:
    """Errors on every angle of incidence, predicted without it; None for a single angle."""
    predicted = held_out_predictions(rows, model, options, found, width)
    if predicted is None:
        return None
    theta = judge.theta_i_of(rows)
    r = judge.residuals(rows, predicted, objective, options)
    errors = [
        judge.angle_error(rows, r, predicted, theta, held) for held in judge.folds(rows)
    ]
    return CrossValidation(
        objective=math.sqrt(float(np.sum(r**2)) / max(int(rows.valid.sum()), 1)),
        typical=math.exp(np.mean([math.log(max(e.objective, 1e-300)) for e in errors])),
        l2=judge.l2(rows, predicted),
        by_angle=errors,
        scores=judge.scores(rows, predicted, options),
    )


def held_out_predictions(
    rows: Rows, model: Model, options: FitOptions, found: list[Found], width: float
) -> np.ndarray | None:
    """Values ``(n, c)`` of every row by a fit that has not seen its angle of incidence.

    Each fit is refined from the minimum of the whole. None for a single angle.
    """
    folds = judge.folds(rows)
    if not folds:
        return None
    out = np.empty(rows.value.shape)
    for held in folds:
        keep = np.ones(rows.index.size)
        keep[held] = 0.0
        ends = []
        kwargs: dict[str, Any] = {"robust_width": width, "row_weights": keep}
        kwargs["penalised"] = found[0].problem.penalised
        for p, f in zip(problems(rows, model, options, **kwargs), found, strict=True):
            ends.append(Found(p, refined(p, f.solution.u, f.solution.x), ()))
        out[held] = predicted_by(ends, rows)[held]
    return out
