"""A model fitted for a scene: weighed by what it looks at, judged by its picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from fitting.fitter import fit
from fitting.given import with_given
from fitting.model import Model
from fitting.objectives import ObjectiveName
from fitting.options import FitOptions
from fitting.result import FitResult
from fitting.rows import Rows, select_rows, weighted
from fitting.scene.importance import row_weights
from fitting.scene.stage import ImageError, Stage
from fitting.search import search
from fitting.summary import joined_values
from fitting.unseen import without_unseen

# No single compression wins for all materials; the picture decides (Bieron and Peers 2020,
# An adaptive BRDF fitting metric).
COMPRESSIVE: tuple[ObjectiveName, ...] = ("log1p", "asinh", "cbrt")


@dataclass(frozen=True)
class Refit:
    """A model's values as fitted with one objective, and how far its picture is."""

    model: Model
    values: dict[str, np.ndarray]
    options: FitOptions
    error: ImageError

    @property
    def weighed(self) -> bool:
        """Whether rows counted as the scene sees them."""
        return isinstance(self.options.weights, np.ndarray)


def refit(
    stage: Stage,
    expression: str,
    options: FitOptions,
    objectives: Sequence[ObjectiveName] = COMPRESSIVE,
) -> Refit:
    """The fit with the smallest mean error in the scene.

    Each objective with the scene's weights (`fitting.scene.importance`), and the first one
    with the ``options``' own, lest the scene's make a poor model worse. Without penalties
    and uncertainties, which `confirmed` adds for the model that is kept.
    """
    tried = [replace(options, objective=objectives[0])]
    for objective in objectives:
        weights = row_weights(stage, objective)
        tried.append(replace(options, objective=objective, weights=weights))
    found = [fitted(stage, expression, own) for own in tried]
    return min(found, key=lambda f: f.error.raw_mean)


def confirmed(
    stage: Stage, found: Refit, precision: str = "float64"
) -> tuple[FitResult, ImageError]:
    """The same fit in full, with penalties and uncertainties, and its own error."""
    result = fit(stage.measurement, found.model, found.options)
    short = {"float32": "f32", "float64": "f64"}[precision]
    return result, stage.error(found.model, result.values, precision=short)


def fitted(stage: Stage, expression: str, options: FitOptions) -> Refit:
    """A model fitted with these options alone."""
    model = Model(expression)
    options = with_given(stage.measurement, model, options)
    with jax.enable_x64(True):
        rows = _rows(stage, options)
        own, _ = without_unseen(rows, model, options)
        values = joined_values(search(rows, model, own))
    return Refit(model, values, options, stage.error(model, values))


def _rows(stage: Stage, options: FitOptions) -> Rows:
    rows = select_rows(stage.measurement, options.max_theta_deg)
    if isinstance(options.weights, np.ndarray):
        return weighted(rows, options.weights)
    return rows
