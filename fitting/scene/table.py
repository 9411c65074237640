"""Tables of numbers in text files: spectra and histograms of a scene."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fitting.scene.description import SceneError

_MOST_BYTES = 50_000_000


def read_table(path: Path, columns: Sequence[str]) -> np.ndarray:
    """Numbers ``(n, columns)`` of a text file, one row per line.

    Separated by commas, semicolons (then the comma may be decimal), tabs or blanks. A line
    without numbers at the top is a head, ``#`` begins a comment. Raises `SceneError` with
    the line, for a number that is not finite as well.
    """
    expected = f"expected {len(columns)} columns of numbers: {', '.join(columns)}"
    rows: list[list[float]] = []
    for number, line in enumerate(_lines(path, expected), 1):
        text = line.partition("#")[0].strip().lstrip("\ufeff")
        if not text:
            continue
        cells = _cells(text)
        values = [_number(cell) for cell in cells]
        if not rows and all(map(math.isnan, values)):
            continue
        if len(values) != len(columns) or not all(map(math.isfinite, values)):
            raise SceneError(f"{path}: line {number} is {text[:60]!r}; {expected}")
        rows.append(values)
    if not rows:
        raise SceneError(f"{path}: no numbers in it; {expected}")
    return np.array(rows)


def _lines(path: Path, expected: str) -> list[str]:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise SceneError(f"{path}: more than {_MOST_BYTES // 10**6} MB; {expected}")
        return path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not a text file in UTF-8; {expected}") from error
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror or error}; {expected}") from error


def _cells(text: str) -> list[str]:
    if ";" in text:
        return [cell.strip().replace(",", ".") for cell in text.split(";")]
    return re.split(r"\s*,\s*|\s+", text)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
