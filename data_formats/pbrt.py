"""pbrt-v2 text stream (`.brdf`): a list of wavelengths, then angles and values.

`#` begins a comment. All else is one stream of numbers, whatever the line breaks: `n`, then
`n` wavelengths in nm, then records `theta_i phi_i theta_o phi_o v_1 ... v_n`, in radians
and 1/sr; theta beyond pi/2 is behind the surface. Source: `src/materials/measured.cpp` of
pbrt-v2.
"""

from __future__ import annotations

import os

import numpy as np

from data_formats.columns import FOUR_ANGLES, MAX_COLUMNS, Columns
from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.quantity import Quantity, Side
from data_formats.source import Source, load
from data_formats.table import Table, to_measurement

NAME = "pbrt"
SUFFIXES = (".brdf",)

_WAVELENGTHS = (10.0, 1e5)


def sniff(head: bytes) -> bool:
    """Whether the first numbers are a count and as many wavelengths."""
    text = head.decode("latin-1").replace("\r", "\n")
    tokens = " ".join(line.partition("#")[0] for line in text.split("\n")).split(None, 64)
    if len(tokens) < 2 or not _is_count(tokens[0]):
        return False
    # The last token is the unsplit rest.
    some = tokens[1 : min(int(tokens[0]) + 1, len(tokens) - 1)]
    try:
        wavelengths = [float(t) for t in some]
    except ValueError:
        return False
    low, high = _WAVELENGTHS
    return bool(some) and all(low < w < high for w in wavelengths)


def read(
    path: str | os.PathLike[str],
    *,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Measurement:
    """Read a pbrt-v2 measured material.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, or `"brf"`, `"btf"`: reflectance or
        transmittance factors, to be divided by pi; `None`: as the comments say, else 1/sr.
    - `side`: `"transmitted"`: all is transmitted light, and a `theta_r` written on the
        source's side is read as `180 - theta_r`; `"as-written"`: keep it;
        `None`: as the comments say.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    tokens: list[str] = []
    line_of: list[int] = []
    comments: list[str] = []
    for number, line in enumerate(source.lines(), 1):
        content, mark, comment = line.partition("#")
        fields = content.split()
        tokens += fields
        line_of += [number] * len(fields)
        if mark and comment.strip():
            comments.append(comment.strip())
    if not tokens or not _is_count(tokens[0]):
        raise MeasurementError(
            f"{source.path}: the file begins with {' '.join(tokens[:3])[:30]!r}; "
            "expected the number of wavelengths of a pbrt-v2 .brdf file"
        )
    n = int(tokens[0])
    size, rest = 4 + n, len(tokens) - 1 - n
    if rest < size or rest % size:
        raise MeasurementError(
            f"{source.path}: {len(tokens)} numbers do not make whole records of 4 angles "
            f"and {n} values after the {n} wavelengths; is the file cut short?"
        )
    stream = _numbers(source, tokens, line_of)
    wavelengths = stream[1 : n + 1]
    low, high = _WAVELENGTHS
    if not ((wavelengths > low) & (wavelengths < high)).all():
        raise MeasurementError(
            f"{source.path}, line {line_of[1]}: wavelengths from {wavelengths.min():g} to "
            f"{wavelengths.max():g} nm; expected {low:g} to {high:g}"
        )
    table = Table(
        numbers=stream[n + 1 :].reshape(-1, size),
        columns=Columns(
            angles=FOUR_ANGLES,
            channels=[(Channel.at(w), 4 + k) for k, w in enumerate(wavelengths.tolist())],
        ),
        provenance=Provenance(
            path=source.path,
            sha256=source.sha256,
            format=NAME,
            header={"comments": "\n".join(comments)} if comments else {},
        ),
        line_numbers=line_of[n + 1 :: size],
    )
    return to_measurement(table, quantity=quantity, side=side)


def _is_count(token: str) -> bool:
    return len(token) < 7 and token.isdecimal() and 1 <= int(token) <= MAX_COLUMNS


def _numbers(source: Source, tokens: list[str], line_of: list[int]) -> np.ndarray:
    try:
        return np.array(list(map(float, tokens)))
    except ValueError:
        for token, line in zip(tokens, line_of, strict=True):
            if not _is_number(token):
                raise MeasurementError(
                    f"{source.path}, line {line}: {token[:40]!r} is not a number"
                ) from None
        raise


def _is_number(token: str) -> bool:
    try:
        float(token)
    except ValueError:
        return False
    return True
