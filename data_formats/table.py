"""From named columns of numbers to a `Measurement`: what all table formats share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from data_formats.columns import Angle, Columns
from data_formats.instrument_quirks import apply_quirks
from data_formats.measurement import (
    Measurement,
    MeasurementError,
    Note,
    Provenance,
    Symmetry,
)
from data_formats.metadata import Metadata, kept

Quantity = Literal["brdf", "brf"]

# Angles printed with few digits may end slightly beyond 90 degrees.
_SLACK = 1e-3


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
    table: Table, *, degrees: bool | None = None, quantity: Quantity = "brdf"
) -> Measurement:
    """Convert units, mask what is no number, and say so in notes.

    **Arguments:**

    - `table`: what was read.
    - `degrees`: the unit of angles whose column does not state it; `None`: find out.
    - `quantity`: `"brf"`: the values are reflectance factors, `pi` times the BRDF.

    **Raises:** `MeasurementError` with file and line if a direction is missing or outside
    its hemisphere, or no value is valid.
    """
    if quantity not in ("brdf", "brf"):
        raise MeasurementError(f"quantity is {quantity!r}; expected 'brdf' or 'brf'")
    notes = list(table.notes)
    theta_i, phi_i, theta_r, phi_r = _directions(table, degrees, notes)
    columns, numbers = table.columns, table.numbers
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
    if quantity == "brf":
        value = value / np.pi
        sigma = None if sigma is None else sigma / np.pi
        notes.append(Note("brf-divided-by-pi", "Reflectance factors divided by pi"))
    if not valid.any():
        raise MeasurementError(
            f"{table.provenance.path}: none of the {value.size} values is valid"
        )

    measurement = Measurement(
        theta_i=theta_i,
        phi_i=phi_i,
        theta_r=theta_r,
        phi_r=phi_r,
        value=value,
        valid=valid,
        channels=tuple(c for c, _ in columns.channels),
        sigma=sigma,
        provenance=table.provenance,
        notes=tuple(notes),
        auxiliary={k: numbers[:, c] for k, c in columns.others.items()},
    )
    if own := table.own:
        return replace(
            measurement,
            symmetry=own.symmetry,
            provenance=kept(table.provenance, own.provenance),
            notes=own.notes,
        )
    return apply_quirks(describe(in_wavelength_order(measurement)))


def _directions(
    table: Table, degrees: bool | None, notes: list[Note]
) -> list[NDArray[np.float64]]:
    """theta_i, phi_i, theta_r, phi_r in radians."""
    angles = table.columns.angles
    raw: dict[Angle, NDArray[np.float64]] = {
        name: table.numbers[:, column] for name, (column, _) in angles.items()
    }
    for name, column in raw.items():
        if not np.isfinite(column).all():
            row = int(np.argmin(np.isfinite(column)))
            raise MeasurementError(f"{table.where(row)}: {name} is not a number")
    stated = [unit for _, unit in angles.values() if unit is not None]
    if degrees is None:
        degrees = set(stated) == {"deg"} if stated else _in_degrees(table, raw)
    converted: list[Angle] = [
        name for name, (_, u) in angles.items() if u == "deg" or (u is None and degrees)
    ]
    for name in converted:
        raw[name] = np.deg2rad(raw[name])
    if converted:
        notes.append(Note("degrees-converted", "Angles converted from degrees to radians"))
    _complete(table, raw, notes)
    if table.own is None:
        _snap_to_horizon(table, raw, notes)
    return [raw["theta_i"], raw["phi_i"], raw["theta_r"], raw["phi_r"]]


def _complete(
    table: Table, raw: dict[Angle, NDArray[np.float64]], notes: list[Note]
) -> None:
    """Add the azimuths that the file leaves out."""
    zero = np.zeros(len(table.numbers))
    have = set(raw)
    if have == {"theta_i", "phi_i", "theta_r", "phi_r"}:
        pass
    elif have == {"theta_i", "theta_r", "phi_r"}:
        raw["phi_i"] = zero
        notes.append(Note("phi-i-absent", "No phi_i in the file; phi_i = 0 assumed"))
    elif have == {"theta_i", "theta_r", "dphi"}:
        raw["phi_i"], raw["phi_r"] = zero, raw["dphi"]
        notes.append(
            Note("dphi-only", "Only the azimuth difference is given; phi_i = 0 assumed")
        )
    elif have == {"theta_i", "theta_r"}:
        raw["phi_i"] = zero
        raw["phi_r"] = np.where(raw["theta_r"] > 0, np.pi, 0.0)
        raw["theta_r"] = np.abs(raw["theta_r"])
        notes.append(
            Note("in-plane", "Two angles only: a receiver angle > 0 is the specular side")
        )
    else:
        raise MeasurementError(
            f"{table.provenance.path}: the angles found are {sorted(have)}; expected "
            "theta_i, phi_i, theta_r, phi_r (or theta_s, phi_s)"
        )


def _in_degrees(table: Table, raw: dict[Angle, NDArray[np.float64]]) -> bool:
    """Whether most directions cannot be in radians.

    One row beyond the range is a bad row, not a unit; a file in degrees has few rows
    that would pass for radians.
    """
    beyond = np.zeros(len(table.numbers), dtype=bool)
    for name, angle in raw.items():
        limit = np.pi if name.startswith("theta") else 2 * np.pi
        beyond |= np.abs(angle) > limit + 2e-2
    if not beyond.any() or beyond.mean() > 0.5:
        return bool(beyond.any())
    row = int(np.argmax(beyond))
    shown = ", ".join(f"{k} = {v[row]:g}" for k, v in raw.items())
    raise MeasurementError(
        f"{table.where(row)}: {shown} cannot be radians, but most rows can; correct the "
        "row, or say degrees=True or degrees=False"
    )


def _snap_to_horizon(
    table: Table, raw: dict[Angle, NDArray[np.float64]], notes: list[Note]
) -> None:
    """Check the ranges of theta; put rounding beyond 90 degrees back on the horizon."""
    snapped = 0
    limits: dict[Angle, float] = {"theta_i": np.pi / 2, "theta_r": np.pi}
    for name, limit in limits.items():
        theta = raw[name]
        wrong = ~((theta >= 0) & (theta <= limit + _SLACK))
        if wrong.any():
            row = int(np.argmax(wrong))
            raise MeasurementError(
                f"{table.where(row)}: {name} is {np.rad2deg(theta[row]):.6g} degrees; "
                f"expected 0 to {np.rad2deg(limit):g}"
            )
        for edge in (np.pi / 2, np.pi):
            near = (theta > edge) & (theta <= edge + _SLACK)
            # A float64's rounding needs no mention; a file's few digits do.
            snapped += int(np.count_nonzero(near & (theta > edge + 1e-9)))
            theta = np.where(near, edge, theta)
        raw[name] = theta
    if snapped:
        notes.append(
            Note(
                "theta-rounded",
                f"{snapped} angles just beyond 90 degrees set to it",
                snapped,
            )
        )


def in_wavelength_order(measurement: Measurement) -> Measurement:
    """Channels in ascending order of wavelength, with a note if they were not."""
    wavelengths = measurement.wavelengths
    if wavelengths is None or (np.diff(wavelengths) > 0).all():
        return measurement
    order = np.argsort(wavelengths)
    sigma = measurement.sigma
    note = Note("channels-sorted", "Channels were not in the order of wavelength; sorted")
    return replace(
        measurement,
        value=measurement.value[:, order],
        valid=measurement.valid[:, order],
        sigma=None if sigma is None else sigma[:, order],
        channels=tuple(measurement.channels[k] for k in order),
        notes=(*measurement.notes, note),
    )


def describe(measurement: Measurement) -> Measurement:
    """State the symmetry that the directions show, and count what is worth knowing."""
    notes = list(measurement.notes)
    negative = int(np.count_nonzero(measurement.valid & (measurement.value < 0)))
    if negative:
        notes.append(
            Note("negative-values", f"negative values: {negative}; kept", negative)
        )
    if twice := _duplicates(measurement):
        notes.append(
            Note(
                "duplicate-directions",
                f"rows that repeat a pair of directions: {twice}",
                twice,
            )
        )
    symmetry = detect_symmetry(measurement)
    if symmetry == "bilateral":
        notes.append(
            Note(
                "half-hemisphere",
                "Only one side of the plane of incidence was measured; mirror symmetry is "
                "assumed",
            )
        )
    return replace(measurement, symmetry=symmetry, notes=tuple(notes))


def detect_symmetry(measurement: Measurement) -> Symmetry:
    """Anisotropic if there are several `phi_i`; bilateral if all is on one side."""
    oblique = measurement.theta_i > 1e-6
    phi_i = measurement.phi_i[oblique]
    # Compared on the circle: -pi and pi are the same azimuth.
    if phi_i.size and np.abs(np.exp(1j * phi_i) - np.exp(1j * phi_i[0])).max() > 1e-5:
        return "anisotropic"
    side = np.sin(measurement.phi_r - measurement.phi_i)
    side = side[(measurement.theta_r > 1e-6) & oblique]
    if (side < -1e-5).any() != (side > 1e-5).any():
        return "bilateral"
    return "isotropic"


def _duplicates(measurement: Measurement) -> int:
    m = measurement
    angles = zip(
        m.theta_i.tolist(),
        m.phi_i.tolist(),
        m.theta_r.tolist(),
        m.phi_r.tolist(),
        strict=True,
    )
    return m.n_rows - len(set(angles))
