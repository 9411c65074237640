"""E1392-style text (`.astm`): a header, a `VARS` line, rows of angles and values.

The de-facto format of gonioreflectometers (Cornell, Light Tec Mini-Diff):

    SYSTEM_NAME Some goniometer
    NUM_POINTS 2
    VARS theta_i,phi_i,theta_s,phi_s,450nm,550nm

    0.5235988,0,0.5235988,3.1415927,0.31,0.35
    0.5235988,0,0.7853982,3.1415927,0.22,0.24

Angles are radians and values 1/sr, unless found otherwise; `theta` beyond 90 degrees is
behind the surface. Wavelengths are in the names of the columns. Source: ASTM E1392-96,
"Angle resolved optical scatter measurements on specular or diffuse surfaces", and the files
written after it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

from data_formats import metadata
from data_formats.columns import MAX_COLUMNS, MAX_NAME, angle_of, clean, identify
from data_formats.measurement import Measurement, MeasurementError
from data_formats.number_block import Rows
from data_formats.provenance import Note
from data_formats.quantity import Quantity, Side
from data_formats.source import Source, load, write_text
from data_formats.table import Table, to_measurement
from data_formats.text_table import Labels, rows_of_text

NAME = "astm"
SUFFIXES = (".astm",)

_VARS = re.compile(rb"(?:\A|[\r\n]|\xef\xbb\xbf)[ \t]*VARS[ \t]")
_KEY = re.compile(r"([A-Z][A-Z0-9_]*)(?:\s+(.*))?", re.DOTALL)


def sniff(head: bytes) -> bool:
    """Whether a line begins with `VARS`."""
    return _VARS.search(head) is not None


@dataclass(frozen=True)
class _Header:
    fields: dict[str, str]
    names: list[str]
    vars_line: int


def read(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    degrees: bool | None = None,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Measurement:
    """Read an E1392-style file.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `strict`: whether a wrong or missing `NUM_POINTS` is an error instead of a note.
    - `degrees`: the unit of the angles; `None`: find out.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, or `"brf"`, `"btf"`: reflectance or
        transmittance factors, to be divided by pi; `None`: as the header says, else 1/sr
        (`quantity=brdf` overrules a header that speaks of BRF).
    - `side`: `"transmitted"`: all is transmitted light, and a `theta_r` written on the
        source's side is read as `180 - theta_r`; `"as-written"`: keep it;
        `None`: as the header says.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    lines = source.lines()
    header = _read_header(source, lines)
    where = f"{source.path}, line {header.vars_line}"
    if strays := _header_after_data(lines, header.vars_line):
        number, key = strays
        raise MeasurementError(
            f"{source.path}, line {number}: header field {key} after the data; expected "
            "one block per file, so split the file there"
        )
    rows = Rows.after(source.path, lines, header.vars_line)
    notes: list[Note] = []
    counts = (len(header.names), len(header.names) + 1)
    dialect = rows.dialect(counts)
    width = rows.width(dialect, len(header.names))
    names = _with_phi_s(header.names, width, where, notes)
    numbers = rows.numbers(dialect, names)
    _check_count(header.fields.get("NUM_POINTS"), len(numbers), source.path, strict, notes)

    own = metadata.stated(header.fields, source.path)
    table = Table(
        numbers=numbers,
        columns=identify(names, where, own),
        provenance=metadata.described(source, NAME, header.fields),
        line_numbers=rows.line_numbers,
        notes=tuple(notes),
        own=own,
    )
    return to_measurement(
        table, degrees=False if own else degrees, quantity=quantity, side=side
    )


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write an E1392-style file that `read` turns into the same measurement, bit for bit.

    Further columns are `sigma_<channel>`, `valid_<channel>` (1 or 0, where a masked value
    is known) and the auxiliary ones; `MEASUREMENT_JSON` in the header holds symmetry,
    notes and provenance.
    """
    labels = Labels.of(measurement)
    angles = ("theta_i", "phi_i", "theta_s", "phi_s")
    names, rows = rows_of_text(measurement, angles, labels)
    fields = dict(metadata.header_fields(measurement.provenance))
    fields[metadata.KEY] = metadata.dump(measurement, labels.channels, labels.auxiliary)
    fields["NUM_POINTS"] = str(measurement.n_rows)
    header = [f"{key} {text}".rstrip() for key, text in fields.items()]
    write_text(path, "\n".join([*header, f"VARS {','.join(names)}", "", *rows, ""]))


def _read_header(source: Source, lines: Sequence[str]) -> _Header:
    fields: dict[str, str] = {}
    for number, line in enumerate(lines, 1):
        match = _KEY.fullmatch(line.strip())
        if match is None:
            continue
        key, text = match[1], (match[2] or "").strip()
        if key == "VARS" and not 0 < len(text) < MAX_COLUMNS * MAX_NAME:
            raise MeasurementError(
                f"{source.path}, line {number}: VARS is followed by {len(text)} "
                "characters; expected the names of the columns"
            )
        if key == "VARS":
            return _Header(fields, _names(text), number)
        fields[key] = text
    raise MeasurementError(
        f"{source.path}: no line begins with VARS, which names the columns; is this an "
        "E1392-style file?"
    )


def _names(text: str) -> list[str]:
    if "," not in text:
        return [clean(n) for n in re.split(r"[;\s]+", text)]
    # "Integrated [300,700]" is one name; a comma outside brackets ends one.
    bracketed = "[" in text and len(text) < MAX_COLUMNS
    parts = re.split(r",(?![^\[\]]*\])", text) if bracketed else text.split(",")
    return [clean(n) for n in parts]


def _header_after_data(lines: Sequence[str], start: int) -> tuple[int, str] | None:
    """Line number and key of the first header field beyond `VARS`."""
    for number, line in enumerate(lines[start:], start + 1):
        if line[:1].isupper() and (match := re.match(r"[A-Z][A-Z0-9_]{2,}(?=\s)", line)):
            return number, match[0]
    return None


def _with_phi_s(names: list[str], width: int, where: str, notes: list[Note]) -> list[str]:
    """The names of all columns: some instruments forget `phi_s`."""
    angles = [found[0] if (found := angle_of(n)) else None for n in names]
    if width == len(names) + 1 and "theta_r" in angles and "phi_r" not in angles:
        place = angles.index("theta_r") + 1
        notes.append(
            Note("phi-s-inserted", "VARS does not name phi_s, but the rows have it")
        )
        return [*names[:place], "phi_s", *names[place:]]
    if width != len(names):
        raise MeasurementError(
            f"{where}: VARS names {len(names)} columns, but the rows have {width}"
        )
    return names


def _check_count(
    stated: str | None, found: int, path: str, strict: bool, notes: list[Note]
) -> None:
    if stated is not None and stated.strip() == str(found):
        return
    what = "is missing" if stated is None else f"is {stated[:20]}"
    sentence = f"NUM_POINTS {what}; the file has {found} rows"
    if strict:
        raise MeasurementError(f"{path}: {sentence}")
    notes.append(Note("num-points", sentence, found))
