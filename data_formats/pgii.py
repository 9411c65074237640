"""pab-opto pgII scan: one direction of incidence, scattered directions in any order.

    #sample_name "opal glass"
    #intheta 30
    #inphi 180
    #colorimetry: CIE-Y          (CIE-XYZ: three values per row)
    #format: theta phi BSDF      (DSF: BSDF times the cosine of theta)
    12.5  0.0  0.31              theta and phi in degrees, and the values

`#incident_angle 30 180` may stand for `#intheta` and `#inphi`, `#lambda= 400 500` for the
colorimetry; a colon after a key is optional. theta beyond 90 degrees is on the other side.
Values of another kind, such as a detector's current in uA, are only proportional to a BSDF
times a cosine. A sample has as many files as directions of incidence. Source:
`pabopto2bsdf` of Radiance; pab advanced technologies.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.number_block import Rows
from data_formats.provenance import Note
from data_formats.quantity import Quantity, Side
from data_formats.source import Source, load
from data_formats.specular_grid import columns_of
from data_formats.table import Table, to_measurement
from data_formats.token_stream import number_or_none

NAME = "pgii"
SUFFIXES = (".dat", ".txt")

_MARK = re.compile(
    rb"^#[ \t]*(?:intheta|incident_angle|theta_in|format:[ \t]*theta)\b",
    re.MULTILINE | re.IGNORECASE,
)
_KEY = re.compile(r"#\s*(.*?)\s*(?:[:=]\s*|\s+|$)(.*)")
_SPECTRAL_KEY = "number of datapoints per loop in file"
_PER_STERADIAN = ("BSDF", "BRDF", "BTDF")
# A smaller cosine multiplies the noise of a DSF by more than 50.
_SMALLEST_COSINE = 0.02
_MOST_CHANNELS = 10_000
_WAVELENGTHS = (10.0, 1e5)


def sniff(head: bytes) -> bool:
    """Whether a comment line states the incidence or the format, and none is of ALTA."""
    return _MARK.search(head.replace(b"\r", b"\n")) is not None and b"#DIM" not in head


def read(
    path: str | os.PathLike[str],
    *,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Measurement:
    """Read a pgII scan.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, or `"brf"`, `"btf"`: reflectance or
        transmittance factors, to be divided by pi, whatever `#format` says; `None`: as
        `#format` says.
    - `side`: `"transmitted"`: all is transmitted light, and a `theta_r` written on the
        source's side is read as `180 - theta_r`; `"as-written"` or `None`: keep it.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    lines = source.lines()
    fields, start = _fields(lines)
    theta_i, phi_i = _incidence(fields, source)
    channels = _channels(fields, source)
    rows = Rows.after(source.path, lines, start)
    names = ["theta", "phi", *(c.name for c in channels)]
    numbers = rows.numbers(rows.dialect([len(names)]), names)
    theta_r, value = numbers[:, 0], numbers[:, 2:]

    notes: list[Note] = []
    _check_count(fields, len(numbers), notes)
    kind = fields.get("format", "").upper().removeprefix("THETA").strip()
    kind = kind.removeprefix("PHI").strip()
    if quantity is None and kind == "DSF":
        value = _without_cosine(value, theta_r, notes)
    elif quantity is None and kind not in _PER_STERADIAN:
        what = f"#format says {kind[:30]!r}" if kind else "there is no #format"
        notes.append(
            Note(
                "only-proportional",
                f"The values are a raw signal ({what}): not in 1/sr, and proportional to "
                "the BSDF times cos(theta_r) at best; kept as they are",
                len(numbers),
            )
        )
    angles = np.broadcast_to([theta_i, phi_i], (len(numbers), 2))
    return to_measurement(
        Table(
            numbers=np.hstack([angles, numbers[:, :2], value]),
            columns=columns_of(channels, "deg"),
            provenance=Provenance(
                path=source.path,
                sha256=source.sha256,
                format=NAME,
                sample=fields.get("sample_name", "").strip('" '),
                header=fields,
            ),
            line_numbers=rows.line_numbers,
            notes=tuple(notes),
        ),
        quantity=quantity or "bsdf",
        side=side or ("as-written" if quantity is None else None),
    )


def _fields(lines: Sequence[str]) -> tuple[dict[str, str], int]:
    """The header's fields by their keys in lower case, and the index of the first row."""
    fields: dict[str, str] = {}
    for index, line in enumerate(lines):
        text = line.strip()
        if text and not text.startswith("#"):
            return fields, index
        if text[1:].strip().lower().startswith(_SPECTRAL_KEY):
            fields[_SPECTRAL_KEY] = text.rpartition(":")[2].strip()
        elif text and (match := _KEY.match(text)) and match[1]:
            fields.setdefault(match[1].lower(), match[2].strip())
    return fields, len(lines)


def _incidence(fields: dict[str, str], source: Source) -> tuple[float, float]:
    """theta_i and phi_i in degrees."""
    both = fields.get("incident_angle", "").split()
    theta = fields.get("intheta") or fields.get("theta_in") or (both[0] if both else "")
    phi = fields.get("inphi") or fields.get("phi_in") or (both[1] if both[1:] else "0")
    theta_i, phi_i = number_or_none(theta), number_or_none(phi)
    if theta_i is None or phi_i is None or not np.isfinite([theta_i, phi_i]).all():
        raise MeasurementError(
            f"{source.path}: the direction of incidence is {theta[:20]!r}, {phi[:20]!r}; "
            "expected header lines such as `#intheta 30` and `#inphi 180`, in degrees"
        )
    return theta_i, phi_i


def _channels(fields: dict[str, str], source: Source) -> list[Channel]:
    if "lambda" in fields:
        words = fields["lambda"].replace(",", " ").split()[: _MOST_CHANNELS + 1]
        found = [number_or_none(w) for w in words]
        low, high = _WAVELENGTHS
        if not 0 < len(found) <= _MOST_CHANNELS or not all(
            w is not None and low < w < high for w in found
        ):
            raise MeasurementError(
                f"{source.path}: #lambda= {fields['lambda'][:40]}; expected wavelengths in "
                f"nm, {low:g} to {high:g}"
            )
        return [Channel.at(w) for w in found if w is not None]
    colorimetry = fields.get("colorimetry", "").upper()
    if colorimetry == "CIE-XYZ":
        return [Channel(name) for name in "XYZ"]
    return [Channel("Y" if colorimetry == "CIE-Y" else "mono")]


def _check_count(fields: dict[str, str], found: int, notes: list[Note]) -> None:
    stated = fields.get("datapoints_in_file", str(found))
    if stated.strip() != str(found):
        notes.append(
            Note(
                "num-points",
                f"datapoints_in_file is {stated[:20]}; the file has {found} rows",
                found,
            )
        )


def _without_cosine(
    value: NDArray[np.float64], theta_r: NDArray[np.float64], notes: list[Note]
) -> NDArray[np.float64]:
    """The BSDF of a DSF; NaN next to the horizon."""
    cosine = np.abs(np.cos(np.deg2rad(theta_r)))[:, None]
    grazing = cosine < _SMALLEST_COSINE
    notes.append(Note("cosine-divided", "The values are a DSF: divided by cos(theta_r)"))
    if count := int(np.count_nonzero(grazing)):
        notes.append(
            Note(
                "grazing-masked",
                f"rows within 1.1 degrees of the horizon, where dividing a DSF by the "
                f"cosine leaves noise only: {count}; masked",
                count,
            )
        )
    return np.where(grazing, np.nan, value / np.where(grazing, 1.0, cosine))
