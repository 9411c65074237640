"""``brdf reflectance``: reflectances, transmittances and colours of a fit or a file."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from fitting.cli.flags import Flags, Format, Json, Reader

Source = Annotated[
    Path,
    Parameter(help="A result of `brdf fit`, NAME.fit.json, or a file of measurements."),
]


def reflectance(
    source: Source,
    /,
    *,
    geometry: Annotated[
        list[str] | None,
        Parameter(
            name=("--geometry", "-g"),
            negative="",
            help="45/0, 0/45, 45a/0, d/8, 8/d, d/8 SCE, 8/d SCE, white-sky, black-sky; "
            "with a T before it the transmittance, as in 'T 0/d'. Repeatable.",
        ),
    ] = None,
    cone: Annotated[
        list[str] | None,
        Parameter(
            negative="",
            help="INCIDENT,COLLECTED: two beams of your own, each THETA, THETA:PHI, "
            "THETA:PHI:HALF_ANGLE (degrees) or d. Repeatable.",
        ),
    ] = None,
    illuminant: Annotated[str, Parameter(help="Of the colour: D65, A, D50, ...")] = "D65",
    observer: Annotated[
        str, Parameter(help="Of the colour: 2 or 10 (degrees), or its name.")
    ] = "2",
    transmitted: Annotated[
        bool, Parameter(negative="", show_default=False, help="Collect behind the sample.")
    ] = False,
    side: Annotated[
        Literal["front", "back"], Parameter(name="--from", help="Where the light is.")
    ] = "front",
    theta: Annotated[
        float | None, Parameter(help="Angle of black-sky, in degrees from the normal.")
    ] = None,
    trap: Annotated[
        float, Parameter(help="Half angle of the gloss trap of SCE, in degrees.")
    ] = 8.0,
    tolerance: Annotated[
        float, Parameter(help="Of the quadrature, relative to the largest channel.")
    ] = 1e-5,
    reference: Annotated[
        Path | None, Parameter(help="Another result, for colour differences from it.")
    ] = None,
    json: Json = False,
    format: Format = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:
    """Reflectances, transmittances and colours of a fit or of a file."""
    flags = flags or Flags()
    from fitting.cli import assignments, jax_setup, reading, reflectance_run
    from fitting.cli.failures import UsageError

    asked = reflectance_run.Asked(
        tuple(geometry or ()), tuple(cone or ()), illuminant, observer, transmitted, side,
        theta, trap, tolerance,
    )  # fmt: skip
    options = assignments.of_lines("reader", reader or [])
    is_result = source.name.endswith(reading.RESULT_SUFFIX)
    if reference is not None and not reference.name.endswith(reading.RESULT_SUFFIX):
        raise UsageError(f"--reference {reference}: expected a result, NAME.fit.json")
    measurement = None if is_result else reading.read_file(source, format, options)
    jax_setup.set_up()
    if measurement is None:
        report = reflectance_run.of_result(source, asked, reference, flags)
    else:
        if reference is not None:
            raise UsageError("--reference: only a result has a colour difference from one")
        report = reflectance_run.of_file(source, measurement, asked)
    if json:
        import msgspec

        plain = msgspec.to_builtins(report)
        sys.stdout.write(json_module.dumps(plain, indent=1, allow_nan=False) + "\n")
        return 0
    from fitting.cli import reflectance_report
    from fitting.cli.terminal import stdout

    reflectance_report.show(stdout(), report, flags)
    return 0
