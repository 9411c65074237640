"""Rows of numbers in text: separators, decimal commas, and what stands for "no value"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import MeasurementError

COMMENT_MARKS = ("#", ";", "!", "%")
_LONGEST_FIELD = 80
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
# What C run-time libraries, spreadsheets and MATLAB write where there is no number.
_NO_VALUE = re.compile(
    r"|[+-]?(?:1\.#\w*|nan(?:\(\w*\))?|inf(?:inity)?|n/?a|null|none|missing|-+)",
    re.ASCII | re.IGNORECASE,
)
_JSON_NUMBERS = msgspec.json.Decoder(list[float])
_WHOLE_NEGATIVE_ZERO = re.compile(r"-0(?![.\deE])")


@dataclass(frozen=True)
class Dialect:
    """How a row is split: `separator` (`None`: blanks), and whether `0,5` is a half."""

    separator: str | None
    decimal_comma: bool = False

    def split(self, row: str) -> list[str]:
        """The fields of a row, without surrounding blanks and quotes."""
        return [f.strip().strip("\"'").strip() for f in row.split(self.separator)]


@dataclass(frozen=True)
class Rows:
    """The data lines of a text, without blank lines and comments.

    **Arguments:**

    - `path`: named in errors.
    - `texts`: the lines, stripped of blanks.
    - `line_numbers`: where each stands in the file, from 1.
    """

    path: str
    texts: list[str]
    line_numbers: list[int]

    @staticmethod
    def after(path: str, lines: Sequence[str], start: int) -> Rows:
        """The data lines from index `start` on.

        **Raises:** `MeasurementError` if there is none.
        """
        kept = [
            (text, number)
            # TABs are fields: a row may begin or end with an empty one.
            for number, line in enumerate(lines[start:], start + 1)
            if (text := line.strip(" ")) and not text.isspace()
            if not text.startswith(COMMENT_MARKS)
        ]
        if not kept:
            raise MeasurementError(f"{path}: no data rows after line {start}")
        return Rows(path, [k[0] for k in kept], [k[1] for k in kept])

    def dialect(self, n_columns: Sequence[int]) -> Dialect:
        """The dialect of the first row, given the numbers of columns that make sense."""
        row = self.texts[0].strip()
        for separator in (";", "\t"):
            if separator in row:
                return Dialect(separator, decimal_comma=any("," in t for t in self.texts))
        if "," not in row:
            return Dialect(None)
        by_blanks, by_commas = row.split(), row.split(",")
        apart = len(by_commas) in n_columns and all(len(f.split()) < 2 for f in by_commas)
        if not apart and len(by_blanks) in n_columns:
            return Dialect(None, decimal_comma=all(f.count(",") <= 1 for f in by_blanks))
        return Dialect(",")

    def width(self, dialect: Dialect, n_columns: int) -> int:
        """Number of columns: that of the first row, less an empty last one."""
        separator = dialect.separator
        count = len(dialect.split(self.texts[0]))
        if count > n_columns and separator is not None:
            # Some writers end rows, all or some, with a separator.
            count -= all(
                t.endswith(separator) or t.count(separator) == count - 2 for t in self.texts
            )
        return count

    def numbers(self, dialect: Dialect, names: Sequence[str]) -> NDArray[np.float64]:
        """(rows, columns) numbers, NaN where there is none.

        **Raises:** `MeasurementError` with the line of the first row that has too few or
        too many fields, or something that is no number.
        """
        clean = self._all_numbers(dialect, len(names))
        if clean is not None:
            return clean
        rows = [
            self._careful(text, number, dialect, names)
            for text, number in zip(self.texts, self.line_numbers, strict=True)
        ]
        return np.array(rows, dtype=np.float64)

    def _all_numbers(self, dialect: Dialect, width: int) -> NDArray[np.float64] | None:
        """All rows at once if every row has `width` plain numbers; otherwise `None`.

        An order of magnitude faster than looking at each field.
        """
        separator = dialect.separator
        if max(map(len, self.texts)) > _LONGEST_FIELD * width:
            return None
        if separator is None:
            if any(len(t.split()) != width for t in self.texts):
                return None
        elif any(t.count(separator) != width - 1 for t in self.texts):
            return None
        joined = (separator or " ").join(self.texts)
        if "_" in joined:  # float() accepts 1_000
            return None
        if dialect.decimal_comma:
            joined = joined.replace(",", ".")
        flat = _as_json(joined) if separator == "," else None
        try:
            if flat is None:
                flat = list(map(float, joined.split(separator)))
        except ValueError:
            return None
        return np.array(flat, dtype=np.float64).reshape(len(self.texts), width)

    def _careful(
        self, text: str, line_number: int, dialect: Dialect, names: Sequence[str]
    ) -> list[float]:
        where = f"{self.path}, line {line_number}"
        separator, width = dialect.separator, len(names)
        too_long = len(text) > _LONGEST_FIELD * (width + 1)
        if separator is not None and text.count(separator) > width:
            count = text.count(separator) + 1
            raise MeasurementError(f"{where}: the row has {count} fields; expected {width}")
        if too_long:
            raise MeasurementError(
                f"{where}: the row has {len(text)} characters, too many for {width} numbers"
            )
        fields = dialect.split(text)
        if len(fields) == width + 1 and not fields[-1]:
            fields.pop()
        if len(fields) != width:
            raise MeasurementError(
                f"{where}: the row has {len(fields)} fields; expected {width}"
            )
        return [
            _number(field, dialect, f"{where}, column {name}")
            for field, name in zip(fields, names, strict=True)
        ]


def _as_json(fields: str) -> list[float] | None:
    """Numbers between commas if they are also written as JSON has it, which most are.

    The same values as by float(), in a third of the time; `None` if any is not.
    """
    if _WHOLE_NEGATIVE_ZERO.search(fields):  # an integer to JSON, without a sign
        return None
    try:
        return _JSON_NUMBERS.decode(f"[{fields}]")
    except msgspec.DecodeError:
        return None


def _number(field: str, dialect: Dialect, where: str) -> float:
    text = field.replace(",", ".") if dialect.decimal_comma else field
    if _NUMBER.fullmatch(text):
        return float(text.replace("d", "e").replace("D", "e"))
    if _NO_VALUE.fullmatch(text):
        return float("nan")
    raise MeasurementError(f"{where}: {field[:40]!r} is not a number")
