"""KAIST polarimetric BRDF (`.pbsdf`): the unpolarised element of isotropic Mueller data.

A `tensor_file` with `M` (phi_d by theta_d by theta_h by wavelength by 4 by 4, float32, 1/sr
without cosine) on the grid `phi_d`, `theta_d`, `theta_h` (rad) and `wvls` (nm). Read is
`M[..., 0, 0]`, which is the BRDF for unpolarised light; directions that exist for no
reflection are NaN or left out. Sources: S.-H. Baek et al., "Image-based acquisition and
modeling of polarimetric reflectance", 2020; `measured_polarized.cpp` of Mitsuba 3.
"""

from __future__ import annotations

import os

import numpy as np

from data_formats import tensor_file
from data_formats.half_difference import directions
from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.source import load
from data_formats.survey import describe, in_wavelength_order

NAME = "kaist"
SUFFIXES = (".pbsdf",)

_MUELLER = "M"


def sniff(head: bytes) -> bool:
    """Whether it is a `tensor_file` with a field `M`."""
    if not head.startswith(tensor_file.MAGIC):
        return False
    try:
        return _MUELLER in tensor_file.fields(head)
    except MeasurementError:
        return False


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read the unpolarised part of a polarimetric BRDF, turned so that `phi_i = 0`.

    **Raises:** `MeasurementError` if the file is damaged, or lacks the angles of its grid.
    """
    source = load(path)
    if not source.data.startswith(tensor_file.MAGIC):
        raise MeasurementError(
            f"{source.path}: a .pbsdf file begins with 'tensor_file'; this one with "
            f"{source.data[:16]!r}"
        )
    table = tensor_file.fields(source.data)
    mueller = tensor_file.array(source, table, _MUELLER)
    if mueller.ndim != 6 or mueller.shape[4:] != (4, 4) or mueller.dtype.kind != "f":
        raise MeasurementError(
            f"{source.path}: field 'M' has the shape {mueller.shape}; expected phi_d by "
            "theta_d by theta_h by wavelength by 4 by 4"
        )
    n_phi, n_d, n_h, n_nm = mueller.shape[:4]
    phi_d = tensor_file.nodes(source, table, "phi_d", n_phi)
    theta_d = tensor_file.nodes(source, table, "theta_d", n_d)
    theta_h = tensor_file.nodes(source, table, "theta_h", n_h)
    nm = tensor_file.nodes(source, table, "wvls", n_nm)
    for name, angle in (("theta_d", theta_d), ("theta_h", theta_h)):
        if angle.size and not (angle[0] > -1e-6 and angle[-1] < np.pi / 2 + 1e-6):
            raise MeasurementError(
                f"{source.path}: {name} runs from {angle[0]:g} to {angle[-1]:g} rad; "
                "expected 0 to pi/2"
            )
    theta_i, phi_i, theta_r, phi_r = directions(
        theta_h, theta_d[:, None], phi_d[:, None, None]
    )
    # Rounding of the float32 nodes puts the horizon itself on either side.
    above = (theta_i < np.pi / 2 - 1e-6) & (theta_r < np.pi / 2 - 1e-6)
    stored = mueller[..., 0, 0]
    hidden = int(np.count_nonzero(np.isfinite(stored[~above]) & (stored[~above] != 0)))
    value = stored[above].astype(np.float64)
    valid = np.isfinite(value)
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    below, missing = int(np.count_nonzero(~above)), int(np.count_nonzero(~valid))
    notes = [
        Note(
            "unpolarised-part",
            "The file holds Mueller matrices; read was their first element, the BRDF for "
            "unpolarised light",
        ),
        Note(
            "below-horizon",
            f"nodes that have source or detector on or below the horizon: {below}, of "
            f"which {hidden} hold a number other than 0; left out",
            below,
        ),
    ]
    if missing:
        notes.append(
            Note(
                "not-finite-masked",
                f"values that are not finite: {missing}; masked",
                missing,
            )
        )
    m = Measurement(
        theta_i=theta_i[above],
        phi_i=phi_i[above],
        theta_r=theta_r[above],
        phi_r=phi_r[above],
        value=value,
        valid=valid,
        channels=tuple(Channel.at(w) for w in nm.tolist()),
        provenance=Provenance(source.path, source.sha256, NAME),
        notes=tuple(notes),
    )
    return describe(in_wavelength_order(m))
