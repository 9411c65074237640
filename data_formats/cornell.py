"""MATLAB files (`.mat`) of the Cornell Light Measurement Laboratory.

Three layouts of variables, MATLAB versions 4 to 7.3:

- `dir_in`, `dir_out` (N unit vectors each, z the normal), `fr` (N x c, 1/sr) and
  `wavelength` (c, nm), each in either orientation;
- `brdfNN` (c x M), `thetaNN`, `phiNN` (M) for each angle of incidence NN in degrees, and
  `wavelengths` (c);
- `brdfNN_WWW` for each incidence NN and wavelength WWW in nm on the grid `theta`, `phi`;
  missing values were filled by interpolation before publication.

NN has three digits for a sample lit from the back (120). In all layouts `theta` beyond 90
degrees is behind the surface.

The laboratory's text files are in the formats `astm` and `pbrt`.
"""

from __future__ import annotations

import os
import re

import numpy as np
from numpy.typing import NDArray

from data_formats import astm, hdf5, mat_file
from data_formats.columns import FOUR_ANGLES, Columns
from data_formats.mat_file import Variables
from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.quantity import Quantity, Side
from data_formats.source import Source, load
from data_formats.table import Table, to_measurement

NAME = "cornell"
SUFFIXES = (".mat",)

_HDF5_MAGIC = b"MATLAB 7.3 MAT-file"
_WANTED = re.compile(
    r"dir_in|dir_out|fr|wavelengths?|theta(?:\d{2,3})?|phi(?:\d{2,3})?|brdf\d{2,3}(?:_\d{3,4})?"
)


def sniff(head: bytes) -> bool:
    """Whether the file begins as MATLAB files do."""
    return head.startswith(_HDF5_MAGIC) or mat_file.is_mat(head)


def read(
    path: str | os.PathLike[str],
    *,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Measurement:
    """Read a Cornell file: MATLAB in one of the layouts above, or the text form.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, or `"brf"`, `"btf"`: reflectance or
        transmittance factors, to be divided by pi; `None`: 1/sr.
    - `side`: `"transmitted"`: all is transmitted light, and a `theta_r` written on the
        source's side is read as `180 - theta_r`; `"as-written"`, `None`: keep it.

    **Raises:** `MeasurementError` if the file is damaged or has another layout.
    """
    source = load(path)
    if astm.sniff(source.head):
        return astm.read(path, quantity=quantity, side=side)
    if source.data.startswith((_HDF5_MAGIC, hdf5.MAGIC)):
        variables = _from_hdf5(source)
    elif mat_file.is_mat(source.head):
        variables = mat_file.variables(source.data, _WANTED.fullmatch)
    else:
        raise MeasurementError(
            f"{source.path}: this is no MATLAB file; it begins with {source.data[:24]!r}"
        )
    return to_measurement(_table(source, variables), quantity=quantity, side=side)


def _from_hdf5(source: Source) -> Variables:
    try:
        with hdf5.open_image(source) as file:
            names = [str(n) for n in file if _WANTED.fullmatch(str(n))]
            return {n: hdf5.numbers(file, n, source) for n in names}
    except MeasurementError:
        raise
    except hdf5.ERRORS as error:
        raise hdf5.damaged(source, error) from error


def _table(source: Source, variables: Variables) -> Table:
    if any(v.ndim > 2 for v in variables.values()):
        raise MeasurementError(f"{source.path}: a variable has more than two dimensions")
    if {"dir_in", "dir_out", "fr"} <= set(variables):
        blocks, wavelengths, notes = _vectors(source, variables)
    elif any(re.fullmatch(r"brdf\d{2,3}_\d+", n) for n in variables):
        blocks, wavelengths, notes = _gridded(source, variables)
    elif any(re.fullmatch(r"brdf\d{2,3}", n) for n in variables):
        blocks, wavelengths, notes = _per_incidence(source, variables)
    else:
        found = ", ".join(sorted(variables)[:10]) or "none of them"
        raise MeasurementError(
            f"{source.path}: expected the variables dir_in, dir_out, fr and wavelength, or "
            f"brdf00, theta00, phi00 and wavelengths; found {found}"
        )
    return Table(
        numbers=np.concatenate(blocks),
        columns=Columns(
            angles=FOUR_ANGLES,
            channels=[(Channel.at(w), 4 + k) for k, w in enumerate(wavelengths)],
        ),
        provenance=Provenance(source.path, source.sha256, NAME),
        notes=notes,
    )


Layout = tuple[list[NDArray[np.float64]], list[float], tuple[Note, ...]]


def _vectors(source: Source, variables: Variables) -> Layout:
    wavelengths = _wavelengths(source, variables)
    values = _rows_by(source, "fr", variables["fr"], len(wavelengths))
    angles: list[NDArray[np.float64]] = []
    for name in ("dir_in", "dir_out"):
        vectors = _rows_by(source, name, variables[name], 3)
        length = np.linalg.norm(vectors, axis=1)
        if len(vectors) != len(values) or not (np.abs(length - 1) < 0.01).all():
            raise MeasurementError(
                f"{source.path}: {name} has the shape {variables[name].shape}; expected "
                f"{len(values)} vectors of length 1"
            )
        x, y, z = vectors.T
        angles += [np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)]
    return [np.column_stack([*angles, values])], wavelengths, ()


def _per_incidence(source: Source, variables: Variables) -> Layout:
    wavelengths = _wavelengths(source, variables)
    blocks: list[NDArray[np.float64]] = []
    for name in sorted(n for n in variables if re.fullmatch(r"brdf\d{2,3}", n)):
        incidence = name.removeprefix("brdf")
        values = _rows_by(source, name, variables[name], len(wavelengths))
        theta, phi = _grid(source, variables, incidence, len(values))
        blocks.append(np.column_stack([_incidence(incidence, theta), theta, phi, values]))
    return blocks, wavelengths, (_azimuth_note(),)


def _gridded(source: Source, variables: Variables) -> Layout:
    tables: dict[str, dict[float, NDArray[np.float64]]] = {}
    for name, content in variables.items():
        if match := re.fullmatch(r"brdf(\d{2,3})_(\d+)", name):
            tables.setdefault(match[1], {})[float(match[2])] = content.ravel()
    wavelengths = sorted({w for table in tables.values() for w in table})
    blocks: list[NDArray[np.float64]] = []
    for incidence, table in sorted(tables.items()):
        size = next(iter(table.values())).size
        theta, phi = _grid(source, variables, "", size)
        columns = [table.get(w, np.full(size, np.nan)) for w in wavelengths]
        if any(c.size != size for c in columns):
            raise MeasurementError(
                f"{source.path}: the tables brdf{incidence}_* have different sizes"
            )
        blocks.append(np.column_stack([_incidence(incidence, theta), theta, phi, *columns]))
    note = Note(
        "interpolated-values",
        "In this layout missing values were filled by interpolation before publication; "
        "they cannot be told from measured ones",
    )
    return blocks, wavelengths, (note, _azimuth_note())


def _incidence(text: str, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) theta_i and phi_i = 0."""
    return np.column_stack(
        [np.full_like(theta, np.deg2rad(float(text))), np.zeros_like(theta)]
    )


def _azimuth_note() -> Note:
    return Note("phi-i-absent", "No azimuth of incidence in the file; phi_i = 0 assumed")


def _grid(
    source: Source, variables: Variables, suffix: str, size: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """theta and phi in radians; the file does not state the unit, their range does."""
    found = [
        variables.get(f"{name}{suffix}", np.empty(0)).ravel() for name in ("theta", "phi")
    ]
    if any(a.size != size for a in found):
        raise MeasurementError(
            f"{source.path}: theta{suffix} and phi{suffix} have {found[0].size} and "
            f"{found[1].size} elements; expected {size}"
        )
    theta, phi = found
    if np.abs(theta).max(initial=0) > np.pi or np.abs(phi).max(initial=0) > 7:
        theta, phi = np.deg2rad(theta), np.deg2rad(phi)
    return theta, phi


def _wavelengths(source: Source, variables: Variables) -> list[float]:
    found = variables.get("wavelength", variables.get("wavelengths", np.empty(0))).ravel()
    if not found.size or not (np.isfinite(found) & (found > 0)).all():
        raise MeasurementError(
            f"{source.path}: no variable wavelength with positive numbers in nm"
        )
    return found.tolist()


def _rows_by(
    source: Source, name: str, table: NDArray[np.float64], columns: int
) -> NDArray[np.float64]:
    """The table with `columns` columns, transposed if it is the other way round."""
    table = np.atleast_2d(table)
    if table.shape[1] == columns:
        return table
    if table.shape[0] == columns:
        return table.T
    raise MeasurementError(
        f"{source.path}: {name} has the shape {table.shape}; expected one side of {columns}"
    )
