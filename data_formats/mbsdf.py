"""NVIDIA MDL measured BSDF (`.mbsdf`): a table over theta_i, theta_r and phi.

The line `NVIDIA ARC MBSDF V1`, lines of metadata, and one or two blocks of data: a line
`MBSDF_DATA_REFLECTION=` (or `MBSDF_DATA=`) or `MBSDF_DATA_TRANSMISSION=`, then, all little
endian, the type (uint32; 0: scalar, 1: RGB), `n_theta`, `n_phi` (uint32) and float32 values
`[theta_i][theta_r][phi][channel]` in 1/sr. The values are those at the centres of equal
cells of theta in [0, 90] and phi in [0, 180] degrees, where phi 180 is specular. Source:
`IBsdf_isotropic_data` of the MDL SDK, and the lookup in its examples.
"""

from __future__ import annotations

import os
import re

import numpy as np
from numpy.typing import NDArray

from data_formats.angle_grid import on_grid
from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.provenance import Note, one_line
from data_formats.source import Source, load, write_bytes
from data_formats.specular_grid import columns_of
from data_formats.table import Table, to_measurement

NAME = "mbsdf"
SUFFIXES = (".mbsdf",)

_TITLE = b"NVIDIA ARC MBSDF V1"
_PARTS = {
    b"MBSDF_DATA=": "reflection",
    b"MBSDF_DATA_REFLECTION=": "reflection",
    b"MBSDF_DATA_TRANSMISSION=": "transmission",
}
_CHANNELS = (("mono",), ("R", "G", "B"))
_FIELD = re.compile(r'(\w+)\s*=\s*"?(.*?)"?')
_LONGEST_LINE = 10_000
# Degrees.
_OFF_CENTRE = 1e-6


def sniff(head: bytes) -> bool:
    """Whether the file begins with `NVIDIA ARC MBSDF`."""
    return head.startswith(b"NVIDIA ARC MBSDF")


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a measured BSDF of MDL.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.

    **Raises:** `MeasurementError` with the offset of what is wrong.
    """
    source = load(path)
    header, tables = _tables(source)
    channels = {table.shape[3] for table in tables.values()}
    if len(channels) > 1:
        raise MeasurementError(
            f"{source.path}: reflection and transmission have different numbers of "
            "channels; split the file"
        )
    notes = [
        Note(
            "cell-centres",
            "Values are of cells; the directions are those of the cells' centres",
        )
    ]
    rows = np.concatenate([_rows(part, table, notes) for part, table in tables.items()])
    names = _CHANNELS[0] if channels == {1} else _CHANNELS[1]
    return to_measurement(
        Table(
            numbers=rows,
            columns=columns_of([Channel(name) for name in names], masks=True),
            provenance=Provenance(
                path=source.path, sha256=source.sha256, format=NAME, header=header
            ),
            notes=tuple(notes),
        ),
        quantity="bsdf",
    )


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write a measured BSDF of MDL: float32 values at the centres of equal cells.

    **Raises:** `MeasurementError` if the directions are not those of the cells' centres,
    the channels are not one or R G B, or values are masked that are not copies at grazing.
    """
    m = measurement
    names = tuple(c.name for c in m.channels)
    if m.n_channels > 1 and names != _CHANNELS[1]:
        raise MeasurementError(
            f"MBSDF holds one channel, or R G B; the channels are {', '.join(names)[:100]}"
        )
    content = _TITLE + b"\n"
    for part, rows in (("reflection", ~m.transmitted), ("transmission", m.transmitted)):
        if not rows.any():
            continue
        some = m.select(rows)
        grid = on_grid(some, "MBSDF")
        if np.abs(grid.value).max() > np.finfo(np.float32).max:
            raise MeasurementError("MBSDF holds float32; some values are beyond 3.4e38")
        table = grid.value[:, 0].astype("<f4")
        n_theta, _, n_phi, n_channels = table.shape
        centres = (np.arange(n_theta) + 0.5) * 90 / n_theta
        asked = (centres, np.zeros(1), centres, (np.arange(n_phi) + 0.5) * 180 / n_phi)
        axes = (grid.theta_i, grid.phi_i, grid.theta_r, grid.phi_r)
        if not all(
            len(a) == len(b) and np.abs(a - b).max() < _OFF_CENTRE
            for a, b in zip(axes, asked, strict=True)
        ):
            raise MeasurementError(
                f"MBSDF holds values at the centres of equal cells of theta from 0 to 90 "
                f"and phi from 0 to 180 degrees; the {part} has other angles; write csv"
            )
        seen = _rows(part, table.astype(np.float64), [])[:, 4 + n_channels :]
        if np.count_nonzero(seen == 0) != np.count_nonzero(~some.valid):
            raise MeasurementError(
                "MBSDF has no masks, and values of this measurement are masked; write csv"
            )
        content += f"MBSDF_DATA_{part.upper()}=\n".encode()
        content += np.array([n_channels == 3, n_theta, n_phi], "<u4").tobytes()
        content += table.tobytes() + b"\n"
    write_bytes(path, content)


def _tables(source: Source) -> tuple[dict[str, str], dict[str, NDArray[np.float64]]]:
    """The metadata, and (theta_i, theta_r, phi, channel) values by part."""
    data = source.data
    title = data[: _LONGEST_LINE + 1].partition(b"\n")[0].rstrip(b"\r")
    if title != _TITLE:
        raise MeasurementError(
            f"{source.path}: the file begins with {data[:32]!r}; expected the line "
            f"{_TITLE.decode()!r}"
        )
    header: dict[str, str] = {}
    tables: dict[str, NDArray[np.float64]] = {}
    offset = data.index(b"\n") + 1 if b"\n" in data else len(data)
    while offset < len(data):
        end = data.find(b"\n", offset, offset + _LONGEST_LINE)
        if end < 0:
            if not data[offset:].strip():
                break
            raise MeasurementError(
                f"{source.path}, offset {offset}: found {data[offset : offset + 24]!r}; "
                f"expected a line of metadata or one of {b', '.join(_PARTS).decode()}"
            )
        line = data[offset:end].rstrip(b"\r")
        part = _PARTS.get(line)
        if part is None:
            _add(line, header, source, offset)
            offset = end + 1
        elif part in tables:
            raise MeasurementError(
                f"{source.path}, offset {offset}: a second block of {part}; expected one"
            )
        else:
            tables[part], offset = _table(source, end + 1)
    if not tables:
        raise MeasurementError(
            f"{source.path}: the file has no block of data; expected one of "
            f"{b', '.join(_PARTS).decode()}"
        )
    return header, tables


def _add(line: bytes, header: dict[str, str], source: Source, offset: int) -> None:
    text = line.decode("utf-8", errors="replace").strip()
    if not text:
        return
    match = _FIELD.fullmatch(text)
    if match is None:
        raise MeasurementError(
            f"{source.path}, offset {offset}: found {line[:24]!r}; expected metadata such "
            'as `key="text"`, or a block of data'
        )
    header[match[1]] = one_line(match[2])


def _table(source: Source, offset: int) -> tuple[NDArray[np.float64], int]:
    """The values of a block that begins at an offset, and the offset of its end."""
    data = source.data
    if len(data) < offset + 12:
        raise MeasurementError(
            f"{source.path}, offset {offset}: the file ends before the size of the table"
        )
    kind, n_theta, n_phi = np.frombuffer(data, "<u4", 3, offset).tolist()
    if kind >= len(_CHANNELS) or not n_theta or not n_phi:
        raise MeasurementError(
            f"{source.path}, offset {offset}: the table is of type {kind} with {n_theta} "
            f"theta and {n_phi} phi; expected type 0 or 1 and at least one of each"
        )
    shape = (n_theta, n_theta, n_phi, len(_CHANNELS[kind]))
    size = n_theta * n_theta * n_phi * shape[3]
    start = offset + 12
    if len(data) - start < 4 * size:
        raise MeasurementError(
            f"{source.path}, offset {start}: {len(data) - start} bytes are left; a table "
            f"of {n_theta} x {n_theta} x {n_phi} x {shape[3]} values has {4 * size}; is "
            "the file cut short?"
        )
    values = np.frombuffer(data, "<f4", size, start).reshape(shape)
    return values.astype(np.float64), start + 4 * size


def _rows(part: str, table: NDArray[np.float64], notes: list[Note]) -> NDArray[np.float64]:
    """Four angles in radians, values and masks."""
    n_theta, _, n_phi, n_channels = table.shape
    theta = (np.arange(n_theta) + 0.5) * (np.pi / 2 / n_theta)
    phi = (np.arange(n_phi) + 0.5) * (np.pi / n_phi)
    grid = np.meshgrid(theta, theta, phi, indexing="ij")
    theta_i, theta_r, phi_r = (axis.ravel() for axis in grid)
    if part == "transmission":
        theta_r = np.pi - theta_r
    copied_i, copied_r = _copies_at_end(table), _copies_at_end(np.swapaxes(table, 0, 1))
    copied = np.zeros(table.shape[:3], dtype=bool)
    copied[n_theta - copied_i :] = True
    copied[:, n_theta - copied_r :] = True
    if count := int(np.count_nonzero(copied)):
        notes.append(
            Note(
                "copies-masked",
                f"cells of {part} at the {copied_i} largest theta_i and the {copied_r} "
                f"largest theta_r that repeat those before them exactly: {count}; not "
                "measured, masked",
                count,
            )
        )
    valid = np.repeat(~copied.reshape(-1, 1), n_channels, axis=1)
    value = table.reshape(-1, n_channels)
    return np.column_stack([theta_i, np.zeros(len(value)), theta_r, phi_r, value, valid])


def _copies_at_end(table: NDArray[np.float64]) -> int:
    """How many of the last slices repeat the one before; 0 if all slices are the same."""
    last = k = len(table) - 1
    while k > 0 and np.array_equal(table[k], table[k - 1]):
        k -= 1
    return last - k if k else 0
