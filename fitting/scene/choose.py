"""The cheapest model that a scene cannot tell from the data."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from data_formats import Measurement
from fitting.by_name import own_settings
from fitting.compiled import make_room
from fitting.expression import ModelError
from fitting.model import Model
from fitting.options import FitOptions
from fitting.result import FitResult
from fitting.scene import choice_words as words
from fitting.scene.choice import CHOICE_VERSION, Candidate, Choice
from fitting.scene.description import Scene
from fitting.scene.load import load_scene
from fitting.scene.refit import Refit, confirmed, refit
from fitting.scene.render import render
from fitting.scene.stage import ImageError, Stage, set_stage
from fitting.scene.wavelengths import fewer_wavelengths
from fitting.tradeoff.evaluation_cost import operations

# From cheap to dear, one thing added at a time.
LADDER = (
    "lambert",
    "lambert + ward",
    "lambert + ggx(bare)",
    "lambert + ggx",
    "lambert + beckmann",
    "eon + ggx",
    "lambert + ggx + blinn_phong",
    "lambert + 2*ggx",
    "lambert + 3*ggx",
)
STARTS = 4
# Of the tolerance: what single precision may add, and float64 costs as against float32.
_PRECISE, _DOUBLE = 0.02, 2.0
_MOST_THREADS = 8

Say = Callable[[str], None]


@dataclass(frozen=True)
class _Tried:
    """A candidate with the fit that it comes from."""

    candidate: Candidate
    fit: Refit


def choose_for_scene(
    measurement: Measurement,
    scene: Scene | str | os.PathLike,
    models: Sequence[str] | None = None,
    *,
    stage: Stage | None = None,
    progress: Say | None = None,
    **settings: Any,
) -> Choice:
    """Refit every model for the scene and keep the cheapest within its tolerance.

    ``models`` are `LADDER` by default; ``settings`` fields of `FitOptions`,
    of which each model takes what names its parameters. Cost is
    `fitting.tradeoff.evaluation_cost.operations`, which does not depend on the machine. If
    no model is within the tolerance, or only one that costs more, models with a shape for
    every channel are tried too; if still none is, the nearest one is kept, and ``met`` is
    false. Give ``stage`` to use what `set_stage` made before.

    Raises `SceneError`, `ModelError`, and `MeasurementError` for data without reflection.
    """
    say = progress or (lambda _: None)
    make_room()
    models = tuple(dict.fromkeys(Model(m).expression for m in models or LADDER))
    unable = [m for m in models if "front" not in Model(m).ways]
    if unable:
        raise ModelError(
            f"model {unable[0]!r} does not reflect at the front, and a scene shows nothing "
            "else; expected models with a lobe for it"
        )
    if stage is None:
        told = scene if isinstance(scene, Scene) else load_scene(scene)
        stage = set_stage(measurement, told, progress=say)
    settings = {"starts": STARTS, **settings}
    tried = _all(stage, models, settings, say)
    best = _cheapest(tried)
    if measurement.n_channels > 1 and not settings.get("per_channel_shape"):
        for one in _worth_a_shape_per_channel(tried, best, measurement.n_channels):
            say(f"refitting {one} with a shape per channel")
            tried.append(_try(stage, one, {**settings, "per_channel_shape": True}))
        best = _cheapest(tried)
    tried.sort(key=lambda t: (t.candidate.operations, t.candidate.parameters))
    chosen, met, result, error = _confirmed(stage, tried, say)
    kept = tried[chosen]
    candidates = _told(stage, tried, chosen)
    return Choice(
        version=CHOICE_VERSION,
        scene=stage.scene.name,
        measure=stage.measure.name,
        limits=list(stage.measure.limits),
        met=met,
        candidates=candidates,
        chosen=chosen,
        error=error,
        verdict=words.verdict(stage, candidates, chosen, met, error, kept.fit),
        wavelengths=fewer_wavelengths(stage, kept.fit) if met else [],
        unseen=words.unseen(stage, kept.fit),
        unsupported=words.unsupported(stage, candidates[chosen]),
        extrapolated_share=stage.extrapolated_share,
        result=result,
    )


def _all(
    stage: Stage, models: Sequence[str], settings: Mapping[str, Any], say: Say
) -> list[_Tried]:
    """Every model; most of the time is the compiler's, which runs beside itself."""
    told = itertools.count(1)

    def one(model: str) -> _Tried:
        say(f"refitting {model} ({next(told)} of {len(models)})")
        return _try(stage, model, settings)

    workers = min(len(models), os.cpu_count() or 1, _MOST_THREADS)
    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(one, models))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _try(stage: Stage, expression: str, settings: Mapping[str, Any]) -> _Tried:
    options = FitOptions(**own_settings(Model(expression), settings))
    found = refit(stage, expression, options)
    single = stage.error(found.model, found.values, precision="f32")
    limit = stage.measure.limits[0]
    enough = abs(single.raw_mean - found.error.raw_mean) <= _PRECISE * limit
    cost = operations(
        expression,
        stage.measurement.n_channels,
        per_channel_shape=options.per_channel_shape,
    )
    error = single if enough else found.error
    candidate = Candidate(
        model=expression,
        per_channel_shape=options.per_channel_shape,
        precision="float32" if enough else "float64",
        objective=str(found.options.objective),
        operations=cost * (1.0 if enough else _DOUBLE),
        parameters=_count(found),
        error=error,
        within_tolerance=stage.within(error),
    )
    return _Tried(candidate, found)


def _confirmed(
    stage: Stage, tried: list[_Tried], say: Say
) -> tuple[int, bool, FitResult, ImageError]:
    """Which is kept: the cheapest that is within the tolerance also as fitted in full.

    With penalties a fit may be farther off than without, and its candidate says so. If none
    is within the tolerance, the nearest one is kept.
    """
    within = [i for i, t in enumerate(tried) if t.candidate.within_tolerance]
    for i in within:
        say(f"uncertainties of {tried[i].candidate.model}")
        result, error = confirmed(stage, tried[i].fit, tried[i].candidate.precision)
        if stage.within(error):
            return i, True, result, error
        own = msgspec.structs.replace(
            tried[i].candidate, error=error, within_tolerance=False
        )
        tried[i] = replace(tried[i], candidate=own)
    i = _nearest(tried)
    say(f"uncertainties of {tried[i].candidate.model}")
    result, error = confirmed(stage, tried[i].fit, tried[i].candidate.precision)
    return i, False, result, error


def _count(found: Refit) -> int:
    """Free parameters, one per channel where they differ by channel."""
    declared, fixed = found.model.parameters(), found.options.fix
    free = (n for n, p in declared.items() if not p.given and n not in fixed)
    return sum(np.size(found.values[n]) for n in free)


def _cheapest(tried: Sequence[_Tried]) -> _Tried | None:
    within = [t for t in tried if t.candidate.within_tolerance]
    return min(
        within, key=lambda t: (t.candidate.operations, t.candidate.parameters), default=None
    )


def _nearest(tried: Sequence[_Tried]) -> int:
    return int(np.argmin([t.candidate.error.mean for t in tried]))


def _worth_a_shape_per_channel(
    tried: Sequence[_Tried], best: _Tried | None, channels: int
) -> list[str]:
    """Models that may be cheaper with a shape per channel than what is within tolerance.

    The nearest one if nothing is; else those that miss the tolerance and cost less.
    """
    shaped = [t for t in tried if _has_shape(t.candidate.model)]
    if best is None:
        return [shaped[_nearest(shaped)].candidate.model] if shaped else []
    most = best.candidate.operations
    return [
        t.candidate.model
        for t in shaped
        if not t.candidate.within_tolerance
        and operations(t.candidate.model, channels, per_channel_shape=True) < most
    ]


def _has_shape(expression: str) -> bool:
    declared = Model(expression).parameters().values()
    return any(not p.coefficient and not p.given for p in declared)


def _told(stage: Stage, tried: Sequence[_Tried], chosen: int) -> list[Candidate]:
    """The candidates with what each changes and costs, in a sentence."""
    kept = tried[chosen]
    image = render(kept.fit.model, kept.fit.values, stage.judged).radiance
    out: list[Candidate] = []
    for t in tried:
        other = render(t.fit.model, t.fit.values, stage.judged).radiance
        change = stage.statistics(other, image)[0]
        own = msgspec.structs.replace(t.candidate, change=change)
        sentence = words.sentence(stage, own, kept.candidate)
        out.append(msgspec.structs.replace(own, sentence=sentence))
    return out
