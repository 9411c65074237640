"""Inside a fit: the solver's tolerance, and how many starts it is run from."""

from __future__ import annotations

import math
import time

import jax
import jax.numpy as jnp
import numpy as np

from data_formats import Measurement
from fitting import judge, starts
from fitting.options import FitOptions
from fitting.reduced import Problem
from fitting.result import FitResult
from fitting.rows import Rows
from fitting.search import predicted_by
from fitting.solve import Solution, refine
from fitting.summary import Found
from fitting.tradeoff.fit_cost import problem_of
from fitting.tradeoff.timing import Spread, spread, timed
from fitting.tradeoff.trade import NotPossible, Setting, Trade, trades

TOLERANCES = (1e-13, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2)
STARTS = (16, 8, 4, 2, 1)


def tolerance_trades(
    measurement: Measurement, result: FitResult, options: FitOptions, *, repeats: int
) -> list[Trade]:
    """The relative tolerance of the cost at which the solver stops, from the same start.

    The start is the best point of the scan, which is where a search begins, before there
    are penalties; the error is the objective over all rows.
    """
    with jax.enable_x64(True):
        rows, problem, options = problem_of(measurement, result.model, options)
        points, coefficients = starts.best_starts(problem, 1)
        begin = jnp.asarray(points[0]), jnp.asarray(coefficients[0])
        settings: list[Setting] = []
        for tolerance in TOLERANCES:
            rtol = jnp.asarray(tolerance)

            def run(rtol=rtol) -> Solution:
                return jax.block_until_ready(refine(problem, *begin, rtol))

            end = run()
            error = _error(problem, end, rows, result.settings.objective, options)
            seconds = timed(run, repeats, budget_seconds=repeats)
            settings.append(Setting(f"{tolerance:g}", seconds, float(end.steps), error))
    return trades(
        "solver tolerance",
        settings,
        cost_of="one start",
        work_unit="steps",
        error_of=f"{result.settings.objective}, all rows",
        deviation=False,
    )


def start_trades(
    measurement: Measurement, result: FitResult, options: FitOptions, *, repeats: int
) -> list[Trade]:
    """How many of the best points of the scan are refined, of which the best end is kept.

    The best of a few starts are the first of many, so that the sixteen runs, each timed on
    its own, tell about all smaller numbers. Raises `NotPossible` where there is only one.
    """
    with jax.enable_x64(True):
        rows, problem, options = problem_of(measurement, result.model, options)
        points, coefficients = starts.best_starts(problem, STARTS[0])
        if len(points) < 2:
            raise NotPossible("the scan of the shape leaves a single start")
        ends: list[Solution] = []
        seconds: list[list[float]] = []
        for u, x in zip(points, coefficients, strict=True):
            begin = jnp.asarray(u), jnp.asarray(x)
            ends.append(jax.block_until_ready(refine(problem, *begin)))
            seconds.append(_each(problem, begin, min(repeats, 5)))
        scan = timed(lambda: starts.best_starts(problem, 1), min(repeats, 5))
        settings: list[Setting] = []
        # Fewer distinct points may have been found than were asked for.
        for count in sorted({min(n, len(ends)) for n in STARTS}, reverse=True):
            best = min(ends[:count], key=lambda e: _finite(float(e.cost)))
            settings.append(
                Setting(
                    str(count),
                    _whole(scan, seconds[:count]),
                    float(sum(int(e.steps) for e in ends[:count])),
                    _error(problem, best, rows, result.settings.objective, options),
                )
            )
    return trades(
        "starts",
        settings,
        cost_of="scan and starts",
        work_unit="steps",
        error_of=f"{result.settings.objective}, all rows",
        deviation=False,
    )


def _each(
    problem: Problem, begin: tuple[jax.Array, jax.Array], repeats: int
) -> list[float]:
    found: list[float] = []
    for _ in range(repeats):
        clock = time.perf_counter()
        jax.block_until_ready(refine(problem, *begin))
        found.append(time.perf_counter() - clock)
    return found


def _whole(scan: Spread, seconds: list[list[float]]) -> Spread:
    """Scan and starts together, repeat by repeat."""
    return spread([scan.median + sum(each) for each in zip(*seconds, strict=True)])


def _finite(cost: float) -> float:
    return cost if math.isfinite(cost) else math.inf


def _error(
    problem: Problem, end: Solution, rows: Rows, objective: str, options: FitOptions
) -> float:
    """RMS of the objective over all valid rows."""
    found = [Found(problem, jax.device_get(end), ())]
    r = judge.residuals(rows, predicted_by(found, rows), objective, options)
    return float(np.sqrt(np.sum(r**2) / max(int(rows.valid.sum()), 1)))
