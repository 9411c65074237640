"""MERL binary table (`.binary`): isotropic RGB on a grid of half and difference angles.

Three int32 (90, 90, 180), then float64, little endian: the tables of R, G and B, each of
theta_h by theta_d by phi_d. A number times 1/1500, 1.15/1500, 1.66/1500 is the BRDF in 1/sr
in R, G, B; negative numbers say that nothing was measured. The value of a bin is read at
its centre: `theta_h = (i + 1/2)^2 / 90` degrees, `theta_d` and `phi_d` at `i + 1/2` degrees
(other programs take `i^2 / 90`, the lower edge). phi_d ends at 180 degrees, since
exchanging source and detector adds 180; tables with 360 phi_d are read, too.
Sources: W. Matusik et al., "A data-driven reflectance model", 2003, and its `BRDFRead.cpp`.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from data_formats.half_difference import directions, half_difference
from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.source import Source, load
from data_formats.survey import describe

NAME = "merl"
SUFFIXES = (".binary",)

_THETA_H, _THETA_D, _PHI_D = 90, 90, 180
_HEADERS = {struct.pack("<3i", 90, 90, n): n for n in (_PHI_D, 2 * _PHI_D)}
_HEADER_SIZE = 12
_SCALE = np.array([1.00, 1.15, 1.66]) / 1500
_CHANNELS = (Channel("R"), Channel("G"), Channel("B"))
# rad; beyond this theta_d little was measured and much extrapolated.
_GRAZING = np.deg2rad(80)
# rad; how far from the centre of its bin a value may be written.
_ON_CENTRE = 1e-6


def sniff(head: bytes) -> bool:
    """Whether the file begins with the sizes of such a table."""
    return head[:_HEADER_SIZE] in _HEADERS


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a MERL table: every bin whose centre is a pair of directions of reflection.

    Rows are turned so that `phi_i = 0`.

    **Raises:** `MeasurementError` if the file has another size, or no usable value.
    """
    source = load(path)
    raw, n_phi = _table(source)
    theta_h, theta_d, phi_d = _centres(n_phi)
    theta_i, phi_i, theta_r, phi_r = directions(
        theta_h[:, None, None], theta_d[:, None], phi_d
    )
    above = (theta_i < np.pi / 2) & (theta_r < np.pi / 2)
    stored = raw[:, above].T
    valid = (stored >= 0) & np.isfinite(stored)
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    grazing = valid.any(axis=1) & (
        np.broadcast_to(theta_d[:, None], above.shape)[above] > _GRAZING
    )
    m = Measurement(
        theta_i=theta_i[above],
        phi_i=phi_i[above],
        theta_r=theta_r[above],
        phi_r=phi_r[above],
        value=stored * _SCALE,
        valid=valid,
        channels=_CHANNELS,
        provenance=Provenance(
            path=source.path,
            sha256=source.sha256,
            format=NAME,
            header={"dimensions": f"{_THETA_H} {_THETA_D} {n_phi}"},
        ),
        notes=_notes(above, valid, raw, int(np.count_nonzero(grazing))),
    )
    return describe(m)


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write a MERL table; bins without a valid value get -1.

    **Raises:** `MeasurementError` if a valid value is not at the centre of a bin, or two
    are in one, or the channels are not R, G and B.
    """
    m = measurement
    if tuple(c.name for c in m.channels) != ("R", "G", "B"):
        found = ", ".join(c.name for c in m.channels[:6])
        raise MeasurementError(f"a MERL table holds the channels R, G, B; found {found}")
    m = m.select(m.valid.any(axis=1))
    places = _places(m)
    if len(np.unique(places)) < m.n_rows:
        raise MeasurementError("two rows are in one bin of the MERL table; write it as csv")
    table = np.full((3, _THETA_H * _THETA_D * _PHI_D), -1.0)
    # A measured negative would read as "not measured", which is all that the format has.
    usable = m.valid & (m.value >= 0)
    table[:, places] = np.where(usable, m.value / _SCALE, -1.0).T
    header = struct.pack("<3i", _THETA_H, _THETA_D, _PHI_D)
    Path(path).write_bytes(header + table.astype("<f8").tobytes())


def _table(source: Source) -> tuple[NDArray[np.float64], int]:
    """(3, theta_h, theta_d, phi_d) numbers as stored, and the size of the last axis."""
    n_phi = _HEADERS.get(source.data[:_HEADER_SIZE])
    if n_phi is None:
        raise MeasurementError(
            f"{source.path}: a MERL table begins with the sizes 90, 90, 180; the file "
            f"begins with {source.data[:_HEADER_SIZE]!r}"
        )
    shape = (3, _THETA_H, _THETA_D, n_phi)
    expected = _HEADER_SIZE + 8 * int(np.prod(shape))
    if len(source.data) != expected:
        raise MeasurementError(
            f"{source.path}: the file has {len(source.data)} bytes; a MERL table of "
            f"90 x 90 x {n_phi} has {expected}; copy it again"
        )
    numbers = np.frombuffer(source.data, "<f8", offset=_HEADER_SIZE)
    return numbers.reshape(shape).astype(np.float64, copy=False), n_phi


def _centres(n_phi: int) -> tuple[NDArray[np.float64], ...]:
    """(90,) theta_h, (90,) theta_d and (n_phi,) phi_d in radians."""
    middle = np.arange(_THETA_D) + 0.5
    return (
        np.deg2rad(middle**2 / 90),
        np.deg2rad(middle),
        np.deg2rad(np.arange(n_phi) + 0.5),
    )


def _notes(
    above: NDArray[np.bool_],
    valid: NDArray[np.bool_],
    raw: NDArray[np.float64],
    grazing: int,
) -> tuple[Note, ...]:
    below = int(np.count_nonzero(~above))
    # What is stored there by mistake cannot be a reflection.
    stored = int(np.count_nonzero((raw >= 0).any(axis=0) & ~above))
    unmeasured = int(np.count_nonzero(~valid))
    notes = [
        Note(
            "bin-centres",
            "Each value is given at the centre of its bin of half and difference angles",
        ),
        Note(
            "below-horizon",
            f"bins whose centre has source or detector below the horizon: {below}, of "
            f"which {stored} hold a number; left out",
            below,
        ),
        Note(
            "reciprocal-by-format",
            "phi_d ends at 180 degrees: the table has source and detector exchanged built "
            "in, and cannot show where reciprocity fails",
        ),
    ]
    if above.shape[-1] > _PHI_D:
        notes.pop()
    if unmeasured:
        notes.append(
            Note(
                "negative-masked",
                f"values that are negative or not finite, which say that nothing was "
                f"measured: {unmeasured}; masked",
                unmeasured,
            )
        )
    if grazing:
        notes.append(
            Note(
                "perhaps-extrapolated",
                f"rows with theta_d > 80 degrees, where these tables are known to be "
                f"extrapolated or unreliable: {grazing}; kept",
                grazing,
            )
        )
    return tuple(notes)


def _places(m: Measurement) -> NDArray[np.int64]:
    """(n,) index of each row's bin in a table."""
    if (m.transmitted | m.from_back).any():
        raise MeasurementError("a MERL table holds reflection from the front alone")
    found = half_difference(m.theta_i, m.phi_i, m.theta_r, m.phi_r)
    theta_h, theta_d, phi_d = (np.rad2deg(a) for a in found)
    phi_d = np.where(phi_d < 0, phi_d + 180, phi_d)
    index = [
        np.clip(np.floor(a), 0, n - 1).astype(np.int64)
        for a, n in (
            (np.sqrt(90 * theta_h), _THETA_H),
            (theta_d, _THETA_D),
            (phi_d, _PHI_D),
        )
    ]
    centres = _centres(_PHI_D)
    off = np.zeros(m.n_rows)
    for a, k, centre in zip((theta_h, theta_d, phi_d), index, centres, strict=True):
        off = np.maximum(off, np.abs(np.deg2rad(a) - centre[k]))
    if wrong := int(np.count_nonzero(off > _ON_CENTRE)):
        raise MeasurementError(
            f"a MERL table holds values at the centres of its bins alone; {wrong} of "
            f"{m.n_rows} rows are elsewhere; fit a model and export that, or write csv"
        )
    return (index[0] * _THETA_D + index[1]) * _PHI_D + index[2]
