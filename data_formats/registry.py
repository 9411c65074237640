"""Which formats there are, and which of them a file is in."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any, Protocol, cast

import numpy as np

from data_formats import unsupported
from data_formats.measurement import Measurement, MeasurementError
from data_formats.source import Source, load, replacing

# In the order of recognition: the most generic last.
FORMATS = (
    "hdf5",
    "cornell",
    "merl",
    "rgl",
    "kaist",
    "window",
    "alta",
    "astm",
    "zemax",
    "fred",
    "speos",
    "mbsdf",
    "pgii",
    "ssdd",
    "pbrt",
    "utia",
    "csv",
)
ENTRY_POINTS = "data_formats"


class Format(Protocol):
    """What a format's module has; `write(measurement, path)` where it can write."""

    NAME: str
    SUFFIXES: tuple[str, ...]

    def sniff(self, head: bytes) -> bool: ...

    def read(self, path: str | os.PathLike[str], **options: Any) -> Measurement: ...


@dataclass(frozen=True)
class FormatInfo:
    """A format as listed to people.

    **Arguments:**

    - `name`: for `format=`.
    - `suffixes`: of file names, with the dot.
    - `can_write`: whether `write` knows it.
    - `description`: one sentence.
    """

    name: str
    suffixes: tuple[str, ...]
    can_write: bool
    description: str


def formats() -> tuple[FormatInfo, ...]:
    """Every format, those of installed packages included."""
    return tuple(
        FormatInfo(
            name=module.NAME,
            suffixes=tuple(module.SUFFIXES),
            can_write=_writer(module) is not None,
            description=(module.__doc__ or "").strip().partition("\n")[0],
        )
        for module in _all()
    )


def read(
    path: str | os.PathLike[str], *, format: str | None = None, **options: Any
) -> Measurement:
    """Read a file of measured reflectance.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `format`: the name of the format; `None`: by content, then by suffix.
    - `options`: of the format's own `read`.

    **Raises:** `MeasurementError` if the file is missing, unreadable, in no known format,
    or not usable; `TypeError` if the format does not have an option.
    """
    name = os.fspath(path)
    # Not kept: the format loads it again, and a file may have hundreds of megabytes.
    module = _named(format) if format is not None else _recognise(load(path))
    try:
        # Absurd numbers are for the readers to refuse, not for numpy to warn about.
        with np.errstate(all="ignore"):
            return module.read(path, **options)
    except MeasurementError as error:
        if name in str(error):
            raise
        raise MeasurementError(f"{name}: {error}") from error


def write(
    measurement: Measurement, path: str | os.PathLike[str], *, format: str | None = None
) -> None:
    """Write a measurement; an interrupted or failed write leaves no half-written file.

    **Arguments:**

    - `measurement`: what to write.
    - `path`: of the file; replaced if it exists.
    - `format`: the name of the format; `None`: by suffix.

    **Raises:** `MeasurementError` if the format is unknown or cannot be written, or the
    file cannot be.
    """
    if format is not None:
        writer = _writer(_named(format))
    else:
        writer = next(filter(None, map(_writer, _by_suffix(path))), None)
    if writer is None:
        known = [f"{i.name} ({', '.join(i.suffixes)})" for i in formats() if i.can_write]
        raise MeasurementError(
            f"{os.fspath(path)}: no writer for this; the formats that can be written are "
            f"{', '.join(known)}"
        )
    with replacing(path) as beside:
        writer(measurement, beside)


def _writer(module: Format) -> Any:
    return vars(module).get("write")


def _all() -> Iterator[Format]:
    """Every format; installed packages are only looked for when the built-in ones end."""
    for name in FORMATS:
        yield cast(Format, importlib.import_module(f"data_formats.{name}"))
    for entry in entry_points(group=ENTRY_POINTS):
        yield cast(Format, entry.load())


def _named(name: str) -> Format:
    found = next((module for module in _all() if name == module.NAME), None)
    if found is None:
        known = ", ".join(module.NAME for module in _all())
        raise MeasurementError(f"no format is called {name!r}; the formats are {known}")
    return found


def _by_suffix(path: str | os.PathLike[str]) -> list[Format]:
    name = os.fspath(path).lower().removesuffix(".gz")
    return [m for m in _all() if name.endswith(tuple(m.SUFFIXES))]


def _recognise(source: Source) -> Format:
    head = source.head
    for module in _all():
        if module.sniff(head):
            return module
    if what := unsupported.recognise(head):
        raise MeasurementError(
            f"{source.path}: this is {what}; the format is recognised but not supported"
        )
    if modules := _by_suffix(source.path):
        # The most generic: it takes what the others would have recognised.
        return modules[-1]
    known = ", ".join(module.NAME for module in _all())
    raise MeasurementError(
        f"{source.path}: the format is not recognised; the file begins with "
        f"{head[:32]!r} and the formats are {known}"
    )
