"""Delimited tables (`.csv`, `.tsv`, `.txt`) whose columns have names and units.

The header row is the first that names `theta_i` and `theta_r`, under any of their usual
names (`theta_s`, `sza`, `vza`, `Incident_angle`, ...), with a unit or without
(`theta_i_deg`, `phi_r (rad)`). Lines above it are kept as provenance. Columns of values are
called as in E1392 files: `450nm`, `0.45um`, `R`, `brdf`; `sigma_450nm` or `sigma` is their
standard uncertainty. The separator is a comma, a semicolon, a TAB or blanks. A table with
two angles only is in the plane of incidence, with a signed receiver angle that is positive
on the specular side. Angles `theta` beyond 90 degrees are behind the surface. Lines above
the header row that say BRF or BTDF are believed, with a note.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from data_formats import metadata
from data_formats.columns import angle_of, clean, identify
from data_formats.measurement import Measurement, MeasurementError
from data_formats.number_block import Rows
from data_formats.provenance import Note
from data_formats.quantity import Quantity, Side
from data_formats.source import load, split_lines, write_text
from data_formats.table import Table, to_measurement
from data_formats.text_table import Labels, rows_of_text

NAME = "csv"
SUFFIXES = (".csv", ".tsv", ".txt")

_MOST_PREAMBLE = 1000
_SEPARATORS = ("\t", ";", ",", None)
_MOST_CHARACTERS = 1_000_000
_WORD = re.compile(r"[A-Za-z]{2}")
_FIELD = re.compile(r"(\w+(?:[ \t]\w+){0,2})[ \t]*[:=][ \t]*(.*)", re.DOTALL)


@dataclass(frozen=True)
class _Header:
    """The header row: its index, its separator and its names."""

    index: int
    separator: str | None
    names: list[str]


def sniff(head: bytes) -> bool:
    """Whether a line names the angles of incidence and of reflection."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = head.decode("utf-16", errors="replace")
    else:
        text = head.decode("latin-1").removeprefix("\xef\xbb\xbf")
    return _find_header(split_lines(text)) is not None


def read(
    path: str | os.PathLike[str],
    *,
    degrees: bool | None = None,
    quantity: Quantity | None = None,
    side: Side | None = None,
    missing: float | None = None,
) -> Measurement:
    """Read a delimited table.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `degrees`: the unit of angles whose column does not state it; `None`: find out.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, or `"brf"`, `"btf"`: reflectance or
        transmittance factors, to be divided by pi; `None`: as the header says, else 1/sr
        (`quantity=brdf` overrules a header that speaks of BRF).
    - `side`: `"transmitted"`: all is transmitted light, and a `theta_r` written on the
        source's side is read as `180 - theta_r`; `"as-written"`: keep it;
        `None`: as the header says.
    - `missing`: a number that stands for "not measured", such as -1 or -999.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    lines = source.lines()
    header = _find_header(lines)
    if header is None:
        raise MeasurementError(
            f"{source.path}: none of the first lines names the columns; expected a "
            "row such as theta_i_deg,phi_i_deg,theta_r_deg,phi_r_deg,450nm; the file "
            f"begins with {lines[0][:60]!r}"
        )
    where = f"{source.path}, line {header.index + 1}"
    fields = _preamble(lines[: header.index])
    own = metadata.stated(fields, source.path)

    rows = Rows.after(source.path, lines, header.index + 1)
    n_columns = len(header.names)
    dialect = rows.dialect((n_columns,))
    columns = identify(header.names, where, own)
    numbers = rows.numbers(dialect, header.names)
    if missing is not None:
        value_columns = [c for _, c in columns.channels]
        absent = numbers[:, value_columns] == missing
        numbers[:, value_columns] = np.where(absent, np.nan, numbers[:, value_columns])
    table = Table(
        numbers=numbers,
        columns=columns,
        provenance=metadata.described(source, NAME, fields),
        line_numbers=rows.line_numbers,
        own=own,
    )
    measurement = to_measurement(table, degrees=degrees, quantity=quantity, side=side)
    if own or quantity is not None:
        return measurement
    return _perhaps_brf(measurement)


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write a comma-separated table that `read` turns into the same measurement.

    The header row names angles in radians; lines before it begin with `#` and hold the
    header fields and, under `MEASUREMENT_JSON`, symmetry, notes and provenance.
    """
    angles = ("theta_i_rad", "phi_i_rad", "theta_r_rad", "phi_r_rad")
    labels = Labels.of(measurement)
    names, rows = rows_of_text(measurement, angles, labels)
    fields = dict(metadata.header_fields(measurement.provenance))
    fields[metadata.KEY] = metadata.dump(measurement, labels.channels, labels.auxiliary)
    preamble = [f"# {key}: {text}" for key, text in fields.items()]
    write_text(path, "\n".join([*preamble, ",".join(names), *rows, ""]))


def _find_header(lines: Sequence[str]) -> _Header | None:
    scanned = 0
    for index, line in enumerate(lines[:_MOST_PREAMBLE]):
        scanned += len(line)
        if scanned > _MOST_CHARACTERS:
            return None
        if not _WORD.search(line) or not _numbers_follow(lines, index + 1):
            continue
        candidates = [
            _Header(index, separator, _split(line, separator))
            for separator in _SEPARATORS
            if separator is None or separator in line
        ]
        best = max(candidates, key=lambda h: len(_angles(h.names)))
        if {"theta_i", "theta_r"} <= _angles(best.names):
            return best
    return None


def _numbers_follow(lines: Sequence[str], start: int) -> bool:
    """Whether the next line with content begins like a number, or there is none.

    Tells the names of columns from a sentence about them.
    """
    following = (line.strip(" \t\"'") for line in lines[start : start + 10])
    first = next((line[0] for line in following if line), "0")
    return first in "0123456789+-.,;"


def _angles(names: Sequence[str]) -> set[str]:
    return {found[0] for n in names if (found := angle_of(n)) is not None}


def _split(line: str, separator: str | None) -> list[str]:
    names = [clean(n) for n in line.lstrip("# ").split(separator)]
    return names[:-1] if len(names) > 1 and not names[-1] else names


def _preamble(lines: Sequence[str]) -> dict[str, str]:
    """`key: value` lines by key; all others together under `preamble`."""
    fields: dict[str, str] = {}
    others: list[str] = []
    for line in lines:
        text = line.strip().lstrip("#;!% ")
        if match := _FIELD.fullmatch(text):
            fields[match[1]] = match[2].strip()
        elif text:
            others.append(text)
    return fields | ({"preamble": "\n".join(others)} if others else {})


def _perhaps_brf(measurement: Measurement) -> Measurement:
    """A note if the numbers suggest reflectance factors.

    A perfectly white diffuser has a BRDF of 1/pi; only glossy surfaces are brighter, and
    those in few directions.
    """
    m = measurement
    settled = {"perhaps-brf", "brf-divided-by-pi"} & {note.code for note in m.notes}
    if settled or np.median(m.value[m.valid]) <= 1.2 / np.pi:
        return m
    note = Note(
        "perhaps-brf",
        "Most values exceed 1/pi: are they reflectance factors? They were read as BRDF; "
        "quantity='brf' divides them by pi",
    )
    return replace(m, notes=(*m.notes, note))
