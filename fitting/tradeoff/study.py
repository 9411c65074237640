"""The whole of `brdf tradeoff`: candidates one by one, then the trades inside the best."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version

import jax
import msgspec
import numpy as np

from data_formats import Measurement
from fitting import judge
from fitting.comparison import choose, default_models, n_free
from fitting.model import Model
from fitting.models.lobe import THROUGH, Way
from fitting.options import FitOptions
from fitting.problem import resolve_objective
from fitting.result import FitResult
from fitting.rows import select_rows, ways_of
from fitting.scene import load_scene
from fitting.scene.stage import Stage
from fitting.tradeoff.errors import errors_of
from fitting.tradeoff.evaluation_cost import EvaluationCost, evaluation_cost
from fitting.tradeoff.fit_cost import FitCost, fit_and_cost
from fitting.tradeoff.formula_trades import formula_trades, table_trades
from fitting.tradeoff.noise_floor import noise_floors
from fitting.tradeoff.precision_trades import data_trades, evaluation_trades
from fitting.tradeoff.quadrature_trades import quadrature_trades
from fitting.tradeoff.rendered_error import stage_of
from fitting.tradeoff.sampling_trades import channel_trades, row_trades
from fitting.tradeoff.solver_trades import start_trades, tolerance_trades
from fitting.tradeoff.table import (
    SCHEMA_VERSION,
    Candidate,
    CostAxis,
    ErrorAxis,
    Tradeoff,
    judged,
)
from fitting.tradeoff.trade import NotPossible, Trade, enough

# From cheap to dear, one thing added at a time: a base, gloss of short and of long skirts,
# exact Fresnel, exact shadowing of a Gaussian surface, a base that loses no light, light
# that is scattered more than once, no projected areas, two lobes, a free skirt.
LADDER = (
    "lambert",
    "lambert + ward",
    "lambert + ggx(bare)",
    "lambert + ggx",
    "lambert + ggx(dielectric)",
    "lambert + beckmann",
    "lambert + 2*ggx",
    "lambert + ggx + blinn_phong",
    "eon + ggx",
    "lambert + ggx(ms)",
    "lambert + student_t",
)

# Units of progress: about seconds on a slow machine that has compiled nothing yet.
_SCENE, _FIT, _EVALUATION, _ERRORS = 8.0, 20.0, 3.0, 2.0
CANDIDATE = _FIT + _EVALUATION + _ERRORS

Say = Callable[[str, float], None]


@dataclass(frozen=True)
class Plan:
    """What is to be measured.

    - `models`: the candidates.
    - `inside`: the model whose inside is varied; None for the best of the candidates.
    - `vary`: whether anything inside is varied at all.
    - `options`: of the fits.
    - `scene`: of the image, or None for no image.
    - `repeats`: of every time.
    """

    models: tuple[str, ...]
    inside: str | None = None
    vary: bool = True
    options: FitOptions = field(default_factory=FitOptions)
    scene: str | None = "studio"
    cost_axis: CostAxis = "operations"
    error_axis: ErrorAxis | None = None
    repeats: int = 9


@dataclass(frozen=True)
class _Examined:
    """A candidate with what the trades inside it begin from."""

    candidate: Candidate
    result: FitResult


def ladder(measurement: Measurement) -> tuple[str, ...]:
    """The default candidates: `LADDER`, or with other light what `brdf fit` compares."""
    found = set(np.unique(ways_of(measurement)[measurement.valid.any(axis=1)]))
    if found & {*THROUGH, "back"}:
        return default_models(measurement)
    return LADDER


def units(plan: Plan) -> float:
    """How much there is to do, in the units that `study` says."""
    inside = sum(weight for _, weight in _INSIDE) if plan.vary else 0.0
    more = plan.inside is not None and not {*_canonical([plan.inside])} <= {
        *_canonical(plan.models)
    }
    scene = 0.0 if plan.scene is None else _SCENE
    return scene + CANDIDATE * (len(plan.models) + (plan.vary and more)) + inside


def study(measurement: Measurement, plan: Plan, *, say: Say) -> Iterator[Tradeoff]:
    """Measure the plan; yields the table as far as it is, after every piece.

    ``say(what, units)`` is told what is done next and how many units it was before.
    Raises `ModelError` for a senseless model before any work.
    """
    models = _canonical(plan.models)
    inside = None if plan.inside is None else Model(plan.inside).expression
    scene = None if plan.scene is None else load_scene(plan.scene)
    table = _empty(measurement, plan, models)
    stage = None
    if scene is not None:
        say("setting the scene", 0.0)
        try:
            stage = stage_of(measurement, scene)
        except NotPossible as error:
            table = _with(table, [], [], [f"image: {error}"])
        say("setting the scene", _SCENE)
    examined: dict[str, _Examined] = {}
    for model in models:
        examined[model] = _examine(measurement, model, plan, stage, say)
        found = [e.candidate for e in examined.values()]
        table = judged(msgspec.structs.replace(table, candidates=found))
        yield table
    if not plan.vary:
        return
    if inside is None:
        results = tuple(e.result for e in examined.values())
        inside = results[choose(results)[0]].model
    if inside not in examined:
        examined[inside] = _examine(measurement, inside, plan, stage, say)
    table = msgspec.structs.replace(table, inside=inside)
    for what, weight in _INSIDE:
        say(f"inside {inside}: {what}", 0.0)
        table = _with(table, *_vary(what, measurement, examined[inside], plan, table.noise))
        say(f"inside {inside}: {what}", weight)
        yield table


def _examine(
    measurement: Measurement, model: str, plan: Plan, stage: Stage | None, say: Say
) -> _Examined:
    say(f"{model}: fitting", 0.0)
    result, fitting = fit_and_cost(measurement, model, plan.options, repeats=plan.repeats)
    say(f"{model}: evaluating", _FIT)
    evaluation = evaluation_cost(
        model, measurement.n_channels, result.values, repeats=plan.repeats
    )
    say(f"{model}: errors", _EVALUATION)
    errors = errors_of(measurement, result, stage)
    say(f"{model}: errors", _ERRORS)
    candidate = Candidate(
        model=model,
        parameters=n_free(result),
        rows_used=result.data.rows_used,
        converged=result.solver.converged,
        evaluation=evaluation,
        fit=fitting,
        errors=errors,
    )
    return _Examined(candidate, result)


_INSIDE = (
    ("solver tolerance", 8.0),
    ("starts", 4.0),
    ("precision", 5.0),
    ("nodes of the albedo", 8.0),
    ("formulas", 6.0),
    ("table", 4.0),
    ("wavelengths", 40.0),
    ("rows", 40.0),
)


def _vary(
    what: str, measurement: Measurement, of: _Examined, plan: Plan, noise: float | None
) -> tuple[list[Trade], list[str], list[str]]:
    """Trades, what they say, and what was not possible."""
    result, options, repeats = of.result, plan.options, plan.repeats
    evaluation: EvaluationCost = of.candidate.evaluation
    fitting: FitCost = of.candidate.fit
    few = max(3, repeats // 2)
    groups: dict[str, Callable[[], list[list[Trade]]]] = {
        "solver tolerance": lambda: [
            tolerance_trades(measurement, result, options, repeats=repeats)
        ],
        "starts": lambda: [start_trades(measurement, result, options, repeats=few)],
        "precision": lambda: [
            evaluation_trades(measurement, result, evaluation),
            data_trades(measurement, result, fitting, options, repeats=few),
        ],
        "nodes of the albedo": lambda: [quadrature_trades(result, repeats=repeats)],
        "formulas": lambda: formula_trades(result, repeats=repeats),
        "table": lambda: [table_trades(result, evaluation, repeats=repeats)],
        "wavelengths": lambda: [channel_trades(measurement, result, options, repeats=few)],
        "rows": lambda: [row_trades(measurement, result, options, repeats=few)],
    }
    try:
        found = groups[what]()
    except NotPossible as error:
        return [], [], [f"{what}: {error}"]
    return [t for g in found for t in g], [enough(g, noise) for g in found], []


def _with(
    table: Tradeoff, more: list[Trade], findings: list[str], left_out: list[str]
) -> Tradeoff:
    return msgspec.structs.replace(
        table,
        trades=table.trades + more,
        trade_findings=table.trade_findings + findings,
        left_out=table.left_out + left_out,
    )


def _canonical(models: Sequence[str]) -> tuple[str, ...]:
    """Each model once, as it writes itself. Raises `ModelError`."""
    return tuple(dict.fromkeys(Model(m).expression for m in models))


def _empty(measurement: Measurement, plan: Plan, models: Sequence[str]) -> Tradeoff:
    """The table before the first candidate: the data, their noise, the machine."""
    every: list[Way] = [w for m in models for w in Model(m).ways]
    rows = select_rows(measurement, plan.options.max_theta_deg, every)
    objective = resolve_objective(plan.options.objective, rows.sigma is not None)
    floors = noise_floors(measurement, rows, objective, plan.options)
    single = not judge.folds(rows)
    axis = plan.error_axis or ("fitted" if single else "held-out")
    left_out = [] if floors else ["noise floor: no sigma, repeats or exchanged directions"]
    if single and plan.error_axis is None:
        left_out.append("held-out errors: there is a single angle of incidence")
    return Tradeoff(
        schema_version=SCHEMA_VERSION,
        path=measurement.provenance.path or "",
        sha256=measurement.provenance.sha256 or "",
        sample=measurement.provenance.sample or "",
        rows=measurement.n_rows,
        channels=[c.name for c in measurement.channels],
        objective=objective,
        scene=plan.scene,
        cost_axis=plan.cost_axis,
        error_axis=axis,
        candidates=[],
        noise_floors=floors,
        findings=[],
        inside=None,
        trades=[],
        trade_findings=[],
        left_out=left_out,
        interrupted=False,
        machine={
            "processor": platform.processor() or platform.machine(),
            "cores": str(os.cpu_count() or 1),
            "system": platform.system(),
            "backend": jax.default_backend(),
        },
        versions={"python": platform.python_version()}
        | {p: version(p) for p in ("brdf-fitting", "jax", "jaxlib", "numpy")},
    )
