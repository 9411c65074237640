"""The fit: from a measurement and a model to a result."""

from __future__ import annotations

import dataclasses
import functools
import math
import platform
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import jax
import msgspec
import numpy as np

from data_formats import Measurement
from fitting import judge, problem, summary
from fitting.data_record import data_record
from fitting.expression import ModelError
from fitting.given import with_given
from fitting.model import Model
from fitting.options import FitOptions
from fitting.result import (
    GIVEN_WEIGHTS,
    SCHEMA_VERSION,
    Channel,
    Energy,
    FitResult,
    Reciprocity,
    Settings,
    Solver,
)
from fitting.rows import Rows, select_rows, weighted, with_noise_of
from fitting.search import again, predicted_by, robust_width, search
from fitting.summary import Found, joined_values
from fitting.uncertainty import covariance
from fitting.unseen import without_unseen
from fitting.validation import cross_validation
from fitting.violations import worst_albedo, worst_reciprocity

Progress = Callable[[str], None]
_SAME_COST = 1e-6
_ROUNDING = 1e-16
_NOTICEABLY_COSTLIER = 1.001
_FAR_COSTLIER = 1e4


def fit(
    measurement: Measurement,
    model: Model | str,
    options: FitOptions | None = None,
    *,
    cross_validate: bool = True,
    colour: bool = False,
    progress: Progress | None = None,
    **settings: Any,
) -> FitResult:
    """Fit a model to a measurement by least squares.

    ``settings`` are fields of `FitOptions`, for instance ``objective="chi2"`` or
    ``fix={"ggx.f90": 1.0}``. ``cross_validate`` refits with every angle of incidence left
    out; ``colour`` adds Delta E 2000 (imports colour-science, 2 s). ``progress`` is called
    with a word on what is being done.

    Raises `MeasurementError` if no row is left to fit and `ModelError` for a senseless
    model or option. Runs in float64 without changing JAX's configuration.
    """
    unknown = set(settings) - {f.name for f in dataclasses.fields(FitOptions)}
    if unknown:
        raise ModelError(f"fit has no option {', '.join(sorted(unknown))}; see FitOptions")
    options = dataclasses.replace(options or FitOptions(), **settings)
    model = model if isinstance(model, Model) else Model(model)
    say = progress or (lambda _: None)
    options = with_given(measurement, model, options)
    rows = select_rows(measurement, options.max_theta_deg, model.ways)
    if isinstance(options.weights, np.ndarray):
        rows = weighted(rows, options.weights)
    with jax.enable_x64(True):
        options, unseen = without_unseen(rows, model, options)
        found = _fit(measurement, rows, model, options, cross_validate, colour, say)
    return msgspec.structs.replace(found, identifiability=[*unseen, *found.identifiability])


def _fit(
    measurement: Measurement,
    rows: Rows,
    model: Model,
    options: FitOptions,
    cross_validate: bool,
    colour: bool,
    say: Progress,
) -> FitResult:
    names = [c.name for c in measurement.channels]
    objective = problem.resolve_objective(options.objective, rows.sigma is not None)
    say("searching for the shape")
    found = search(rows, model, options)
    if objective == "chi2" and (rows.sigma is None or options.noise is not None):
        # Weights from noisy values favour the low ones; weights from the fit do not.
        for _ in range(problem.NOISE_ROUNDS):
            rows = with_noise_of(rows, predicted_by(found, rows))
            found = again(rows, model, options, found)
    width = math.inf
    if options.robust:
        say("again with robust residuals")
        width = robust_width(rows, objective, options, found)
        found = again(rows, model, options, found, robust_width=width)
    wants_energy = options.energy != "hard" and float(options.energy) > 0
    one_sided = not model.reciprocal and options.reciprocity > 0
    worst = worst_albedo(model, found)
    exceeds = wants_energy and worst.albedo > 1.0
    if exceeds or one_sided:
        say("again with the penalties")
        found = again(rows, model, options, found, robust_width=width, penalised=True)
        worst = worst_albedo(model, found)
    say("uncertainties")
    covariances = [covariance(f.problem, f.solution) for f in found]
    values = joined_values(found)
    predicted = predicted_by(found, rows)
    validation = None
    if cross_validate:
        say("leaving out each angle of incidence")
        validation = cross_validation(rows, model, objective, options, found, width)
    parameters, correlations, words = summary.parameters(model, found, covariances, names)
    if exceeds:
        words.append(
            "the energy penalty holds the fit: without it the albedo would exceed 1; the "
            "uncertainties are those of the data alone"
        )
    return FitResult(
        schema_version=SCHEMA_VERSION,
        model=model.expression,
        channels=[
            Channel(c.name, None if c.wavelength_nm is None else float(c.wavelength_nm))
            for c in measurement.channels
        ],
        parameters=parameters,
        uncertainty_method="row-clustered sandwich (HC2), t intervals by Satterthwaite",
        correlations=correlations,
        identifiability=words,
        settings=_settings(objective, options),
        scores=judge.scores(rows, predicted, options),
        by_angle=judge.by_angle(rows, predicted, objective, options),
        by_channel=judge.by_channel(rows, predicted, names),
        cross_validation=validation,
        energy=Energy(
            max_albedo=worst.albedo,
            theta_deg=worst.theta_deg,
            channel=names[worst.channel],
            constraint="hard" if options.energy == "hard" else
            ("penalty" if wants_energy else "none"),
            weight=float(options.energy) if options.energy != "hard" else None,
            active=exceeds,
            side=worst.side,
            transmitted=worst.transmitted,
        ),
        reciprocity=_reciprocity(model, values, options),
        colour=_colour(measurement, rows, predicted) if colour else None,
        solver=_solver(found, objective),
        data=data_record(measurement, rows, float(np.mean(model.relative_index(values)))),
        versions=_versions(),
        references=sorted({lobe.REFERENCE for lobe in model.lobes}),
        typical_deviation=judge.typical_deviation(predicted, rows.value, rows.valid),
    )  # fmt: skip


def _reciprocity(
    model: Model, values: dict[str, np.ndarray], options: FitOptions
) -> Reciprocity:
    return Reciprocity(
        worst_reciprocity(model, values),
        model.reciprocal,
        None if model.reciprocal else options.reciprocity,
    )


def _solver(found: list[Found], objective: str) -> Solver:
    converged = all(bool(f.solution.converged) for f in found)
    cost = sum(float(f.solution.cost) for f in found)
    best = [min(f.costs) for f in found]
    # Costs within rounding of the data are the same, also where the fit is exact.
    same = [
        b * (1 + _SAME_COST) + _ROUNDING * float(f.problem.scale)
        for f, b in zip(found, best, strict=True)
    ]
    agreeing = min(sum(c <= s for c in f.costs) for f, s in zip(found, same, strict=True))
    n_starts = min(len(f.costs) for f in found)
    others = [
        min(c for c in f.costs if c > s) / b
        for f, b, s in zip(found, best, same, strict=True)
        if b > 0 and any(s < c < math.inf for c in f.costs)
    ]
    steps = max(int(f.solution.steps) for f in found)
    after = f"{steps} step{'' if steps == 1 else 's'}"
    if not converged:
        sentence = f"stopped after {after} without convergence"
    elif n_starts == 1:
        sentence = f"converged in {after} from a single start"
    elif agreeing == n_starts:
        sentence = f"converged in {after}; all {n_starts} starts agree"
    else:
        sentence = (
            f"converged in {after}; {agreeing} of {n_starts} starts reach the best minimum"
        )
        if others and min(others) >= _FAR_COSTLIER:
            sentence += ", the next one costs far more"
        elif others and min(others) >= _NOTICEABLY_COSTLIER:
            sentence += f", the next one costs {min(others):.4g} times as much"
        elif others:
            sentence += ", the next one costs hardly more"
    return Solver(
        sentence=f"{sentence} ({objective})",
        converged=converged,
        cost=cost,
        steps=steps,
        starts=n_starts,
        starts_agreeing=agreeing,
        runner_up_cost_ratio=min(others) if others else None,
    )


def _settings(objective: str, options: FitOptions) -> Settings:
    def end(v: float) -> float | None:
        return float(v) if math.isfinite(v) else None

    return Settings(
        objective=objective,
        weights=options.weights if isinstance(options.weights, str) else GIVEN_WEIGHTS,
        max_theta_deg=options.max_theta_deg,
        robust=options.robust,
        noise=options.noise,
        per_channel_shape=options.per_channel_shape,
        starts=options.starts,
        energy=options.energy if options.energy == "hard" else float(options.energy),
        reciprocity=options.reciprocity,
        fix={k: [float(x) for x in np.atleast_1d(v)] for k, v in options.fix.items()},
        bounds={k: (end(a), end(b)) for k, (a, b) in options.bounds.items()},
        tie=dict(options.tie),
        material=dict(options.material),
    )


def _colour(measurement: Measurement, rows: Rows, predicted: np.ndarray):
    from fitting.colour import colour_difference

    if measurement.wavelengths is None:
        return None
    return colour_difference(measurement.wavelengths, rows, predicted)


# Looking a version up reads files, which many fits in a row would notice.
_version = functools.cache(version)


def _versions() -> dict[str, str]:
    packages = ("brdf-fitting", "jax", "jaxlib", "optimistix", "equinox", "numpy")
    return {"python": platform.python_version()} | {p: _version(p) for p in packages}
