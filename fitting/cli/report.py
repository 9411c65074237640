"""``brdf report``: a fit result as one HTML file."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import DataFormat, Flags, Json, Reader


def report(
    *results: Annotated[
        Path,
        Parameter(
            name="RESULT",
            negative="",
            help="Results of `brdf fit`, NAME.fit.json. The first is told in full, and "
            "compared with the others.",
        ),
    ],
    data: Annotated[
        list[Path] | None,
        Parameter(
            negative="",
            help="The measurement of the first result, if it is not where it was for the "
            "fit. Repeatable: files of one sample are joined.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"),
            help="Where the report goes. Without: NAME.report.html in the current folder.",
        ),
    ] = None,
    viewer: Annotated[
        bool, Parameter(help="The surface in three dimensions, to be turned.")
    ] = True,
    json: Json = False,
    data_format: DataFormat = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:
    """A fit result as one HTML file that works offline, with figures and a verdict."""
    flags = flags or Flags()
    if not results:
        raise UsageError("report: expected a result of `brdf fit`, NAME.fit.json")
    from fitting.report import ReportMissing, require

    try:
        require()
    except ReportMissing as error:
        raise UsageError(str(error)) from error
    from fitting.cli import assignments, jax_setup, report_run

    asked = report_run.Asked(
        results, tuple(data or ()), output, viewer, data_format,
        assignments.of_lines("reader", reader or []),
    )  # fmt: skip
    report_run.check(asked)
    fitted = report_run.load(asked)
    jax_setup.set_up()
    done = report_run.run(fitted, asked, flags)
    if json:
        import msgspec

        plain = msgspec.to_builtins(done)
        sys.stdout.write(json_module.dumps(plain, indent=1) + "\n")
        return 0
    print(done.path)
    return 0
