"""``brdf convert``: the same measurement in another format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags, Reader

if TYPE_CHECKING:
    from data_formats import Measurement


def convert(
    source: Annotated[
        Path,
        Parameter(help="A file of measurements, or NAME.fit.json for values of its model."),
    ],
    target: Annotated[Path, Parameter(help="The file to write.")],
    /,
    *,
    to: Annotated[
        str | None,
        Parameter(help="Format to write; without: by the target's suffix."),
    ] = None,
    force: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, help="Overwrite the target if it exists."
        ),
    ] = False,
    format: Annotated[
        str | None, Parameter(help="Format of the source, if it is not recognised.")
    ] = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:
    """Write measurements in another format."""
    import data_formats
    from fitting.cli import assignments, reading, terminal

    name = _format_to_write(target, to)
    if target.exists() and not force:
        raise UsageError(f"{target}: exists; overwrite it with --force")
    if not target.parent.is_dir():
        raise UsageError(f"{target}: the folder {target.parent} does not exist")
    options = assignments.of_lines("reader", reader or [])
    measurement = reading.read_file(source, format, options)
    data_formats.write(measurement, target, format=name)
    again = data_formats.read(target, format=name)
    out = terminal.stdout()
    out.print(f"{reading.headline(measurement, source)}\nwritten to {target} as {name}")
    if not (flags or Flags()).quiet:
        for text in losses(measurement, again) or ["the file holds everything"]:
            terminal.bullet(out, text)
    return 0


def losses(before: Measurement, after: Measurement) -> list[str]:
    """What a file does not hold of a measurement, found by reading it again."""
    import numpy as np

    out: list[str] = []
    if before.n_rows != after.n_rows or before.n_channels != after.n_channels:
        return [
            f"the file has {after.n_rows} rows by {after.n_channels} channels of "
            f"{before.n_rows} by {before.n_channels}"
        ]
    if before.channels != after.channels:
        out.append("names or wavelengths of the channels are not kept")
    if before.symmetry != after.symmetry:
        out.append(f"the symmetry is {after.symmetry} instead of {before.symmetry}")
    if before.sigma is not None and after.sigma is None:
        out.append("standard uncertainties are not kept")
    if missing := sorted(before.auxiliary.keys() - after.auxiliary.keys()):
        out.append(f"further columns are not kept: {', '.join(missing)}")
    if not np.array_equal(before.valid, after.valid):
        changed = int(np.count_nonzero(before.valid != after.valid))
        out.append(f"whether a value is valid is not kept for {changed} values")
    angles = ("theta_i", "phi_i", "theta_r", "phi_r")
    turned = max(
        float(np.max(np.abs(getattr(before, a) - getattr(after, a)), initial=0.0))
        for a in angles
    )
    if turned > 0:
        out.append(f"angles change by up to {np.degrees(turned):.2g} deg")
    both = before.valid & after.valid
    change = np.abs(before.value - after.value)[both] / np.maximum(
        np.abs(before.value[both]), 1e-300
    )
    if change.size and change.max() > 0:
        out.append(f"values change by up to {change.max():.2g} of themselves")
    if not out and not before.equals(after):
        out.append("masked values are not kept")
    return out


def _format_to_write(target: Path, to: str | None) -> str:
    import data_formats

    known = [f for f in data_formats.formats() if f.can_write]
    listed = ", ".join(f"{f.name} ({', '.join(f.suffixes)})" for f in known)
    if to is not None:
        if to not in [f.name for f in known]:
            raise UsageError(f"--to {to}: cannot be written; the formats are {listed}")
        return to
    name = target.name.lower().removesuffix(".gz")
    for f in known:
        if name.endswith(f.suffixes):
            return f.name
    raise UsageError(
        f"{target}: no format that can be written has this suffix; choose one with --to or "
        f"by the suffix: {listed}"
    )
