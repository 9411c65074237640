"""``brdf plot``: figures of a fit result."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import Data, DataFormat, Flags, Json, Reader

if TYPE_CHECKING:
    from fitting.result import FitResult


def plot(
    result: Annotated[
        Path | None, Parameter(help="A result of `brdf fit`, NAME.fit.json.")
    ] = None,
    /,
    *figures: Annotated[
        str, Parameter(help="Which figures; without: all that apply. See --list.")
    ],
    data: Data = None,
    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"),
            help="A folder for NAME.FIGURE.png, or the file of one figure; a PDF may hold "
            "several. Without: the current folder.",
        ),
    ] = None,
    format: Annotated[
        Literal["png", "svg", "pdf"] | None,
        Parameter(help="Of the pictures; without: by the file's suffix, or png."),
    ] = None,
    channel: Annotated[
        list[str] | None,
        Parameter(
            negative="",
            help="Name of a channel to show where not all are. Repeatable; without: up to "
            "three over the spectrum.",
        ),
    ] = None,
    dpi: Annotated[
        float | None, Parameter(help="Pixels per inch of pixels; without: 200.")
    ] = None,
    list: Annotated[
        bool,
        Parameter(negative="", show_default=False, help="List the figures."),
    ] = False,
    json: Json = False,
    data_format: DataFormat = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:
    """Figures of a fit result: slices, lobes, residuals, albedo, spectra, ..."""
    flags = flags or Flags()
    if list:
        return _list(json)
    if result is None:
        raise UsageError("plot: expected a result of `brdf fit`, or --list")
    from fitting.plots import PlotsMissing, require

    try:
        require()
    except PlotsMissing as error:
        raise UsageError(str(error)) from error
    from fitting.cli import assignments, jax_setup, plot_run
    from fitting.result import load_result

    asked = plot_run.Asked(
        figures, tuple(data or ()), output, format, tuple(channel or ()), dpi, data_format,
        assignments.of_lines("reader", reader or []),
    )  # fmt: skip
    plot_run.check(asked, result)
    fitted: FitResult = load_result(result)
    jax_setup.set_up()
    done = plot_run.run(fitted, result, asked, flags)
    if json:
        import msgspec

        plain = msgspec.to_builtins(done)
        sys.stdout.write(json_module.dumps(plain, indent=1) + "\n")
        return 0
    for path in dict.fromkeys(d.path for d in done.written):
        print(path)
    return 0


def _list(json: bool) -> int:
    from fitting.cli.terminal import stdout, table
    from fitting.plots import listed

    if json:
        plain = [item._asdict() for item in listed()]
        sys.stdout.write(json_module.dumps(plain, indent=1) + "\n")
        return 0
    said = {"needed": "needs it", "shown": "shows it", "unused": "-"}
    out = table("figure", "shows", "measurement", left=3)
    for item in listed():
        out.add_row(item.name, item.shows, said[item.data])
    stdout().print(out)
    return 0
