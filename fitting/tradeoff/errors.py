"""How far a fit is from the data: in their own space, in energy, in an image."""

from __future__ import annotations

import msgspec

from data_formats import Measurement
from fitting.result import AngleError, FitResult, Scores
from fitting.scene.stage import Stage
from fitting.tradeoff.albedo_error import AlbedoError, albedo_error
from fitting.tradeoff.rendered_error import RenderedError, rendered_error


class Errors(msgspec.Struct, frozen=True):
    """All errors of one fit.

    ``fitted`` and ``held_out`` are all the objectives, over the rows that were fitted and
    over the rows of each angle of incidence as predicted without it; ``typical`` the
    geometric mean of the held-out angles' RMS of the fit's own objective, ``by_angle`` what
    it is the mean of. Null without a second angle; ``albedo`` where the rows cannot be
    summed, ``image`` where no image can be made.
    """

    fitted: Scores
    held_out: Scores | None
    typical: float | None
    by_angle: list[AngleError]
    albedo: AlbedoError | None
    image: RenderedError | None


def errors_of(measurement: Measurement, result: FitResult, stage: Stage | None) -> Errors:
    """Measure all errors of a fit, that in an image only if there is a stage."""
    validation = result.cross_validation
    return Errors(
        fitted=result.scores,
        held_out=None if validation is None else validation.scores,
        typical=None if validation is None else validation.typical,
        by_angle=[] if validation is None else validation.by_angle,
        albedo=albedo_error(measurement, result),
        image=None if stage is None else rendered_error(stage, result),
    )


def objective_error(scores: Scores, objective: str) -> float:
    """The RMS of the objective that a fit made small, among all its scores."""
    if objective == "chi2":
        return (scores.chi2_reduced or 0.0) ** 0.5
    return float(getattr(scores, objective))
