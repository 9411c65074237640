"""RGL (EPFL) adaptive BRDF (`.bsdf`): spectra or RGB on a grid that follows the lobe.

A `tensor_file` with, for each direction of incidence (`phi_i`, `theta_i`), `spectra` (by
`wavelengths` in nm) or `rgb` on a square of nodes `s`. The distribution of visible normals
`vndf` says which half vector each node is: `u = vndf^-1(s)`, with `theta_h = u_x^2 pi/2`
and `phi_h = (2 u_y - 1) pi`, from `phi_i` on if the sample is isotropic. Then
`f cos(theta_r) = spectra(s) ndf(u) / (4 sigma(u_i))`, where `u_i` are the coordinates of
the direction of incidence; without the fraction if `jacobian` is 0. Read are the nodes
themselves, so that every value is one that the file holds: nothing is interpolated.
Sources: J. Dupuy and W. Jakob, "An adaptive parameterization for efficient material
acquisition and rendering", 2018; `measured.cpp` of Mitsuba 3.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from data_formats import tensor_file
from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.provenance import one_line
from data_formats.source import Source, load
from data_formats.survey import describe, in_wavelength_order

NAME = "rgl"
SUFFIXES = (".bsdf",)

Array = NDArray[np.float64]
Fields = Mapping[str, tensor_file.Field]

# rad; the instrument measured nothing beyond, and what is stored there was made up.
_LAST_THETA = np.deg2rad(84)
# The stored product with the cosine says nothing about f below this cosine.
_LEAST_COSINE = 0.02


def sniff(head: bytes) -> bool:
    """Whether it is a `tensor_file` with visible normals and spectra or RGB."""
    if not head.startswith(tensor_file.MAGIC):
        return False
    try:
        found = tensor_file.fields(head)
    except MeasurementError:
        return False
    return "vndf" in found and ("spectra" in found or "rgb" in found)


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a file of the RGL database at the nodes of its own grid.

    **Raises:** `MeasurementError` if the file is damaged or lacks a field.
    """
    source = load(path)
    if not source.data.startswith(tensor_file.MAGIC):
        raise MeasurementError(
            f"{source.path}: a .bsdf file of RGL begins with 'tensor_file'; this one with "
            f"{source.data[:16]!r}"
        )
    table = tensor_file.fields(source.data)
    name = "spectra" if "spectra" in table else "rgb"
    stored = tensor_file.array(source, table, name)
    if stored.ndim != 5 or min(stored.shape) < 1 or min(stored.shape[3:]) < 2:
        raise MeasurementError(
            f"{source.path}: field {name!r} has the shape {stored.shape}; expected phi_i "
            "by theta_i by channel by rows by columns"
        )
    n_phi, n_theta, n_channels = stored.shape[:3]
    phi_i = tensor_file.nodes(source, table, "phi_i", n_phi)
    theta_i = tensor_file.nodes(source, table, "theta_i", n_theta)
    if not (theta_i[0] > -1e-6 and theta_i[-1] < np.pi / 2 + 1e-6):
        raise MeasurementError(
            f"{source.path}: theta_i runs from {theta_i[0]:g} to {theta_i[-1]:g} rad; "
            "expected 0 to pi/2"
        )
    channels = _channels(source, table, name, n_channels)
    isotropic = n_phi <= 2  # two are the ends of one interval
    theta_i, azimuth = np.clip(theta_i, 0, np.pi / 2), 0 * phi_i if isotropic else phi_i

    u_x, u_y = _half_vectors(source, table, stored.shape)
    phi_h = (2 * u_y - 1) * np.pi
    theta_r, phi_r = _reflected(
        theta_i[:, None, None], azimuth[:, None, None, None], u_x**2 * np.pi / 2, phi_h
    )
    factor = _jacobian(source, table, theta_i, azimuth, u_x, u_y) / np.cos(theta_r)
    above = theta_r < np.pi / 2
    value = np.moveaxis(stored, 2, -1)[above] * factor[above][:, None]
    cosines = (
        np.cos(theta_r)[above],
        np.broadcast_to(np.cos(theta_i)[:, None, None], above.shape)[above],
    )
    grazing = np.minimum(*cosines) < max(np.cos(_LAST_THETA), _LEAST_COSINE)
    valid = np.isfinite(value) & ~grazing[:, None]
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    shape = above.shape
    m = Measurement(
        theta_i=np.broadcast_to(theta_i[:, None, None], shape)[above],
        phi_i=np.broadcast_to(azimuth[:, None, None, None], shape)[above],
        theta_r=theta_r[above],
        phi_r=phi_r[above],
        value=value,
        valid=valid,
        channels=channels,
        provenance=_provenance(source, table),
        notes=_notes(above, grazing, value, phi_i),
    )
    return describe(in_wavelength_order(m))


def _channels(source: Source, table: Fields, name: str, n: int) -> tuple[Channel, ...]:
    if name == "spectra":
        nm = tensor_file.nodes(source, table, "wavelengths", n)
        return tuple(Channel.at(w) for w in nm.tolist())
    if n != 3:
        raise MeasurementError(f"{source.path}: field 'rgb' has {n} channels; expected 3")
    return tuple(map(Channel, "RGB"))


def _half_vectors(
    source: Source, table: Fields, shape: tuple[int, ...]
) -> tuple[Array, Array]:
    """(phi_i, theta_i, rows, columns) coordinates u_x, u_y of the nodes' half vectors."""
    n_phi, n_theta, _, rows, columns = shape
    density = _map(source, table, "vndf", (n_phi, n_theta))
    s_x, s_y = np.linspace(0, 1, columns), np.linspace(0, 1, rows)
    # The density of rows, then that of the columns within the row found.
    lines = (density[..., 1:] + density[..., :-1]).sum(axis=-1)
    u_y = _inverse(lines, np.broadcast_to(s_y, (*lines.shape[:-1], rows)))
    row = np.minimum(u_y.astype(int), density.shape[-2] - 2)
    part = (u_y - row)[..., None]
    low = np.take_along_axis(density, row[..., None], axis=-2)
    high = np.take_along_axis(density, row[..., None] + 1, axis=-2)
    across = (1 - part) * low + part * high
    u_x = _inverse(across, np.broadcast_to(s_x, (*across.shape[:-1], columns)))
    u_y = np.broadcast_to(u_y[..., None] / (density.shape[-2] - 1), u_x.shape)
    return u_x / (density.shape[-1] - 1), u_y


def _map(source: Source, table: Fields, name: str, outer: tuple[int, ...]) -> Array:
    """A field of maps, linear between their nodes."""
    found = tensor_file.array(source, table, name)
    if found.shape[:-2] != outer or found.ndim < 2 or min(found.shape[-2:]) < 2:
        raise MeasurementError(
            f"{source.path}: field {name!r} has the shape {found.shape}; expected "
            f"{outer} by rows by columns"
        )
    numbers = found.astype(np.float64)
    if not (np.isfinite(numbers).all() and (numbers >= 0).all()):
        raise MeasurementError(
            f"{source.path}: field {name!r} has negative or infinite numbers; is it "
            "damaged?"
        )
    return numbers


def _inverse(density: Array, part: Array) -> Array:
    """Where, in cells, the integral of a piecewise linear density is a part of the whole.

    **Arguments:**

    - `density`: (..., n) at nodes one cell apart.
    - `part`: (..., m) from 0 to 1.
    """
    cells = (density[..., 1:] + density[..., :-1]) / 2
    before = np.concatenate([np.zeros((*cells.shape[:-1], 1)), cells.cumsum(-1)], axis=-1)
    target = part * before[..., -1:]
    cell = (before[..., None, 1:-1] <= target[..., None]).sum(axis=-1)
    left = np.take_along_axis(density, cell, axis=-1)
    rise = np.take_along_axis(density, cell + 1, axis=-1) - left
    rest = target - np.take_along_axis(before, cell, axis=-1)
    # left t + rise t^2 / 2 = rest, in the form that does not cancel.
    root = left + np.sqrt(np.maximum(left**2 + 2 * rise * rest, 0))
    step = np.divide(2 * rest, root, out=np.zeros_like(rest), where=root > 0)
    return cell + np.clip(step, 0, 1)


def _reflected(
    theta_i: Array, phi_i: Array, theta_h: Array, phi_h: Array
) -> tuple[Array, Array]:
    """Direction of the mirror image of the source in the half vector."""
    sin_i, cos_i = np.sin(theta_i), np.cos(theta_i)
    sin_h, cos_h = np.sin(theta_h), np.cos(theta_h)
    twice = 2 * (sin_i * sin_h * np.cos(phi_h - phi_i) + cos_i * cos_h)
    x = twice * sin_h * np.cos(phi_h) - sin_i * np.cos(phi_i)
    y = twice * sin_h * np.sin(phi_h) - sin_i * np.sin(phi_i)
    return np.arctan2(np.hypot(x, y), twice * cos_h - cos_i), np.arctan2(y, x)


def _jacobian(
    source: Source, table: Fields, theta_i: Array, phi_i: Array, u_x: Array, u_y: Array
) -> Array:
    """(phi_i, theta_i, rows, columns) factor of the stored numbers."""
    flag = tensor_file.array(source, table, "jacobian")
    if not flag.size or not flag.ravel()[0]:
        return np.ones_like(u_x)
    ndf = _bilinear(_map(source, table, "ndf", ()), u_x, u_y)
    at_x = np.sqrt(theta_i * 2 / np.pi)
    at_y = (phi_i[:, None] + np.pi) / (2 * np.pi)
    at_x, at_y = np.broadcast_arrays(at_x, at_y)
    sigma = _bilinear(_map(source, table, "sigma", ()), at_x, at_y)
    return ndf / (4 * sigma[..., None, None])


def _bilinear(nodes: Array, x: Array, y: Array) -> Array:
    """A map between its nodes, `x` along the last axis; both from 0 to 1."""
    rows, columns = nodes.shape
    x, y = np.clip(x, 0, 1) * (columns - 1), np.clip(y, 0, 1) * (rows - 1)
    i, j = np.minimum(y.astype(int), rows - 2), np.minimum(x.astype(int), columns - 2)
    x, y = x - j, y - i
    low = (1 - x) * nodes[i, j] + x * nodes[i, j + 1]
    high = (1 - x) * nodes[i + 1, j] + x * nodes[i + 1, j + 1]
    return (1 - y) * low + y * high


def _provenance(source: Source, table: Fields) -> Provenance:
    text = ""
    if "description" in table:
        raw = tensor_file.array(source, table, "description").tobytes()
        text = one_line(raw.decode("utf-8", errors="replace"))
    return Provenance(
        path=source.path,
        sha256=source.sha256,
        format=NAME,
        sample=text,
        header={"description": text} if text else {},
    )


def _notes(
    above: NDArray[np.bool_], grazing: NDArray[np.bool_], value: Array, phi_i: Array
) -> tuple[Note, ...]:
    notes = [
        Note(
            "cosine-divided",
            "The file holds f cos(theta_r), as a product of its distribution of normals "
            "and a grid; f was computed at the nodes of the grid",
        )
    ]
    counted = (
        (
            "below-horizon",
            "nodes whose direction of reflection is below the horizon: {}; left out",
            int(np.count_nonzero(~above)),
        ),
        (
            "grazing-masked",
            "rows with theta_i or theta_r > 84 degrees, where nothing was measured: {}; "
            "masked",
            int(np.count_nonzero(grazing)),
        ),
        (
            "not-finite-masked",
            "values that are not finite: {}; masked",
            int(np.count_nonzero(~np.isfinite(value))),
        ),
    )
    notes += [Note(code, text.format(n), n) for code, text, n in counted if n]
    if len(phi_i) > 2 and (part := round(2 * np.pi / (phi_i[-1] - phi_i[0]))) > 1:
        notes.append(
            Note(
                "azimuths-in-part",
                f"phi_i covers 1/{part} of the circle: the database takes the rest for its "
                "mirror image; only what is stored was read",
            )
        )
    return tuple(notes)
