"""``brdf stress``: what the lobes promise, put to the test."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from fitting.cli import failures
from fitting.cli.flags import Flags, Json

if TYPE_CHECKING:
    from rich.console import Console

    from fitting.stress import Precision, Report, Variant

POINTS_OF_ONE = 20_000
POINTS_OF_ALL = 2_000
# What contracts and the fit take, in evaluations of a formula in 50 digits.
_CONTRACTS, _FIT = 12_000, 16_000


def stress(
    model: Annotated[
        str | None,
        Parameter(help="A lobe, 'ggx', 'ggx(aniso)' or my_lobe.py. Without: all lobes."),
    ] = None,
    /,
    *,
    options: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, help="Also with every option of the lobe."
        ),
    ] = False,
    points: Annotated[
        int | None,
        Parameter(help="Points per precision: 20000 for one lobe, 2000 each for all."),
    ] = None,
    precision: Literal["f32", "f64", "both"] = "both",
    json: Json = False,
    flags: Flags | None = None,
) -> int:
    """Put lobes to the test: their contracts, and rounding errors against 50 digits.

    Exit code 1 if a contract fails.
    """
    flags = flags or Flags()
    if points is not None and points < 1:
        raise failures.UsageError(f"--points {points}: expected a number from 1 on")
    from fitting.cli import jax_setup, terminal

    jax_setup.set_up()
    chosen = _variants(model, options)
    count = points or (POINTS_OF_ONE if model is not None else POINTS_OF_ALL)
    quiet = flags.quiet or json
    say = terminal.stderr()
    if not quiet:
        note = "; of one lobe 20000" if model is None and points is None else ""
        say.print(f"{len(chosen)} to do, {count} points per precision{note}", style="dim")
    reports, interrupted = _run(chosen, count, _precisions(precision), say, quiet)
    if json:
        sys.stdout.write(_as_json(reports) + "\n")
    else:
        _show(terminal.stdout(), reports, flags)
    if interrupted:
        say.print(f"interrupted after {len(reports)} of {len(chosen)}")
        return failures.INTERRUPTED
    good = all(r.passed for r in reports)
    return failures.GOOD if good else failures.NOT_CONVERGED


def _variants(model: str | None, options: bool) -> list[Variant]:
    from fitting.stress import variants

    if model is None:
        return variants.registered()
    one = variants.of_expression(model)
    if not options:
        return [one]
    if "(" in one.name:
        raise failures.UsageError(f"--options with {model!r}: give the lobe without any")
    return variants.of_name(one.name)


def _precisions(chosen: str) -> tuple[str, ...]:
    return ("f32", "f64") if chosen == "both" else (chosen,)


def _run(
    chosen: list[Variant],
    count: int,
    precisions: tuple[str, ...],
    say: Console,
    quiet: bool,
) -> tuple[list[Report], bool]:
    """Reports of what was finished, and whether that is not all."""
    import os

    from fitting.cli.work import Work
    from fitting.stress import examine

    each = _CONTRACTS + _FIT + count * len(precisions)
    reports: list[Report] = []
    try:
        with Work(say, each * len(chosen), quiet=quiet) as work:
            for variant in chosen:

                def tell(what: str, points: int, variant: Variant = variant) -> None:
                    before = _CONTRACTS if what.startswith("rounding") else 0
                    work.at(f"{variant}: {what}", each * len(reports) + before, points)

                tell("contracts", 0)
                reports.append(
                    examine(
                        variant,
                        count,
                        precisions=precisions,
                        workers=os.cpu_count() or 1,
                        progress=tell,
                    )
                )
    except KeyboardInterrupt:
        return reports, True
    return reports, False


def _show(out: Console, reports: list[Report], flags: Flags) -> None:
    from fitting.cli import terminal

    heads = ("f32 max", "99.9 %", "f64 max", "99.9 %", "worst point")
    rows = terminal.table("lobe", "contracts", *heads, left=2)
    rows.columns[-1].justify = "left"
    for r in reports:
        found = [r.precision(p) for p in ("f32", "f64")]
        rows.add_row(
            r.variant,
            _in_words(r),
            *(text for p in found for text in _errors(p)),
            _worst(found),
            style="" if r.passed else "red",
        )
    out.print(rows)
    if flags.quiet:
        return
    for r in reports:
        for f in r.findings if flags.verbose else r.failed:
            terminal.bullet(out, f"{r.variant}: {f}", "" if f.passed else "red")
    out.print(
        "\nmax, 99.9 %: error in units in the last place against 50 digits, where one such "
        "unit of the input moves the value by no more than 16.",
        style="dim",
    )


def _in_words(report: Report) -> str:
    if report.passed:
        return f"all {len(report.findings)} kept"
    names = ", ".join(f.name for f in report.failed)
    return f"{len(report.failed)} of {len(report.findings)} fail: {names}"


def _errors(found: Precision | None) -> tuple[str, str]:
    if found is None:
        return "-", "-"
    return f"{found.maximum:.3g}", f"{found.percentile:.3g}"


def _worst(found: list[Precision | None]) -> str:
    known = [p for p in found if p is not None]
    if not known:
        return "-"
    worst = max(known, key=lambda p: p.maximum)
    return f"{worst.worst} ({worst.precision})"


def _as_json(reports: list[Report]) -> str:
    import dataclasses
    import json

    def plain(value: object) -> object:
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items()}
        if isinstance(value, list | tuple):
            return [plain(v) for v in value]
        if isinstance(value, float) and not math.isfinite(value):
            return None
        return value

    found = [plain({**dataclasses.asdict(r), "passed": r.passed}) for r in reports]
    return json.dumps(found, indent=1, allow_nan=False)
