"""The tables over all files as CSV, and as HDF5 with one data set per column."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from fitting.batch.summary import FILE_COLUMNS, PARAMETER_COLUMNS, TEXT, Row
from fitting.batch.writing import replace_file

NAMES = ("summary.csv", "parameters.csv", "summary.h5")


def write_summary(
    folder: Path, files: Sequence[Row], parameters: Sequence[Row], *, beside: Path
) -> None:
    """Write ``summary.csv``, ``parameters.csv`` and ``summary.h5``, each in one piece.

    The groups of the last, ``files`` and ``parameters``, have the columns of the others.
    """
    both = {"files": (FILE_COLUMNS, files), "parameters": (PARAMETER_COLUMNS, parameters)}
    for name, (columns, rows) in zip(NAMES, both.values(), strict=False):
        replace_file(folder / name, _csv(columns, rows), beside=beside)
    memory = io.BytesIO()
    with h5py.File(memory, "w") as h5:
        for group, (columns, rows) in both.items():
            for column in columns:
                h5[f"{group}/{column}"] = _column(column, rows)
    replace_file(folder / NAMES[2], memory.getvalue(), beside=beside)


def _csv(columns: Sequence[str], rows: Sequence[Row]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode("utf-8", "surrogateescape")


def _column(name: str, rows: Sequence[Row]) -> np.ndarray:
    values = [row[name] for row in rows]
    if name in TEXT:
        text = [_utf8(v) for v in values]
        return np.array(text, dtype=h5py.string_dtype("utf-8"))
    return np.array([np.nan if v is None else v for v in values], dtype=np.float64)


def _utf8(value: str | float | None) -> str:
    """Text; bytes of a file name that are no UTF-8 are marked as such."""
    text = "" if value is None else str(value)
    return os.fsencode(text).decode("utf-8", "backslashreplace")
