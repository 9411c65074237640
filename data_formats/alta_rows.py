"""Header and numbers of an ALTA file, text or binary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.alta_parameters import PARAMETRISATIONS, Parametrisation
from data_formats.columns import MAX_COLUMNS
from data_formats.measurement import MeasurementError
from data_formats.number_block import Dialect, Rows
from data_formats.source import Source, split_lines

_BINARY = re.compile(rb"^#FORMAT[ \t]+binary\b", re.MULTILINE | re.IGNORECASE)
_STREAM = re.compile(rb"^#(?:BEGIN_STREAM|ALTA[_ ]END[_ ]HEADER)[ \t]*\r?\n", re.MULTILINE)
_KEY = re.compile(r"#([A-Za-z]\w*)[ \t]*(.*)")
_NO_FIELD = ("ALTA_BEGIN_HEADER", "ALTA_END_HEADER", "ALTA", "BEGIN_STREAM", "END_STREAM")
WITH_COSINE = "INV_STERADIAN_COSINE_FACTOR"
COLOURS = {"RGB_COLOR": "RGB", "XYZ_COLOR": "XYZ"}
_OUTPUTS = ("INV_STERADIAN", WITH_COSINE, *COLOURS, "UNKNOWN_OUTPUT")


@dataclass(frozen=True)
class Layout:
    """What the header says: the columns of a row are those of `x`, `y` and intervals.

    **Arguments:**

    - `fields`: of the header.
    - `x`: the parametrisation of the directions.
    - `output`: the name of the values.
    - `n_y`: how many there are.
    - `intervals`: for all or each of them 0, or how many numbers an interval has.
    """

    fields: dict[str, str]
    x: Parametrisation
    output: str
    n_y: int
    intervals: tuple[int, ...]


def read_rows(
    source: Source, given: Mapping[str, str]
) -> tuple[Layout, NDArray[np.float64], list[int]]:
    """What the header says, (n, columns) numbers, and the lines of text that they are in.

    **Arguments:**

    - `source`: the file.
    - `given`: header fields that take the place of the file's.

    **Raises:** `MeasurementError` with file and line.
    """
    found = _binary if _BINARY.search(source.head) else _text
    return found(source, dict(given))


def _fields(lines: list[str]) -> dict[str, str]:
    """Header fields; the first of a name counts."""
    found: dict[str, str] = {}
    for line in lines:
        match = _KEY.match(line)
        if match and match[1] not in _NO_FIELD:
            found.setdefault(match[1], match[2].strip().strip('"'))
    return found


def _layout(source: Source, fields: dict[str, str]) -> Layout:
    dimensions = fields.get("DIM", "").split()
    try:
        n_x, n_y = map(int, dimensions)
    except ValueError:
        n_x = n_y = 0
    if not (0 < n_x <= MAX_COLUMNS and 0 < n_y <= MAX_COLUMNS):
        raise MeasurementError(
            f"{source.path}: #DIM is {fields.get('DIM', '')[:40]!r}; expected the numbers "
            "of coordinates and of values in a row"
        )
    name = fields.get("PARAM_IN", "")
    if name not in PARAMETRISATIONS:
        raise MeasurementError(
            f"{source.path}: #PARAM_IN is {name[:40]!r}; supported, also as the option "
            f"param_in, are {', '.join(PARAMETRISATIONS)}"
        )
    parametrisation = PARAMETRISATIONS[name]
    if n_x != len(parametrisation.columns):
        raise MeasurementError(
            f"{source.path}: #DIM gives {n_x} coordinates; {name} has "
            f"{len(parametrisation.columns)}: {', '.join(parametrisation.columns)}"
        )
    output = fields.get("PARAM_OUT", "") or "UNKNOWN_OUTPUT"
    if output not in _OUTPUTS:
        raise MeasurementError(
            f"{source.path}: #PARAM_OUT is {output[:40]!r}, which is no BRDF; supported, "
            f"also as the option param_out, are {', '.join(_OUTPUTS[:-1])}"
        )
    intervals = fields.get("VS", "0").split()
    if not all(text in ("0", "1", "2") for text in intervals) or len(intervals) > n_y:
        raise MeasurementError(
            f"{source.path}: #VS is {fields['VS'][:40]!r}; expected 0, 1 or 2, once or for "
            "each value"
        )
    return Layout(fields, parametrisation, output, n_y, tuple(map(int, intervals)))


def _text(
    source: Source, given: dict[str, str]
) -> tuple[Layout, NDArray[np.float64], list[int]]:
    lines = source.lines()
    layout = _layout(source, _fields(lines) | given)
    first = next(k for k, line in enumerate(lines) if _KEY.match(line))
    rows = Rows.after(source.path, lines, first)
    least = len(layout.x.columns) + layout.n_y
    # ALTA reads intervals of the first value alone, or of each.
    total = sum(layout.intervals)
    widths = {least, least + total}
    if len(layout.intervals) == 1:
        widths.add(least + total * layout.n_y)
    width = len(rows.texts[0].split(None, MAX_COLUMNS * 4))
    if width not in widths:
        raise MeasurementError(
            f"{source.path}, line {rows.line_numbers[0]}: the row has {width} fields; "
            f"expected {' or '.join(map(str, sorted(widths)))}, as #DIM and #VS say"
        )
    names = [
        *layout.x.columns,
        *(f"y_{k}" for k in range(1, width - least + layout.n_y + 1)),
    ]
    return layout, rows.numbers(Dialect(None), names), rows.line_numbers


def _binary(
    source: Source, given: dict[str, str]
) -> tuple[Layout, NDArray[np.float64], list[int]]:
    match = _STREAM.search(source.head)
    if match is None:
        raise MeasurementError(
            f"{source.path}: the header has no end; expected #BEGIN_STREAM or "
            "#ALTA_END_HEADER"
        )
    end = match.end()
    # Both ends may follow each other.
    if again := _STREAM.match(source.head, end):
        end = again.end()
    header = source.data[: match.start()].decode("latin-1")
    layout = _layout(source, _fields(split_lines(header)) | given)
    fields = layout.fields
    orders = {"little": "<f8", "big": ">f8"}
    order = orders.get(fields.get("ENDIAN", "little"))
    if order is None or fields.get("PRECISION", "ieee754-double") != "ieee754-double":
        raise MeasurementError(
            f"{source.path}: the numbers are {fields.get('PRECISION', '')[:40]!r}, "
            f"{fields.get('ENDIAN', '')[:40]!r} endian; expected ieee754-double, little or "
            "big"
        )
    count = fields.get("SAMPLE_COUNT", "")
    if not (count.isdecimal() and count.isascii() and 0 < len(count) < 12 and int(count)):
        raise MeasurementError(
            f"{source.path}: #SAMPLE_COUNT is {count[:40]!r}; expected the number of rows"
        )
    extra = sum(layout.intervals) * (layout.n_y if len(layout.intervals) == 1 else 1)
    width = len(layout.x.columns) + layout.n_y + extra
    size = int(count) * width
    held = (len(source.data) - end) // 8
    if held < size:
        raise MeasurementError(
            f"{source.path}: {count} rows of {width} numbers are {8 * size} bytes, but "
            f"{len(source.data) - end} follow the header; is the file cut short?"
        )
    numbers = np.frombuffer(source.data, order, size, end).astype(np.float64)
    return layout, numbers.reshape(-1, width), []
