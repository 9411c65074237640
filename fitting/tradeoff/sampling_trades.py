"""Inside a fit: fewer rows, fewer wavelengths."""

from __future__ import annotations

import dataclasses

import numpy as np

from data_formats import Measurement
from fitting import judge
from fitting.comparison import n_free
from fitting.fitter import fit
from fitting.model import Model
from fitting.options import FitOptions
from fitting.predict import predict_geometry
from fitting.result import FitResult
from fitting.rows import select_rows, with_noise_of
from fitting.tradeoff.errors import objective_error
from fitting.tradeoff.timing import Spread, timed
from fitting.tradeoff.trade import NotPossible, Setting, Trade, trades

ROW_STEPS = (1, 2, 4, 8)
CHANNEL_STEPS = (1, 2, 4, 8)
_LEAST_ROWS_PER_PARAMETER = 4
_SUBSETS = 3
_GOLDEN = (5.0**0.5 - 1.0) / 2.0


def row_trades(
    measurement: Measurement, result: FitResult, options: FitOptions, *, repeats: int
) -> list[Trade]:
    """Refits on one of k rows, with the error over all rows.

    Which ones follows the golden ratio, so that neither a ring nor an azimuth is left out
    as a whole; of three such choices the error is the median and ``worst`` the largest. The
    seconds are of a warm fit. Raises `NotPossible` for few rows.
    """
    n_shape = sum(p.kind == "shape" and not p.fixed for p in result.parameters)
    least = _LEAST_ROWS_PER_PARAMETER * (n_shape + _per_channel(result))
    steps = [k for k in ROW_STEPS if k == 1 or result.data.rows_used // k >= least]
    if len(steps) < 2:
        raise NotPossible(f"{result.data.rows_used} rows are too few to leave rows out")
    settings: list[Setting] = []
    for k in steps:
        errors: list[float] = []
        used: list[int] = []
        for which in range(min(k, _SUBSETS)):
            part = measurement.select(spread_rows(measurement.n_rows, k, which))
            fitted = _refit(part, result, options)
            errors.append(_error(measurement, result, fitted.values, options))
            used.append(fitted.data.rows_used)
        part = measurement.select(spread_rows(measurement.n_rows, k))
        settings.append(
            Setting(
                _one_of(k, "rows"),
                _warm_seconds(part, result, options, repeats),
                float(used[0]),
                float(np.median(errors)),
                max(errors),
            )
        )
    return trades(
        "rows of the fit",
        settings,
        cost_of="fit",
        work_unit="rows",
        error_of=f"{result.settings.objective}, all rows",
        deviation=False,
    )


def channel_trades(
    measurement: Measurement, result: FitResult, options: FitOptions, *, repeats: int
) -> list[Trade]:
    """Refits on every k-th wavelength and the last one, with the error over all of them.

    Coefficients are interpolated linearly between the wavelengths, as are shape parameters
    that have one value per channel. Raises `NotPossible` for bands or few wavelengths.
    """
    known = measurement.wavelengths
    if known is None:
        raise NotPossible("the channels have no wavelengths between which to interpolate")
    order = np.argsort(known)
    steps = [k for k in CHANNEL_STEPS if k == 1 or known.size > 2 * k]
    if len(steps) < 2:
        raise NotPossible(f"{known.size} wavelengths are too few to leave some out")
    settings: list[Setting] = []
    for k in steps:
        chosen = np.sort(order[sorted({*range(0, known.size, k), known.size - 1})])
        part = _channels(measurement, chosen)
        fitted = _refit(part, result, options)
        values = _interpolated(fitted, known[chosen], known)
        error = _error(measurement, result, values, options)
        seconds = _warm_seconds(part, result, options, repeats)
        name = _one_of(k, "wavelengths")
        settings.append(Setting(name, seconds, float(n_free(fitted)), error))
    return trades(
        "wavelengths of the fit",
        settings,
        cost_of="fit",
        work_unit="parameters",
        error_of=f"{result.settings.objective}, all wavelengths",
        deviation=False,
    )


def spread_rows(count: int, step: int, which: int = 0) -> np.ndarray:
    """About one of ``step`` of ``count`` row numbers, in no rhythm with any table.

    ``which`` is the number of the choice, 0 to ``step - 1``; no two have a row in common.
    """
    share = np.mod(np.arange(count) * _GOLDEN, 1.0)
    return np.flatnonzero(np.floor(share * step) == which % step)


def _refit(part: Measurement, result: FitResult, options: FitOptions) -> FitResult:
    return fit(part, result.model, options, cross_validate=False)


def _warm_seconds(
    part: Measurement, result: FitResult, options: FitOptions, repeats: int
) -> Spread:
    """Of a fit that was made before, so that it is compiled."""
    return timed(
        lambda: _refit(part, result, options), repeats, budget_seconds=float(repeats)
    )


def _one_of(step: int, what: str) -> str:
    return f"all {what}" if step == 1 else f"1 of {step} {what}"


def _per_channel(result: FitResult) -> int:
    return sum(p.kind == "coefficient" and not p.fixed for p in result.parameters)


def _channels(m: Measurement, chosen: np.ndarray) -> Measurement:
    return dataclasses.replace(
        m,
        value=m.value[:, chosen],
        valid=m.valid[:, chosen],
        sigma=None if m.sigma is None else m.sigma[:, chosen],
        channels=tuple(m.channels[c] for c in chosen),
    )


def _interpolated(
    fitted: FitResult, at: np.ndarray, wanted: np.ndarray
) -> dict[str, np.ndarray]:
    order = np.argsort(at)
    return {
        name: np.interp(wanted, at[order], v[order]) if np.size(v) == at.size else v
        for name, v in fitted.values.items()
    }


def _error(
    measurement: Measurement,
    result: FitResult,
    values: dict[str, np.ndarray],
    options: FitOptions,
) -> float:
    """The objective of the fit over all rows, with other values of the parameters."""
    model = Model(result.model)
    rows = select_rows(measurement, options.max_theta_deg, model.ways)
    predicted = np.broadcast_to(
        predict_geometry(model, values, rows.geometry), rows.value.shape
    )
    objective = result.settings.objective
    if objective == "chi2":
        rows = with_noise_of(rows, predicted)
    return objective_error(judge.scores(rows, predicted, options), objective)
