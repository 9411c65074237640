"""UTIA binary table (`.bin`): anisotropic BRDF in three colours, 288 by 288 directions.

No header: float64, little endian, three tables (R, G, B), each of incident by reflected
directions, `theta = 0, 15, ... 75` degrees by `phi = 0, 7.5, ... 352.5` degrees. Sources:
J. Filip and R. Vávra, "Template-based sampling of anisotropic BRDFs", 2014; `utia.cpp` of
ALTA. These do not agree on the scale of the numbers: see `scale` and `decode`.
"""

from __future__ import annotations

import os
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.source import HEAD_BYTES, load
from data_formats.survey import describe

NAME = "utia"
SUFFIXES = (".bin",)

Decode = Literal["none", "srgb"]

_N_THETA, _N_PHI = 6, 48
_N = _N_THETA * _N_PHI
_SIZE = 3 * _N * _N * 8
# What BRDF values can be: text and other bytes read as float64 are far outside of it.
_LARGEST, _SMALLEST = 1e6, 1e-12


def sniff(head: bytes) -> bool:
    """Whether 64 kB are numbers of the size of BRDF values."""
    if len(head) < HEAD_BYTES:
        return False
    numbers = np.abs(np.frombuffer(head, "<f8"))
    usual = (numbers == 0) | ((numbers > _SMALLEST) & (numbers < _LARGEST))
    return bool(usual.all() and numbers.any())


def read(
    path: str | os.PathLike[str], *, scale: float = 1.0, decode: Decode = "none"
) -> Measurement:
    """Read a UTIA table.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `scale`: the numbers are multiplied by it, after `decode`.
    - `decode`: `"srgb"`: the numbers are encoded as sRGB, and are decoded; `"none"`: they
        are linear.

    **Raises:** `MeasurementError` if the file has another size, or no usable value.
    """
    if decode not in get_args(Decode):
        raise MeasurementError(f"decode is {decode!r}; expected 'none' or 'srgb'")
    if not (isinstance(scale, int | float) and 0 < scale < np.inf):
        raise MeasurementError(f"scale is {scale!r}; expected a positive number")
    source = load(path)
    if len(source.data) != _SIZE:
        raise MeasurementError(
            f"{source.path}: the file has {len(source.data)} bytes; a UTIA table has "
            f"{_SIZE}"
        )
    stored = np.frombuffer(source.data, "<f8").reshape(3, _N * _N).T
    valid = np.isfinite(stored)
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    theta = np.repeat(np.deg2rad(15.0 * np.arange(_N_THETA)), _N_PHI)
    phi = np.tile(np.deg2rad(7.5 * np.arange(_N_PHI)), _N_THETA)
    value = _decoded(stored) if decode == "srgb" else stored
    m = Measurement(
        theta_i=np.repeat(theta, _N),
        phi_i=np.repeat(phi, _N),
        theta_r=np.tile(theta, _N),
        phi_r=np.tile(phi, _N),
        value=value * scale,
        valid=valid,
        channels=(Channel("R"), Channel("G"), Channel("B")),
        provenance=Provenance(source.path, source.sha256, NAME),
        notes=_notes(valid, scale, decode),
    )
    return describe(m)


def _decoded(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear values of sRGB ones (IEC 61966-2-1); negatives stay on the straight part."""
    curve = ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve)


def _notes(valid: NDArray[np.bool_], scale: float, decode: str) -> tuple[Note, ...]:
    notes = [
        Note(
            "scale-uncertain",
            "The file does not state its unit, and programs disagree: some take the "
            "numbers as 1/sr, others scale or decode them. They were read with "
            f"scale={scale:g} and decode={decode}",
        )
    ]
    if missing := int(np.count_nonzero(~valid)):
        notes.append(
            Note(
                "not-finite-masked",
                f"values that are not finite: {missing}; masked",
                missing,
            )
        )
    return tuple(notes)
