"""From the angles of a file to four angles in radians, on the side that they belong to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from data_formats.columns import Angle, Columns
from data_formats.measurement import MeasurementError
from data_formats.provenance import Note

Angles = dict[Angle, NDArray[np.float64]]
Where = Callable[[int], str]

# Angles printed with few digits may end slightly beyond 90 degrees.
_SLACK = 1e-3
# 90 degrees in radians, as files with few digits print it.
_PRINTED = np.array([round(np.pi / 2, digits) for digits in range(3, 7)])
# rad; what float32 leaves of a vector on the horizon.
_ROUNDING = 1e-6
# rad; as for `Measurement.transmitted`.
_ON_HORIZON = 1e-9


def in_radians(
    numbers: NDArray[np.float64],
    columns: Columns,
    path: str,
    where: Where,
    degrees: bool | None,
    notes: list[Note],
) -> Angles:
    """The angles of a table in radians, those that it leaves out added.

    **Arguments:**

    - `numbers`: (n, columns).
    - `columns`: which column is what.
    - `path`: of the file, for errors.
    - `where`: the file and the line of a row, likewise.
    - `degrees`: the unit of angles whose column does not state it; `None`: find out.
    - `notes`: appended to.

    **Raises:** `MeasurementError` with file and line if an angle is missing.
    """
    raw: Angles = {n: numbers[:, column] for n, (column, _) in columns.angles.items()}
    for name, column in raw.items():
        if not np.isfinite(column).all():
            row = int(np.argmin(np.isfinite(column)))
            raise MeasurementError(f"{where(row)}: {name} is not a number")
    stated = [unit for _, unit in columns.angles.values() if unit is not None]
    if degrees is None:
        degrees = set(stated) == {"deg"} if stated else _in_degrees(raw, where)
    converted: list[Angle] = [
        name
        for name, (_, u) in columns.angles.items()
        if u == "deg" or (u is None and degrees)
    ]
    for name in converted:
        raw[name] = np.deg2rad(raw[name])
    if converted:
        notes.append(Note("degrees-converted", "Angles converted from degrees to radians"))
    return _complete(raw, path, notes)


def _complete(raw: Angles, path: str, notes: list[Note]) -> Angles:
    """With the azimuths that the file leaves out."""
    have = set(raw)
    found: Angles = dict(raw)
    zero = np.zeros(len(next(iter(raw.values()), ())))
    if have == {"theta_i", "phi_i", "theta_r", "phi_r"}:
        return found
    if have == {"theta_i", "theta_r", "phi_r"}:
        found["phi_i"] = zero
        notes.append(Note("phi-i-absent", "No phi_i in the file; phi_i = 0 assumed"))
        return found
    if have == {"theta_i", "theta_r", "dphi"}:
        found["phi_i"], found["phi_r"] = zero, found.pop("dphi")
        notes.append(
            Note("dphi-only", "Only the azimuth difference is given; phi_i = 0 assumed")
        )
        return found
    if have == {"theta_i", "theta_r"}:
        found["phi_i"] = zero
        found["phi_r"] = np.where(found["theta_r"] > 0, np.pi, 0.0)
        found["theta_r"] = np.abs(found["theta_r"])
        notes.append(
            Note("in-plane", "Two angles only: a receiver angle > 0 is the specular side")
        )
        return found
    raise MeasurementError(
        f"{path}: the angles found are {sorted(have)}; expected theta_i, phi_i, "
        "theta_r, phi_r (or theta_s, phi_s)"
    )


def _in_degrees(raw: Angles, where: Where) -> bool:
    """Whether most directions cannot be in radians.

    One row beyond the range is a bad row, not a unit; a file in degrees has few rows
    that would pass for radians.
    """
    beyond = np.zeros(len(next(iter(raw.values()), ())), dtype=bool)
    for name, angle in raw.items():
        limit = np.pi if name.startswith("theta") else 2 * np.pi
        beyond |= np.abs(angle) > limit + 2e-2
    if not beyond.any() or beyond.mean() > 0.5:
        return bool(beyond.any())
    row = int(np.argmax(beyond))
    shown = ", ".join(f"{k} = {v[row]:g}" for k, v in raw.items())
    raise MeasurementError(
        f"{where(row)}: {shown} cannot be radians, but most rows can; correct the "
        "row, or say degrees=True or degrees=False"
    )


def snap_to_edges(raw: Angles, where: Where, notes: list[Note]) -> Angles:
    """Check the ranges of theta; put rounding beyond 90 and 180 degrees back on them.

    In a column with directions on both sides of the horizon an excess of more than 1e-6 is
    taken for rounding only if it is 90 degrees as printed with few digits: 1.571, 1.5708.

    **Raises:** `MeasurementError` with file and line of a theta outside [0, pi].
    """
    snapped = 0
    checked: Angles = dict(raw)
    thetas: tuple[Angle, Angle] = ("theta_i", "theta_r")
    for name in thetas:
        theta = raw[name]
        wrong = ~((theta >= 0) & (theta <= np.pi + _SLACK))
        if wrong.any():
            row = int(np.argmax(wrong))
            raise MeasurementError(
                f"{where(row)}: {name} is {np.rad2deg(theta[row]):.6g} degrees; "
                "expected 0 to 180, where more than 90 is behind the surface"
            )
        over = (theta > np.pi / 2) & (theta <= np.pi / 2 + _SLACK)
        if (theta > np.pi / 2 + _SLACK).any():
            printed = np.abs(theta[:, None] - _PRINTED).min(axis=1) < 1e-12
            over &= printed | (theta <= np.pi / 2 + _ROUNDING)
        for near, edge in ((over, np.pi / 2), (theta > np.pi, np.pi)):
            # A float64's rounding needs no mention; a file's few digits do.
            snapped += int(np.count_nonzero(near & (theta > edge + 1e-9)))
            theta = np.where(near, edge, theta)
        checked[name] = theta
    if snapped:
        notes.append(
            Note(
                "theta-rounded",
                f"{snapped} angles just beyond 90 or 180 degrees set to it",
                snapped,
            )
        )
    return checked


def same_side(raw: Angles) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) rows with source and detector on one side of the surface, and on two.

    Rows with one of them on the horizon are in neither.
    """
    source, detector = (np.pi / 2 - raw["theta_i"], np.pi / 2 - raw["theta_r"])
    clear = np.minimum(np.abs(source), np.abs(detector)) > _ON_HORIZON
    product = source * detector
    return clear & (product > 0), clear & (product < 0)


def unfolded(raw: Angles) -> Angles:
    """The angles with `theta_r -> pi - theta_r`: the other side of the surface.

    Files of transmitted light alone often give the angle to the outward normal of the side
    that the light leaves from.
    """
    turned: Angles = dict(raw)
    turned["theta_r"] = np.pi - raw["theta_r"]
    return turned
