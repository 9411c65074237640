"""What it costs to fit a model: seconds, steps, memory."""

from __future__ import annotations

import time

import jax
import jax.numpy as jnp
import msgspec

from data_formats import Measurement
from fitting.fitter import fit
from fitting.given import with_given
from fitting.model import Model
from fitting.options import FitOptions
from fitting.problem import prepare
from fitting.reduced import Problem
from fitting.result import FitResult
from fitting.rows import Rows, select_rows
from fitting.solve import refine
from fitting.tradeoff.timing import Spread, timed
from fitting.unseen import without_unseen

MEMORY = "temporary memory of the compiled solver besides the data, by XLA's own analysis"


class FitCost(msgspec.Struct, frozen=True):
    """What one fit costs on this machine.

    ``seconds`` is of a whole fit, warm: the search from all starts, the uncertainties and
    the checks of energy, without cross-validation. ``compile_seconds`` is what the first
    fit took longer: tracing and compiling, or loading what an earlier run compiled.
    ``memory_bytes`` is `MEMORY`; null where XLA does not say. ``steps`` of the solver and
    ``starts`` do not depend on the machine.
    """

    seconds: Spread
    compile_seconds: float
    memory_bytes: int | None
    steps: int
    starts: int


def fit_and_cost(
    measurement: Measurement, model: str, options: FitOptions, *, repeats: int = 5
) -> tuple[FitResult, FitCost]:
    """Fit a model, with cross-validation, and measure what fitting it costs.

    Raises what `fitting.fit` raises.
    """
    begin = time.perf_counter()
    fit(measurement, model, options, cross_validate=False)
    first = time.perf_counter() - begin
    seconds = timed(
        lambda: fit(measurement, model, options, cross_validate=False),
        repeats,
        budget_seconds=2.0 * repeats,
    )
    result = fit(measurement, model, options)
    cost = FitCost(
        seconds=seconds,
        compile_seconds=max(first - seconds.median, 0.0),
        memory_bytes=solver_memory(measurement, model, options),
        steps=result.solver.steps,
        starts=result.solver.starts,
    )
    return result, cost


def problem_of(
    measurement: Measurement, model: str, options: FitOptions
) -> tuple[Rows, Problem, FitOptions]:
    """What `fitting.fit` hands to the solver first; call with x64 enabled."""
    own = Model(model)
    options = with_given(measurement, own, options)
    rows = select_rows(measurement, options.max_theta_deg, own.ways)
    options, _ = without_unseen(rows, own, options)
    return rows, prepare(rows, own, options), options


def solver_memory(measurement: Measurement, model: str, options: FitOptions) -> int | None:
    """Bytes that the compiled solver needs besides its arguments, or None."""
    with jax.enable_x64(True):
        _, problem, _ = problem_of(measurement, model, options)
        k, m = problem.unknowns.n_shape, problem.unknowns.n_coefficients
        x = jnp.zeros((problem.target.shape[0], m))
        lowered = refine.lower(problem, jnp.zeros(k), x)
        analysis = lowered.compile().memory_analysis()
    return None if analysis is None else int(analysis.temp_size_in_bytes)
