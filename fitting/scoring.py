"""A result against a measurement, without fitting."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from data_formats import Measurement
from fitting import judge
from fitting.expression import ModelError
from fitting.model import Model
from fitting.options import FitOptions
from fitting.result import AngleError, ChannelError, FitResult, Scores, Settings
from fitting.rows import select_rows, with_noise_of


class Score(msgspec.Struct, frozen=True):
    """How far a fitted model is from some data."""

    model: str
    rows_used: int
    objective: str
    scores: Scores
    by_angle: list[AngleError]
    by_channel: list[ChannelError]


def score(measurement: Measurement, result: FitResult) -> Score:
    """Errors of a result on a measurement, with the settings that it was fitted with.

    Raises `ModelError` if the channels differ and `MeasurementError` if no row is left.
    """
    theirs = [c.name for c in measurement.channels]
    ours = [c.name for c in result.channels]
    if theirs != ours:
        raise ModelError(
            f"the result has channels {_short(ours)} and the measurement has "
            f"{_short(theirs)}; they must be the same"
        )
    options = options_of(result.settings)
    rows = select_rows(measurement, options.max_theta_deg, Model(result.model).ways)
    at = rows.index
    predicted = result.evaluate(
        measurement.theta_i[at], measurement.phi_i[at],
        measurement.theta_r[at], measurement.phi_r[at],
    )  # fmt: skip
    predicted = np.broadcast_to(predicted, rows.value.shape)
    objective = result.settings.objective
    if objective == "chi2":
        rows = with_noise_of(rows, predicted)
    return Score(
        model=result.model,
        rows_used=int(at.size),
        objective=objective,
        scores=judge.scores(rows, predicted, options),
        by_angle=judge.by_angle(rows, predicted, objective, options),
        by_channel=judge.by_channel(rows, predicted, ours),
    )


def options_of(settings: Settings) -> FitOptions:
    """The options that a result was fitted with: the same fit can be made again."""

    def end(v: float | None, infinite: float) -> float:
        return infinite if v is None else v

    return FitOptions(
        objective=settings.objective,  # pyright: ignore[reportArgumentType]
        # Weights that were given row by row are those of other rows.
        weights="rows" if settings.weights == "rows" else "solid-angle",
        max_theta_deg=settings.max_theta_deg,
        robust=settings.robust,
        energy=settings.energy,
        reciprocity=settings.reciprocity,
        noise=settings.noise,
        fix={k: v[0] if len(v) == 1 else np.asarray(v) for k, v in settings.fix.items()},
        bounds={
            k: (end(a, -math.inf), end(b, math.inf))
            for k, (a, b) in settings.bounds.items()
        },
        tie=settings.tie,
        per_channel_shape=settings.per_channel_shape,
        starts=settings.starts,
    )


def _short(names: list[str]) -> str:
    return (
        ", ".join(names)
        if len(names) <= 4
        else f"{names[0]} ... {names[-1]} ({len(names)})"
    )
