"""Inside a model: float32 against float64, for evaluating it and for the data of a fit."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from data_formats import Measurement
from fitting.fitter import fit
from fitting.geometry import Geometry
from fitting.model import Model
from fitting.options import FitOptions
from fitting.predict import predict_geometry
from fitting.result import FitResult
from fitting.rows import select_rows
from fitting.scoring import score
from fitting.tradeoff.errors import objective_error
from fitting.tradeoff.evaluation_cost import EvaluationCost
from fitting.tradeoff.fit_cost import FitCost
from fitting.tradeoff.timing import Spread, timed
from fitting.tradeoff.trade import Setting, Trade, trades

# Values below this share of the largest have no digits that anybody needs.
_SMALL = 1e-6


def evaluation_trades(
    measurement: Measurement, result: FitResult, cost: EvaluationCost
) -> list[Trade]:
    """The fitted model in float32 against float64, at the directions of the data.

    Half vectors are made in float64 before they are rounded, as `fitting.Geometry` does.
    """
    model = Model(result.model)
    g = select_rows(measurement, result.settings.max_theta_deg, model.ways).geometry
    exact = predict_geometry(model, result.values, g)
    rounded = _in_float32(model, result.values, g)
    off = relative_deviation(rounded, exact)
    settings = [
        Setting("float64", _seconds(cost, "float64"), 8.0, 0.0, 0.0),
        Setting(
            "float32",
            _seconds(cost, "float32"),
            4.0,
            float(np.median(off)),
            float(np.max(off)),
        ),
    ]
    return trades(
        "precision of evaluation",
        settings,
        cost_of="evaluation",
        work_unit="bytes per number",
        error_of="relative deviation at the rows",
        deviation=True,
    )


def data_trades(
    measurement: Measurement,
    result: FitResult,
    cost: FitCost,
    options: FitOptions,
    *,
    repeats: int,
) -> list[Trade]:
    """A fit to data rounded to float32. The solver itself runs in float64 only.

    The error is the objective against the data as they were.
    """
    rounded = dataclasses.replace(
        measurement,
        value=measurement.value.astype(np.float32).astype(np.float64),
        sigma=None
        if measurement.sigma is None
        else measurement.sigma.astype(np.float32).astype(np.float64),
    )

    def run() -> FitResult:
        return fit(rounded, result.model, options, cross_validate=False)

    other = run()
    seconds = timed(run, repeats, budget_seconds=2.0 * repeats)
    of = result.settings.objective
    settings = [
        Setting("float64", cost.seconds, 8.0, _own(measurement, result)),
        Setting("float32", seconds, 4.0, _own(measurement, other)),
    ]
    return trades(
        "precision of the data (the solver runs in float64 only)",
        settings,
        cost_of="fit",
        work_unit="bytes per number",
        error_of=f"{of}, all rows",
        deviation=False,
    )


def relative_deviation(value: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """``|value - exact| / |exact|``, flat, without values that are next to nothing."""
    size = np.abs(exact)
    good = size > _SMALL * size.max()
    return np.abs(value - exact)[good] / size[good]


def _own(measurement: Measurement, result: FitResult) -> float:
    return objective_error(score(measurement, result).scores, result.settings.objective)


def _in_float32(model: Model, values: dict[str, np.ndarray], g: Geometry) -> np.ndarray:
    with jax.enable_x64(False):
        own = {n: jnp.asarray(v, jnp.float32) for n, v in values.items()}
        geometry = jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), g)
        return np.asarray(jax.jit(lambda v, g: model(v, g))(own, geometry), np.float64)


def _seconds(cost: EvaluationCost, precision: str) -> Spread | None:
    found = cost.of(precision)
    return None if found is None else found.batched_ns.scaled(1e-9)
