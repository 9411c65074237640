"""The tables of an SSDD file: their keywords, lists of angles and values."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Channel, MeasurementError
from data_formats.provenance import one_line
from data_formats.source import Source, split_lines
from data_formats.token_stream import Tokens, number_or_none

_KEYS = re.compile(
    r"VERSION|SOFTWARE|API|DATE|DATA_TYPE|COLOR_MODEL|WAVELENGTH_LIST|PARAM_TYPE"
    r"|REDUCTION_TYPE|PARAM[0-4]_LIST|NAME|SOURCE_TYPE|DEVICE|CREATION_DATE"
    r"|MEASUREMENT_DATE|DATA"
)
_LISTS = tuple(f"PARAM{k}_LIST" for k in range(5))
COLORS = {"monochrome": ("mono",), "rgb": ("R", "G", "B"), "xyz": ("X", "Y", "Z")}
SPECULAR = ("specular_reflectance", "specular_transmittance")
# Of PARAM0 to PARAM3, in degrees.
_MOST = {
    "spherical_coordinate_system": (90, 360, 90, 360),
    "specular_coordinate_system": (90, 360, 180, 360),
    "half_difference_coordinate_system": (90, 360, 90, 360),
}
_LONGEST_LINE = 1_000_000


@dataclass(frozen=True)
class Block:
    """A table.

    **Arguments:**

    - `kind`: `DATA_TYPE`.
    - `fields`: its keywords.
    - `channels`: c channels.
    - `angles`: PARAM0 to PARAM4 in rad, a zero where a list is left out.
    - `value`: (n3, n2, n1, n0, c).
    """

    kind: str
    fields: dict[str, str]
    channels: tuple[Channel, ...]
    angles: tuple[NDArray[np.float64], ...]
    value: NDArray[np.float64]


def blocks_of(source: Source) -> tuple[dict[str, str], list[Block]]:
    """The header of a file and its tables.

    **Raises:** `MeasurementError` with file and line.
    """
    data = source.data.removeprefix(b"\xef\xbb\xbf")
    header: dict[str, str] = {}
    fields = header
    blocks: list[Block] = []
    offset, number = 0, 0
    while offset < len(data):
        end = data.find(b"\n", offset, offset + _LONGEST_LINE)
        end = min(offset + _LONGEST_LINE, len(data)) if end < 0 else end
        number += 1
        line = data[offset:end].decode("utf-8", errors="replace").strip()
        offset = end + 1
        where = f"{source.path}, line {number}"
        key, _, text = line.partition(" ")
        if not line or key.startswith("#"):
            continue
        if not _KEYS.fullmatch(key):
            raise MeasurementError(
                f"{where}: found {line[:30]!r}; expected a keyword such as VERSION, "
                "DATA_TYPE or PARAM0_LIST"
            )
        if key == "DATA_TYPE":
            fields = {}
        fields[key] = text.strip()
        if key == "DATA":
            block, offset, number = _block(fields, source.path, where, data, offset, number)
            blocks.append(block)
            fields = {}
    if not blocks or (fields and fields is not header):
        raise MeasurementError(
            f"{source.path}: a table lacks its DATA; is the file cut short?"
        )
    return {k: one_line(v) for k, v in header.items()}, blocks


def _block(
    fields: dict[str, str], path: str, where: str, data: bytes, offset: int, number: int
) -> tuple[Block, int, int]:
    """A table whose values begin at an offset; the offset and the line after it."""
    kind = fields.get("DATA_TYPE", "")
    if kind not in ("brdf", "btdf", *SPECULAR):
        raise MeasurementError(f"{where}: DATA without a known DATA_TYPE before it")
    system = fields.get("PARAM_TYPE", "spherical_coordinate_system")
    if system not in _MOST or ("PARAM_TYPE" not in fields and kind not in SPECULAR):
        raise MeasurementError(
            f"{where}: PARAM_TYPE of the {kind} is {fields.get('PARAM_TYPE', '')[:40]!r}; "
            f"expected one of {', '.join(_MOST)}"
        )
    channels = _channels(fields, where)
    angles = tuple(_angles(fields, key, where) for key in _LISTS)
    limits = (*_MOST[system], 90)
    widest = [float(np.rad2deg(np.abs(a).max())) for a in angles]
    for key, found, most in zip(_LISTS, widest, limits, strict=True):
        if found > most + 1e-6:
            raise MeasurementError(
                f"{where}: {key} of the {kind} has {found:g}; expected at most {most} "
                "degrees"
            )
    if "PARAM4_LIST" in fields and len(angles[4]) != len(angles[0]):
        raise MeasurementError(
            f"{where}: PARAM4_LIST has {len(angles[4])} angles; expected as many as "
            f"PARAM0_LIST, {len(angles[0])}"
        )
    size = len(channels) * int(np.prod([len(a) for a in angles[:4]], dtype=object))
    mode = fields["DATA"]
    if mode == "binary":
        if len(data) - offset < 4 * size:
            raise MeasurementError(
                f"{where}: {len(data) - offset} bytes follow; {size} values have {4 * size}"
            )
        value = np.frombuffer(data, "<f4", size, offset).astype(np.float64)
        offset += 4 * size
    elif mode == "ascii":
        end = data.find(b"DATA_TYPE", offset)
        end = len(data) if end < 0 else end
        lines = split_lines(data[offset:end].decode("utf-8", errors="replace"))
        tokens = Tokens.of(path, lines, number + 1)
        if len(tokens.words) != size:
            raise MeasurementError(
                f"{where}: {len(tokens.words)} values follow; expected {size}, the product "
                "of the lengths of the lists and the number of channels"
            )
        value = tokens.numbers(size, "values")
        offset, number = end, number + len(lines) - 1
    else:
        raise MeasurementError(f"{where}: DATA is {mode[:30]!r}; expected ascii or binary")
    shape = [len(a) for a in angles[3::-1]]
    clean = {k: one_line(v) for k, v in fields.items()}
    return (
        Block(kind, clean, channels, angles, value.reshape(*shape, len(channels))),
        offset,
        number,
    )


def _channels(fields: dict[str, str], where: str) -> tuple[Channel, ...]:
    model = fields.get("COLOR_MODEL", "")
    if model in COLORS:
        return tuple(map(Channel, COLORS[model]))
    if model != "spectrum":
        raise MeasurementError(
            f"{where}: COLOR_MODEL is {model[:30]!r}; expected one of "
            f"{', '.join(COLORS)}, spectrum"
        )
    wavelengths = _numbers(fields, "WAVELENGTH_LIST", where)
    if len(wavelengths) == 0 or min(wavelengths) <= 0:
        raise MeasurementError(f"{where}: WAVELENGTH_LIST must have wavelengths in nm")
    return tuple(map(Channel.at, wavelengths))


def _angles(fields: dict[str, str], key: str, where: str) -> NDArray[np.float64]:
    """The list in radians; a zero where it is left out."""
    found = _numbers(fields, key, where)
    if not found and (key == "PARAM0_LIST" or key in fields):
        raise MeasurementError(f"{where}: {key} is missing or empty")
    return np.deg2rad(np.array(found or [0.0], dtype=np.float64))


def _numbers(fields: dict[str, str], key: str, where: str) -> list[float]:
    numbers: list[float] = []
    for word in fields.get(key, "").split():
        number = number_or_none(word)
        if number is None or not np.isfinite(number):
            raise MeasurementError(f"{where}: {word[:30]!r} in {key} is not a number")
        numbers.append(number)
    return numbers
