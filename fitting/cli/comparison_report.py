"""Several models side by side."""

from __future__ import annotations

from rich.console import Console

from fitting.cli.terminal import heading, table
from fitting.comparison import Comparison, n_free, objective_error
from fitting.quantities import degrees, number
from fitting.result import FitResult

_MOST_COLUMNS = 5


def show(out: Console, done: Comparison) -> None:
    """One line per model, held-out errors by angle of incidence, and the choice."""
    objective = done.results[0].settings.objective
    out.print(heading(f"Models compared ({objective})"))
    rows = table("", "model", "parameters", "error", "held-out", "albedo", "", left=2)
    rows.columns[-1].justify = "left"
    for k, r in enumerate(done.results):
        rows.add_row(
            "*" if k == done.best else "",
            r.model,
            str(n_free(r)),
            number(objective_error(r), 3),
            _held_out(r),
            f"{r.energy.max_albedo:.2f}",
            "" if r.solver.converged else "did not converge",
            style="bold" if k == done.best else "",
        )
    out.print(rows)
    _by_angle(out, done)
    out.print("\nheld-out: typical RMS at an angle of incidence that was not fitted")
    out.print(f"* kept: {done.reason}")


def _held_out(result: FitResult) -> str:
    validation = result.cross_validation
    if validation is None:
        return "-"
    return number(validation.typical, 3)


def _by_angle(out: Console, done: Comparison) -> None:
    validations = [r.cross_validation for r in done.results]
    known = [v for v in validations if v is not None]
    if len(known) < len(validations):
        return
    for first in range(0, len(known), _MOST_COLUMNS):
        part = known[first : first + _MOST_COLUMNS]
        names = [r.model for r in done.results[first : first + _MOST_COLUMNS]]
        rows = table("held-out at theta_i", *names)
        for line in zip(*(v.by_angle for v in part), strict=True):
            rows.add_row(
                f"{degrees(line[0].theta_i_deg)} deg",
                *(number(e.objective, 3) for e in line),
            )
        out.print()
        out.print(rows)
