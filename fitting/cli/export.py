"""``brdf export``: a fit for a renderer, an optical design program, or as a table."""

from __future__ import annotations

import json as json_module
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags, Json

if TYPE_CHECKING:
    from fitting.export import Report

_TABLES = Group("Tables and trees", sort_key=80)
Angles = Annotated[
    str | None,
    Parameter(
        group=_TABLES,
        help="Of csv, hdf5, astm (theta-i also of zemax), in degrees: START:END:STEP or "
        "angles with commas.",
    ),
]


def export(
    source: Annotated[
        Path | None,
        Parameter(help="A result of `brdf fit`, NAME.fit.json; without: list the targets."),
    ] = None,
    /,
    *,
    to: Annotated[str | None, Parameter(help="Target; `brdf export` lists them.")] = None,
    output: Annotated[
        Path | None,
        Parameter(name=("--output", "-o"), help="The file; without: NAME and a suffix."),
    ] = None,
    representation: Annotated[
        str | None,
        Parameter(
            name="--as",
            help="Of the target's own models this one instead of the closest, such as "
            "principled of mitsuba.",
        ),
    ] = None,
    spectral: Annotated[
        bool,
        Parameter(
            negative="", show_default=False,
            help="Every wavelength instead of linear sRGB (mitsuba, pbrt).",
        ),
    ] = False,
    channels: Annotated[
        str | None,
        Parameter(
            help="Channels of the fit: three with commas for R, G and B, or one for a "
            "target that holds one."
        ),
    ] = None,
    illuminant: Annotated[
        str, Parameter(help="Of the colour of spectra: D65, A, D50, ...")
    ] = "D65",
    theta_i: Angles = None,
    theta_r: Angles = None,
    phi_r: Angles = None,
    level: Annotated[
        int | None,
        Parameter(group=_TABLES, help="Of radiance: 2^LEVEL cells a side of the tree."),
    ] = None,
    force: Annotated[
        bool,
        Parameter(negative="", show_default=False, help="Overwrite the file if it exists."),
    ] = False,
    json: Json = False,
    flags: Flags | None = None,
) -> int:  # fmt: skip
    """Write a fit for a renderer, an optical design program, or as a table."""
    flags = flags or Flags()
    from fitting.export import registry
    from fitting.export.registry import targets

    if source is None:
        if to is not None or output is not None:
            raise UsageError(
                "brdf export: which result? for instance `brdf export paint.fit.json --to "
                f"{to or 'mitsuba'}`"
            )
        _list(json)
        return 0
    known = {t.name: t for t in targets()}
    if to is None:
        raise UsageError(f"--to is missing; the targets are {', '.join(known)}")
    if to not in known:
        from fitting.cli.assignments import nearest

        raise UsageError(f"--to {to}: there is no such target{nearest(to, list(known))}")
    angles = {
        name: _angles(name, text)
        for name, text in (("theta_i", theta_i), ("theta_r", theta_r), ("phi_r", phi_r))
    }
    target = output or _named_after(source, known[to].suffixes[0])
    if target.exists() and not force:
        raise UsageError(f"{target}: exists; overwrite it with --force")
    if not target.parent.is_dir():
        raise UsageError(f"{target}: the folder {target.parent} does not exist")

    from fitting.cli import jax_setup
    from fitting.result import load_result

    fitted = load_result(source)
    registry.load(to)
    jax_setup.set_up()
    from fitting.cli.saying import Saying
    from fitting.export import Request
    from fitting.export import export as write

    request = Request(
        representation=representation,
        spectral=spectral,
        channels=tuple(c.strip() for c in channels.split(",")) if channels else (),
        illuminant=illuminant,
        level=level,
        **angles,
    )
    with Saying(quiet=flags.quiet or json, verbose=flags.verbose) as say:
        report = write(fitted, to, target, request=request, progress=say)
    if json:
        import msgspec

        plain = msgspec.to_builtins(report)
        sys.stdout.write(json_module.dumps(plain, indent=1, allow_nan=False) + "\n")
        return 0
    _show(report, flags)
    return 0


def _list(json: bool) -> None:
    from fitting.cli.terminal import stdout, table
    from fitting.export.registry import targets

    if json:
        plain = [
            {"name": t.name, "suffixes": t.suffixes, "description": t.description}
            for t in targets()
        ]
        sys.stdout.write(json_module.dumps(plain, indent=1) + "\n")
        return
    out = stdout()
    rows = table("--to", "file", "what is written", left=3)
    for t in targets():
        rows.add_row(t.name, ", ".join(t.suffixes), t.description.replace("`", ""))
    out.print(rows)
    out.print("\nbrdf export paint.fit.json --to mitsuba -o paint.xml", style="dim")


def _show(report: Report, flags: Flags) -> None:
    from fitting.cli.terminal import bullet, stdout

    out = stdout()
    out.print(f"{report.model} written to {report.file} for {report.target}")
    if flags.quiet:
        return
    out.print(f"there it is {report.represented_by}")
    if report.residual is not None:
        out.print(f"distance from the fit: {report.residual}")
    for text in (*report.conventions, *report.remarks):
        bullet(out, text)


def _named_after(source: Path, suffix: str) -> Path:
    """``paint.fit.json`` becomes ``paint`` and the suffix, in the working folder."""
    from fitting.cli.result_data import stem_of

    return Path(stem_of(source) + suffix)


def _angles(name: str, text: str | None) -> tuple[float, ...]:
    """Degrees of ``0:80:10`` and ``0,44,45,46``, or both with commas."""
    out: list[float] = []
    for part in text.split(",") if text else ():
        try:
            numbers = [float(n) for n in part.split(":")]
        except ValueError:
            numbers = []
        if len(numbers) == 1 and math.isfinite(numbers[0]):
            out.append(numbers[0])
            continue
        good = len(numbers) == 3 and all(map(math.isfinite, numbers)) and numbers[2] > 0
        count = int((numbers[1] - numbers[0]) / numbers[2] + 1e-9) + 1 if good else 0
        if not 0 < count <= 10_000:
            raise UsageError(
                f"--{name.replace('_', '-')} {text}: expected START:END:STEP or angles in "
                "degrees with commas"
            )
        out += [numbers[0] + k * numbers[2] for k in range(count)]
    limit = 360.0 if name == "phi_r" else 180.0
    if any(not -limit <= a <= limit or (name != "phi_r" and a < 0) for a in out):
        raise UsageError(
            f"--{name.replace('_', '-')} {text}: expected angles from "
            f"{'-360' if name == 'phi_r' else '0'} to {limit:g} degrees"
        )
    return tuple(out)
