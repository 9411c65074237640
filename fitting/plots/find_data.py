"""The file that a result was fitted to: where it lies, and whether it is still the same."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import data_formats
from data_formats import Measurement, MeasurementError
from fitting.result import FitResult
from fitting.sample import sample_path
from fitting.scoring import score

_AND = " + "
_VALUES_OF_A_MODEL = "values of the fitted "
# Of the error that the result states, when it is computed anew.
_SAME = 1e-4


class DataNotFound(ValueError):
    """Why the measurement of a result is not at hand, as a sentence."""


def find_data(
    result: FitResult,
    result_path: Path | None = None,
    *,
    reader: Mapping[str, Any] | None = None,
) -> Measurement:
    """The measurement that a result was fitted to, several files joined.

    Every file is looked for at its path, relative to the current folder and to that of the
    result, then beside the result by its name, and among the bundled samples. Its SHA-256
    has to be the one that the result states. ``reader`` are options of the format's own
    reader. Raises `DataNotFound`.
    """
    data = result.data
    if data.format.startswith(_VALUES_OF_A_MODEL):
        raise DataNotFound(
            f"the result was fitted to {data.format}, not to a file; give a measurement "
            "with --data"
        )
    if not data.path or not data.sha256:
        raise DataNotFound(
            "the result does not tell which file it was fitted to; give it with --data"
        )
    names = data.path.split(_AND)
    candidates = [_candidates(name, result_path) for name in names]
    for name, found in zip(names, candidates, strict=True):
        if not found:
            raise DataNotFound(f"{name} is not there any more; give it with --data")
    # Of one file the content decides among several of that name.
    if len(names) == 1:
        same = [p for p in candidates[0] if _sha256(p) == data.sha256]
        if not same:
            raise DataNotFound(
                f"{candidates[0][0]} has changed since the fit (SHA-256 "
                f"{_sha256(candidates[0][0])[:12]}, expected {data.sha256[:12]}); give the "
                "original with --data"
            )
        return _read(same[:1], data.format, reader)
    files = [found[0] for found in candidates]
    both = hashlib.sha256("".join(map(_sha256, files)).encode()).hexdigest()
    if both != data.sha256:
        raise DataNotFound(
            f"at least one of {', '.join(map(str, files))} has changed since the fit; give "
            "the originals with --data"
        )
    return _read(files, data.format, reader)


def read_again(result: FitResult, measurement: Measurement) -> str | None:
    """What is different from the data of the fit, as a sentence; None if nothing is.

    The error of the fit is computed anew from the values as read now: options of the
    reader, such as the meaning of the values, are not in the result.
    """
    if measurement.provenance.sha256 != result.data.sha256:
        return "these are not the data that were fitted"
    again = "give the options of the reader as for the fit (--reader)"
    if measurement.n_rows != result.data.rows:
        return (
            f"the data have {measurement.n_rows} rows and had {result.data.rows} for the "
            f"fit; if it is the whole file, {again}"
        )
    now, then = score(measurement, result).scores.l2, result.scores.l2
    if math.isclose(now, then, rel_tol=_SAME, abs_tol=1e-12):
        return None
    return (
        f"the values are read in another way than for the fit (its error is {now:.4g} 1/sr "
        f"and was {then:.4g}); {again}"
    )


def _candidates(name: str, result_path: Path | None) -> list[Path]:
    """Files that may be the one of that name, without repeats."""
    stated = Path(name)
    beside = result_path.parent if result_path is not None else Path()
    places = [stated, beside / stated, beside / stated.name, Path(stated.name)]
    if stated.name == sample_path().name:
        places.append(sample_path())
    return [p for p in dict.fromkeys(places) if p.is_file()]


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _read(
    files: Sequence[Path], format: str, reader: Mapping[str, Any] | None
) -> Measurement:
    """Read a file, or all of them; in the format that the result states, if it is one."""
    known = {f.name for f in data_formats.formats()}
    options = dict(reader or {}) | ({"format": format} if format in known else {})
    try:
        found = [data_formats.read(f, **options) for f in files]
        return data_formats.join(*found)
    except MeasurementError as error:
        raise DataNotFound(f"{error}; give the data with --data") from error
