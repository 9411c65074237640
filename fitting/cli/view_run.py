"""What ``brdf view`` does: find the data, translate the models, write the page."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from data_formats import Measurement
from fitting.cli import reading
from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags
from fitting.cli.terminal import stderr
from fitting.cli.work import Work
from fitting.plots.find_data import DataNotFound, find_data, read_again
from fitting.quantities import channel_span
from fitting.result import FitResult
from fitting.viewer import TranslationError, page, write

_SUFFIXES = (".html", ".htm")


@dataclass(frozen=True)
class Asked:
    """The options of the command line."""

    results: tuple[Path, ...]
    data: tuple[Path, ...]
    output: Path | None
    data_format: str | None
    reader: Mapping[str, Any]


def target(asked: Asked) -> Path:
    """The file to write. Raises `UsageError` for what makes no sense, before any work."""
    if asked.data_format is not None and not asked.data:
        raise UsageError("--data-format is that of --data; give that, too")
    path = asked.output or Path()
    if path.suffix.lower() not in _SUFFIXES:
        if not path.is_dir():
            raise UsageError(
                f"{path}: expected a folder that exists, or a file that ends in .html"
            )
        path = path / f"{_stem(asked.results[0])}.view.html"
    if path.is_dir():
        raise UsageError(f"{path}: is a folder; choose another name with -o")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: the folder {path.parent} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise UsageError(
            f"{path.parent.resolve()} cannot be written to; choose another with -o"
        )
    return path


def run(fitted: Sequence[FitResult], asked: Asked, path: Path, flags: Flags) -> None:
    """Write the page; says which fits are shown without their data, and why."""
    measurements = []
    quiet = flags.quiet or not stderr().is_terminal
    with Work(stderr(), len(fitted) + 1, quiet=quiet) as work:
        for k, (result, file) in enumerate(zip(fitted, asked.results, strict=True)):
            work.at(f"reading the data of {file}", k, 0)
            measurement, why = _data(result, file, asked)
            measurements.append(measurement)
            if why and not flags.quiet:
                missing = "" if measurement is not None else ", without measured points"
                stderr().print(f"{file}{missing}: {why}", soft_wrap=True)
        work.at("translating models into shaders", len(fitted), 0)
        try:
            text = page(fitted, measurements, [_stem(file) for file in asked.results])
        except TranslationError as error:
            raise UsageError(f"view: {error}") from error
    write(text, path)


def _data(
    result: FitResult, path: Path, asked: Asked
) -> tuple[Measurement | None, str | None]:
    """The measurement, and what is to be said about it; or None, and why."""
    if not asked.data:
        try:
            found = find_data(result, path, reader=asked.reader)
        except DataNotFound as error:
            return None, str(error)
        different = read_again(result, found)
        return (None, different) if different else (found, None)
    found = reading.read_files(asked.data, asked.data_format, asked.reader)
    theirs, ours = ([c.name for c in o.channels] for o in (found, result))
    if theirs != ours:
        raise UsageError(
            f"--data {asked.data[0]}: it has {channel_span(theirs)} and {path} has "
            f"{channel_span(ours)}; they must be the same"
        )
    return found, read_again(result, found)


def _stem(result: Path) -> str:
    return result.name.removesuffix(".json").removesuffix(".fit")
