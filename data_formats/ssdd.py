"""Surface scattering distribution data (`.ssdd`): tables over four lists of angles.

Lines of a keyword and its words; `# ` begins a comment; angles in degrees, values in 1/sr:

    VERSION 0.2
    DATA_TYPE brdf                  (btdf, specular_reflectance, specular_transmittance)
    COLOR_MODEL monochrome          (rgb, xyz, spectrum with WAVELENGTH_LIST in nm)
    PARAM_TYPE spherical_coordinate_system
    PARAM0_LIST 0 30 60             theta_i
    PARAM2_LIST 0 45 90             theta_r; PARAM1_LIST, phi_i, is left out if isotropic
    PARAM3_LIST 0 90 180            phi_r
    DATA ascii                      (binary: float32, little endian)
    0.31

The values follow, those of a channel side by side and PARAM0 running fastest. With
`specular_coordinate_system` PARAM2 and PARAM3 are the angle to the specular direction and
the azimuth around it, and PARAM4 is added to the theta of that direction; with
`half_difference_coordinate_system` the four are theta and phi of the half vector and of the
difference. A btdf is mirrored at the surface. Source: "Surface scattering distribution data
file format", version 0.3, K. Ryo, libbsdf.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.half_difference import directions
from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.provenance import Note, one_line
from data_formats.source import Source, load, split_lines
from data_formats.specular_grid import (
    above_horizon,
    around_specular,
    columns_of,
    first_of_repeats,
    left_out_below,
)
from data_formats.table import Table, to_measurement
from data_formats.token_stream import Tokens, number_or_none

NAME = "ssdd"
SUFFIXES = (".ssdd",)

_MARK = re.compile(rb"^DATA_TYPE[ \t]+(?:brdf|btdf|specular_\w+)", re.MULTILINE)
_KEYS = re.compile(
    r"VERSION|SOFTWARE|API|DATE|DATA_TYPE|COLOR_MODEL|WAVELENGTH_LIST|PARAM_TYPE"
    r"|REDUCTION_TYPE|PARAM[0-4]_LIST|NAME|SOURCE_TYPE|DEVICE|CREATION_DATE"
    r"|MEASUREMENT_DATE|DATA"
)
_LISTS = tuple(f"PARAM{k}_LIST" for k in range(5))
_COLORS = {"monochrome": ("mono",), "rgb": ("R", "G", "B"), "xyz": ("X", "Y", "Z")}
_SPECULAR = ("specular_reflectance", "specular_transmittance")
# Of PARAM0 to PARAM3, in degrees.
_MOST = {
    "spherical_coordinate_system": (90, 360, 90, 360),
    "specular_coordinate_system": (90, 360, 180, 360),
    "half_difference_coordinate_system": (90, 360, 90, 360),
}
_LONGEST_LINE = 1_000_000


def sniff(head: bytes) -> bool:
    """Whether a line is `DATA_TYPE` and one of the types."""
    return _MARK.search(head.replace(b"\r", b"\n")) is not None


@dataclass(frozen=True)
class _Block:
    """A table: its keywords, channels, the lists of angles in radians and the values."""

    kind: str
    fields: dict[str, str]
    channels: tuple[Channel, ...]
    angles: tuple[NDArray[np.float64], ...]
    value: NDArray[np.float64]


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a SSDD file.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    header, blocks = _blocks(source)
    notes = [Note("degrees-converted", "Angles converted from degrees to radians")]
    kept = [b for b in blocks if b.kind not in _SPECULAR]
    if len(kept) < len(blocks):
        left = ", ".join(b.kind for b in blocks if b.kind in _SPECULAR)
        notes.append(
            Note(
                "specular-left-out",
                f"The file also has a table of {left}, which is no BSDF; left out",
                len(blocks) - len(kept),
            )
        )
    if not kept:
        raise MeasurementError(f"{source.path}: the file has neither a brdf nor a btdf")
    if len({b.kind for b in kept}) < len(kept) or len({b.channels for b in kept}) > 1:
        kinds = ", ".join(b.kind for b in kept)
        raise MeasurementError(
            f"{source.path}: the tables ({kinds}) have different channels or stand in the "
            "file twice; split it"
        )
    for block in kept:
        header.update({f"{block.kind} {k}": v for k, v in block.fields.items()})
    fields = kept[0].fields
    return to_measurement(
        Table(
            numbers=np.concatenate([_rows(block, notes) for block in kept]),
            columns=columns_of(list(kept[0].channels)),
            provenance=Provenance(
                path=source.path,
                sha256=source.sha256,
                format=NAME,
                instrument=fields.get("DEVICE", ""),
                sample=fields.get("NAME", ""),
                date=fields.get("MEASUREMENT_DATE", ""),
                header=header,
            ),
            notes=tuple(notes),
        ),
        quantity="bsdf",
    )


def _blocks(source: Source) -> tuple[dict[str, str], list[_Block]]:
    """The header of the file and its tables."""
    data = source.data.removeprefix(b"\xef\xbb\xbf")
    header: dict[str, str] = {}
    fields = header
    blocks: list[_Block] = []
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
) -> tuple[_Block, int, int]:
    """A table whose values begin at an offset; the offset and the line after it."""
    kind = fields.get("DATA_TYPE", "")
    if kind not in ("brdf", "btdf", *_SPECULAR):
        raise MeasurementError(f"{where}: DATA without a known DATA_TYPE before it")
    system = fields.get("PARAM_TYPE", "spherical_coordinate_system")
    if system not in _MOST or ("PARAM_TYPE" not in fields and kind not in _SPECULAR):
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
        _Block(kind, clean, channels, angles, value.reshape(*shape, len(channels))),
        offset,
        number,
    )


def _channels(fields: dict[str, str], where: str) -> tuple[Channel, ...]:
    model = fields.get("COLOR_MODEL", "")
    if model in _COLORS:
        return tuple(map(Channel, _COLORS[model]))
    if model != "spectrum":
        raise MeasurementError(
            f"{where}: COLOR_MODEL is {model[:30]!r}; expected one of "
            f"{', '.join(_COLORS)}, spectrum"
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


def _rows(block: _Block, notes: list[Note]) -> NDArray[np.float64]:
    """Four angles in radians and the values, without what is below the horizon."""
    grid = np.meshgrid(*block.angles[3::-1], indexing="ij")
    p3, p2, p1, p0 = (axis.ravel() for axis in grid)
    value = block.value.reshape(len(p0), -1)
    system = block.fields.get("PARAM_TYPE", "")
    if system.startswith("spherical"):
        angles = [p0, p1, p2, p3]
    elif system.startswith("specular"):
        offset = np.broadcast_to(block.angles[4], block.angles[0].shape)
        theta_s = np.broadcast_to(block.angles[0] + offset, grid[3].shape).ravel()
        theta_r, phi_r = around_specular(theta_s, p2, p3)
        angles = [p0, p1, theta_r, phi_r + p1]
    else:
        turned = p1 if len(block.angles[1]) > 1 else None
        angles = directions(p0, p2, p3, turned)
    rows = np.column_stack([*angles, value])
    if not system.startswith("spherical"):
        above = above_horizon(rows[:, 2])
        if system.startswith("half"):
            above &= above_horizon(rows[:, 0])
        left_out_below(~above, value, notes)
        rows = rows[above]
    if block.kind == "btdf":
        rows[:, 2] = np.pi - rows[:, 2]
    return rows[first_of_repeats(rows[:, :4], rows[:, 4:], notes)]
