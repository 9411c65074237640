"""``brdf score``: a result against a file, without fitting."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fitting.cli.flags import File, Flags, Format, Json, Reader


def score(
    file: File,
    result: Annotated[Path, Parameter(help="A result of `brdf fit`, NAME.fit.json.")],
    /,
    *,
    json: Json = False,
    format: Format = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:
    """Measure a fit result against a file, without fitting."""
    flags = flags or Flags()
    from fitting.cli import assignments, jax_setup, reading
    from fitting.result import load_result

    options = assignments.of_lines("reader", reader or [])
    fitted = load_result(result)
    measurement = reading.read_file(file, format, options)

    jax_setup.set_up()
    import msgspec

    from fitting.scoring import score as score_of

    found = score_of(measurement, fitted)
    if json:
        plain = msgspec.to_builtins(found)
        sys.stdout.write(json_module.dumps(plain, indent=1, allow_nan=False) + "\n")
        return 0
    from fitting.cli import error_report
    from fitting.cli.terminal import stdout
    from fitting.quantities import count, percent
    from fitting.verdict import typical_deviation

    out = stdout()
    same = measurement.provenance.sha256 == fitted.data.sha256
    out.print(
        f"{fitted.model} of {result.name} against {file.name}: "
        f"{count(found.rows_used, 'row')} used, typically "
        f"{percent(typical_deviation(fitted, measurement))} off (median); "
        + ("the file that it was fitted to" if same else "not the file it was fitted to")
    )
    if not flags.quiet:
        error_report.scores(out, found.scores, found.objective)
        error_report.angles(out, found.by_angle, (), found.objective)
        error_report.channels(out, found.by_channel, flags.verbose)
    return 0
