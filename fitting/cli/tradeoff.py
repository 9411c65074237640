"""``brdf tradeoff``: speed against accuracy, measured for several models of one file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from fitting.cli import failures
from fitting.cli.fit_choices import ObjectiveChoice
from fitting.cli.flags import Flags, Format, Json, Reader

if TYPE_CHECKING:
    from rich.console import Console

    from data_formats import Measurement
    from fitting.tradeoff.study import Plan
    from fitting.tradeoff.table import Tradeoff

_WHAT = Group("What is measured", sort_key=1)
_AXES = Group("By what candidates are ranked", sort_key=2)
_FILES = Group("Files", sort_key=3)
_FIGURES = (".png", ".svg", ".pdf")
_REPEATS, _QUICK_REPEATS = 9, 3


def tradeoff(
    *files: Annotated[
        Path,
        Parameter(
            name="FILE",
            negative="",
            help="A file of measured reflectance or transmittance, or several of one "
            "sample. Without: the bundled sample.",
        ),
    ],
    model: Annotated[
        list[str] | None,
        Parameter(
            name=("--model", "-m"), negative="", group=_WHAT,
            help="A candidate, such as 'lambert + ggx'. Repeatable. Without: a ladder of "
            "models from cheap to dear.",
        ),
    ] = None,
    inside: Annotated[
        str | None,
        Parameter(
            negative="", group=_WHAT,
            help="The model inside which tolerance, starts, precision, sampling, "
            "quadrature and formulas are varied, or none. Without: the best candidate.",
        ),
    ] = None,
    scene: Annotated[
        str,
        Parameter(
            negative="", group=_WHAT,
            help="The scene of the image whose colours are compared, or none.",
        ),
    ] = "studio",
    objective: Annotated[
        ObjectiveChoice, Parameter(group=_WHAT, help="Residual, as of `brdf fit`.")
    ] = "auto",
    max_theta: Annotated[
        float,
        Parameter(group=_WHAT, help="Leave out rows beyond this polar angle, in deg."),
    ] = 85.0,
    quick: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, group=_WHAT,
            help="Three repeats of every time instead of nine, and the inside of a model "
            "only if --inside names one.",
        ),
    ] = False,
    cost: Annotated[
        Literal["operations", "float32", "float64", "fit", "parameters"],
        Parameter(
            group=_AXES,
            help="Counted operations or measured ns of an evaluation, seconds of a fit, or "
            "parameters.",
        ),
    ] = "operations",
    error: Annotated[
        Literal["held-out", "fitted", "albedo", "image"] | None,
        Parameter(
            group=_AXES, show_default=False,
            help="On angles of incidence that were not fitted (the default), on the rows "
            "that were, of the albedo, or of the image.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"), group=_FILES, help="Write everything there as JSON."
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        Parameter(
            group=_FILES,
            help="Draw error against cost with the front and the noise of the data: a "
            ".png, .svg or .pdf.",
        ),
    ] = None,
    json: Json = False,
    format: Format = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:  # fmt: skip
    """Measure what models cost to evaluate and to fit, and how far off they are.

    Marks the candidates that no other beats in both, says what the next better one costs,
    and what inside the best model can be had cheaper. Ctrl-C keeps what is finished.
    """
    flags = flags or Flags()
    _check(figure, output, max_theta)
    from fitting.cli import assignments, jax_setup, reading, terminal

    paths = files or (_sample(),)
    options = assignments.of_lines("reader", reader or [])
    measurement = reading.read_files(paths, format, options)
    say = terminal.stderr()
    quiet = flags.quiet or json
    if not quiet:
        if not files:
            say.print("no FILE given: using the bundled sample, which is synthetic")
        say.print(reading.headline(measurement, *paths), style="dim")
    jax_setup.set_up()
    from fitting.options import FitOptions
    from fitting.tradeoff.study import Plan, ladder

    plan = Plan(
        models=tuple(model) if model else ladder(measurement),
        inside=None if inside == "none" else inside,
        vary=inside != "none" and not (quick and inside is None),
        options=FitOptions(objective=objective, max_theta_deg=max_theta),
        scene=None if scene == "none" else scene,
        cost_axis=cost,
        error_axis=error,
        repeats=_QUICK_REPEATS if quick else _REPEATS,
    )
    table, interrupted = _run(measurement, plan, say, quiet)
    if table is None:
        say.print("brdf: interrupted before the first candidate was finished")
        return failures.INTERRUPTED
    return _answer(table, interrupted, output, figure, json, flags)


def _answer(
    table: Tradeoff,
    interrupted: bool,
    output: Path | None,
    figure: Path | None,
    json: bool,
    flags: Flags,
) -> int:
    """Print and write what is finished; the exit code."""
    import msgspec

    from fitting.cli import terminal

    table = msgspec.structs.replace(table, interrupted=interrupted)
    if output is not None:
        table.save(output)
    if figure is not None:
        _draw(table, figure)
    if json:
        sys.stdout.write(table.to_json() + "\n")
    else:
        from fitting.cli import tradeoff_report

        out = terminal.stdout()
        tradeoff_report.show(out, table, flags)
        for path in (output, figure):
            if path is not None and not flags.quiet:
                out.print(f"\nwritten to {path}")
    if interrupted:
        terminal.stderr().print("brdf: interrupted; this is what was finished")
        return failures.INTERRUPTED
    good = all(c.converged for c in table.candidates)
    return failures.GOOD if good else failures.NOT_CONVERGED


def _run(
    measurement: Measurement, plan: Plan, say: Console, quiet: bool
) -> tuple[Tradeoff | None, bool]:
    """The table as far as it came, and whether it was interrupted."""
    from fitting.cli.work import Work
    from fitting.tradeoff.study import study, units

    latest: Tradeoff | None = None
    done = 0.0
    try:
        with Work(say, round(units(plan)), quiet=quiet) as work:

            def tell(what: str, more: float) -> None:
                nonlocal done
                done += more
                work.at(what, round(done), 0)

            for table in study(measurement, plan, say=tell):
                latest = table
    except KeyboardInterrupt:
        return latest, True
    return latest, False


def _check(figure: Path | None, output: Path | None, max_theta: float) -> None:
    """Before the work and not after it: can everything be drawn and written?"""
    import importlib.util

    if not 0 < max_theta <= 90:
        raise failures.UsageError(f"--max-theta {max_theta:g}: expected 0 to 90 degrees")
    for option, path in (("--figure", figure), ("-o", output)):
        if path is not None and not path.parent.is_dir():
            raise failures.UsageError(
                f"{option} {path}: the folder {path.parent} does not exist"
            )
        if path is not None and path.is_dir():
            raise failures.UsageError(
                f"{option} {path}: is a folder; give the name of a file"
            )
    if figure is None:
        return
    if figure.suffix.lower() not in _FIGURES:
        raise failures.UsageError(
            f"--figure {figure}: expected a name that ends in {', '.join(_FIGURES)}"
        )
    if importlib.util.find_spec("matplotlib") is None:
        raise failures.UsageError(
            f"--figure {figure}: figures need matplotlib; pip install 'brdf-fitting[plots]'"
        )


def _draw(table: Tradeoff, path: Path) -> None:
    from fitting.plots import save, tradeoff

    save(tradeoff.draw(table), path)


def _sample() -> Path:
    from fitting.sample import sample_path

    return sample_path()
