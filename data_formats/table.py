"""From named columns of numbers to a `Measurement`: what all table formats share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from data_formats.columns import Columns
from data_formats.directions import (
    Angles,
    in_radians,
    same_side,
    snap_to_edges,
    unfolded,
)
from data_formats.instrument_quirks import apply_quirks
from data_formats.measurement import Channel, Measurement, MeasurementError
from data_formats.metadata import Metadata, kept
from data_formats.provenance import Note, Provenance
from data_formats.quantity import Quantity, Reading, Side, is_factor, reading
from data_formats.survey import describe, in_wavelength_order


@dataclass(frozen=True)
class Table:
    """Numbers with the meaning of their columns, and what the file said about them.

    **Arguments:**

    - `numbers`: (n, columns).
    - `columns`: which column is what.
    - `provenance`: of the measurement.
    - `line_numbers`: (n,) for errors; `None` where the format has no lines.
    - `notes`: what the format's reader noticed.
    - `own`: what this program wrote into the file about it: nothing is guessed then.
    """

    numbers: NDArray[np.float64]
    columns: Columns
    provenance: Provenance
    line_numbers: Sequence[int] | None = None
    notes: tuple[Note, ...] = ()
    own: Metadata | None = None

    def where(self, row: int) -> str:
        """File and line of a row."""
        path = self.provenance.path
        if self.line_numbers is None:
            return f"{path}, record {row + 1}"
        return f"{path}, line {self.line_numbers[row]}"


def to_measurement(
    table: Table,
    *,
    degrees: bool | None = None,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Measurement:
    """Convert units and sides, mask what is no number, and say so in notes.

    **Arguments:**

    - `table`: what was read.
    - `degrees`: the unit of angles whose column does not state it; `None`: find out.
    - `quantity`, `side`: as for `quantity.reading`. Factors are divided by pi; where every
        row is transmitted light and none is on the other side as written, `theta_r` is
        read as `pi - theta_r`.

    **Raises:** `MeasurementError` with file and line if a direction is missing or out of
    range, if no value is valid, or if some rows only are on the other side although
    `side` or `quantity` says that all are transmitted light.
    """
    own = table.own
    columns, numbers = table.columns, table.numbers
    # A file written here says the sides and 1/sr by its numbers; only the user overrides.
    header = {} if own else table.provenance.header
    how = reading(header, [] if own else columns.labels, quantity=quantity, side=side)
    notes, changes = list(table.notes), list[Note]()
    path = table.provenance.path
    angles = in_radians(numbers, columns, path, table.where, degrees, notes)
    if own is None:
        angles = snap_to_edges(angles, table.where, notes)
    angles = _on_its_side(angles, how, path, changes)

    value = numbers[:, [c for _, c in columns.channels]]
    valid = np.isfinite(value)
    if missing := int(np.count_nonzero(~valid)):
        value = np.where(valid, value, np.nan)
        notes.append(
            Note(
                "not-finite-masked",
                f"values that are not finite: {missing}; masked",
                missing,
            )
        )
    if columns.valid:
        valid &= numbers[:, columns.valid] == 1
    sigma = numbers[:, columns.sigma] if columns.sigma else None
    channels = tuple(c for c, _ in columns.channels)
    if how.factor:
        value = value / np.pi
        sigma = None if sigma is None else sigma / np.pi
        channels = _renamed(channels, how)
    changes += _factor_notes(how)
    if not valid.any():
        raise MeasurementError(f"{path}: none of the {value.size} values is valid")

    measurement = Measurement(
        **angles,
        value=value,
        valid=valid,
        channels=channels,
        sigma=sigma,
        provenance=table.provenance,
        notes=(*notes, *changes),
        auxiliary={k: numbers[:, c] for k, c in columns.others.items()},
    )
    if own:
        return replace(
            measurement,
            symmetry=own.symmetry,
            provenance=kept(table.provenance, own.provenance),
            notes=(*own.notes, *changes),
        )
    return apply_quirks(describe(in_wavelength_order(measurement)))


def _on_its_side(angles: Angles, how: Reading, path: str, notes: list[Note]) -> Angles:
    """The angles with `theta_r` on the side where the light was measured."""
    same, other = same_side(angles)
    n_same, n_other = int(np.count_nonzero(same)), int(np.count_nonzero(other))
    if not n_same or not (how.transmitted or how.perhaps_transmitted):
        return angles
    if how.transmitted and not n_other:
        notes.append(
            Note(
                "folded-transmission",
                f"The values are of transmitted light ({how.transmitted}), but theta_r is "
                f"on the source's side in all {n_same} rows: read as 180 degrees - "
                "theta_r; side='as-written' keeps it",
                n_same,
            )
        )
        return unfolded(angles)
    if how.transmitted and how.asked:
        raise MeasurementError(
            f"{path}: {how.transmitted} says that all is transmitted light, but theta_r is "
            f"on the source's side in {n_same} rows and on the other in {n_other}; read "
            "the file without that option, or split it"
        )
    if how.transmitted or not n_other:
        notes.append(
            Note(
                "perhaps-folded",
                f"The file speaks of transmission "
                f"({how.transmitted or how.perhaps_transmitted}), but theta_r is on the "
                f"source's side in {n_same} rows: was it written folded? It was kept; "
                "side='transmitted' reads it as 180 degrees - theta_r",
                n_same,
            )
        )
    return angles


def _factor_notes(how: Reading) -> list[Note]:
    what, factor, plain = (
        ("transmittance", "btf", "btdf")
        if how.transmitted
        else ("reflectance", "brf", "brdf")
    )
    if how.factor:
        sentence = f"The values are {what} factors ({how.factor}): divided by pi"
        if not how.factor.startswith("quantity="):
            sentence += f"; quantity={plain!r} reads them as {plain.upper()} in 1/sr"
        return [Note("brf-divided-by-pi", sentence)]
    if how.perhaps_factor:
        sentence = (
            f"The file speaks of {how.perhaps_factor!r}: are the values {what} factors? "
            f"They were read as {plain.upper()} in 1/sr; quantity={factor!r} divides them "
            "by pi"
        )
        return [Note("perhaps-brf", sentence)]
    return []


def _renamed(channels: tuple[Channel, ...], how: Reading) -> tuple[Channel, ...]:
    """A band called `brf` is called `brdf` when its values are."""
    name = "btdf" if how.transmitted else "brdf"
    if name in {c.name for c in channels} or sum(is_factor(c.name) for c in channels) != 1:
        return channels
    return tuple(
        Channel(name, c.wavelength_nm) if is_factor(c.name) else c for c in channels
    )
