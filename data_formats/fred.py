"""FRED tabulated BSDF (`.txt`): blocks of one specular direction and its scattered ones.

    type bsdf_data
    format angles=deg bsdf=value scale=1
    10  0                    theta and phi of the SPECULAR direction, not of the source
    0   0    0.031984        theta, phi and the BSDF of a scattered direction
    10  10   0.034610

A negative theta is at phi + 180 degrees. With `angles=sin` the pairs are direction sines
`alpha beta`, the components of the unit vector in the surface; with `bsdf=log` the values
are decadic logarithms. Values are multiplied by `scale`. The source's azimuth is that of
the specular direction + 180 degrees. Source: the manual of FRED, Photon Engineering,
"Tabulated scatter".
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.number_block import COMMENT_MARKS
from data_formats.provenance import Note
from data_formats.quantity import Quantity, Side
from data_formats.source import Source, load
from data_formats.specular_grid import columns_of
from data_formats.table import Table, to_measurement
from data_formats.token_stream import number_or_none

NAME = "fred"
SUFFIXES = (".txt",)

_MARK = re.compile(rb"(?:\A|[\r\n]|\xef\xbb\xbf)[ \t]*type[ \t]+bsdf_data\b", re.IGNORECASE)
_OPTION = re.compile(r"(\w+)\s*=\s*(\S+)")
_KNOWN = {"angles": ("deg", "sin"), "bsdf": ("value", "log")}
_LONGEST_LINE = 500


def sniff(head: bytes) -> bool:
    """Whether a line is `type bsdf_data`."""
    return _MARK.search(head) is not None


def read(
    path: str | os.PathLike[str],
    *,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Measurement:
    """Read a FRED table.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, or `"brf"`, `"btf"`: reflectance or
        transmittance factors, to be divided by pi; `None`: 1/sr.
    - `side`: `"transmitted"`: all is transmitted light, and a `theta_r` written on the
        source's side is read as `180 - theta_r`; `"as-written"` or `None`: keep it. The
        file does not say which it is.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    lines = source.lines()
    options, start = _options(source, lines)
    rows, line_numbers = _rows(source, lines, start)
    numbers = np.array(rows, dtype=np.float64)
    notes: list[Note] = []
    angles = _Angles(source, line_numbers, options["angles"] == "sin", notes)
    theta_i, phi_i = angles.of(numbers[:, 0], numbers[:, 1], 180.0)
    theta_r, phi_r = angles.of(numbers[:, 2], numbers[:, 3], 0.0)
    value = numbers[:, 4]
    if options["bsdf"] == "log":
        value = 10.0**value
        notes.append(Note("log-converted", "The values are logarithms (bsdf=log): 10**v"))
    scale = number_or_none(options["scale"])
    if scale is None or not 0 < scale < np.inf:
        raise MeasurementError(
            f"{source.path}: scale={options['scale'][:30]}; expected a positive number"
        )
    if scale != 1:
        value = value * scale
        notes.append(Note("scaled", f"Values multiplied by the file's scale={scale:g}"))
    return to_measurement(
        Table(
            numbers=np.column_stack([theta_i, phi_i, theta_r, phi_r, value]),
            columns=columns_of([Channel("mono")], "deg"),
            provenance=Provenance(
                path=source.path, sha256=source.sha256, format=NAME, header=options
            ),
            line_numbers=line_numbers,
            notes=tuple(notes),
        ),
        quantity=quantity or "bsdf",
        side=side or ("as-written" if quantity is None else None),
    )


def _options(source: Source, lines: Sequence[str]) -> tuple[dict[str, str], int]:
    """What the line `format` says, and the index of the line after it."""
    kept = [k for k, line in enumerate(lines) if not _is_comment(line)][:2]
    words = [lines[k][:_LONGEST_LINE].split() for k in kept]
    if not words or [w.lower() for w in words[0]] != ["type", "bsdf_data"]:
        raise MeasurementError(
            f"{source.path}: the first line is not `type bsdf_data`; is this a FRED table?"
        )
    if len(words) < 2 or not words[1] or words[1][0].lower() != "format":
        raise MeasurementError(
            f"{source.path}: the line after `type bsdf_data` does not begin with `format`; "
            "expected such as `format angles=deg bsdf=value scale=1`"
        )
    line = lines[kept[1]][:_LONGEST_LINE].lower()
    options = {"angles": "", "bsdf": "", "scale": "1", **dict(_OPTION.findall(line))}
    for key, known in _KNOWN.items():
        if options[key] not in known:
            raise MeasurementError(
                f"{source.path}, line {kept[1] + 1}: {key}={options[key][:30]}; expected "
                f"{' or '.join(f'{key}={word}' for word in known)}"
            )
    return options, kept[1] + 1


def _rows(
    source: Source, lines: Sequence[str], start: int
) -> tuple[list[list[float]], list[int]]:
    """Five numbers per scattered direction, the first two of its block, and its line."""
    rows: list[list[float]] = []
    line_numbers: list[int] = []
    specular: list[float] = []
    for number, line in enumerate(lines[start:], start + 1):
        if _is_comment(line):
            continue
        where = f"{source.path}, line {number}"
        fields = line[:_LONGEST_LINE].replace(",", " ").split()
        found = [number_or_none(field) for field in fields]
        if len(line) > _LONGEST_LINE or len(fields) not in (2, 3):
            raise MeasurementError(
                f"{where}: the line has {len(fields)} fields; expected two (a specular "
                "direction) or three (a scattered direction and its value)"
            )
        if None in found:
            wrong = fields[found.index(None)]
            raise MeasurementError(f"{where}: {wrong[:40]!r} is not a number")
        values = [x for x in found if x is not None]
        if len(values) == 2:
            specular = values
        elif not specular:
            raise MeasurementError(
                f"{where}: a scattered direction comes before any specular one; expected a "
                "line of two angles first"
            )
        else:
            rows.append([*specular, *values])
            line_numbers.append(number)
    if not rows:
        raise MeasurementError(f"{source.path}: the file has no scattered directions")
    return rows, line_numbers


def _is_comment(line: str) -> bool:
    return not line.strip() or line.lstrip().startswith(COMMENT_MARKS)


@dataclass(frozen=True)
class _Angles:
    source: Source
    line_numbers: Sequence[int]
    sines: bool
    notes: list[Note]

    def of(
        self, first: NDArray[np.float64], second: NDArray[np.float64], turn: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """theta >= 0 and phi in degrees, phi turned by `turn`."""
        if not self.sines:
            back = np.where(first < 0, 180.0, 0.0)
            return np.abs(first), second + back + turn
        length = np.hypot(first, second)
        wrong = ~(length <= 1 + 1e-6)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise MeasurementError(
                f"{self.source.path}, line {self.line_numbers[row]}: the direction sines "
                f"{first[row]:g}, {second[row]:g} are those of no direction; expected at "
                "most 1 for the root of the sum of their squares"
            )
        theta = np.rad2deg(np.arcsin(np.minimum(length, 1.0)))
        return theta, np.rad2deg(np.arctan2(second, first)) + turn
