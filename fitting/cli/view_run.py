"""What ``brdf view`` does: find the data, translate the models, write the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags
from fitting.cli.result_data import check_data_format, check_writable, data_of, stem_of
from fitting.cli.terminal import stderr
from fitting.cli.work import Work
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
    check_data_format(asked.data_format, asked.data)
    path = asked.output or Path()
    if path.suffix.lower() not in _SUFFIXES:
        if not path.is_dir():
            raise UsageError(
                f"{path}: expected a folder that exists, or a file that ends in .html"
            )
        path = path / f"{stem_of(asked.results[0])}.view.html"
    if path.is_dir():
        raise UsageError(f"{path}: is a folder; choose another name with -o")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: the folder {path.parent} does not exist")
    check_writable(path.parent)
    return path


def run(fitted: Sequence[FitResult], asked: Asked, path: Path, flags: Flags) -> None:
    """Write the page; says which fits are shown without their data, and why."""
    measurements = []
    quiet = flags.quiet or not stderr().is_terminal
    with Work(stderr(), len(fitted) + 1, quiet=quiet) as work:
        for k, (result, file) in enumerate(zip(fitted, asked.results, strict=True)):
            work.at(f"reading the data of {file}", k, 0)
            measurement, why = data_of(
                result, file, asked.data, asked.data_format, asked.reader, called=str(file)
            )
            measurements.append(measurement)
            if why and not flags.quiet:
                missing = "" if measurement is not None else ", without measured points"
                stderr().print(f"{file}{missing}: {why}", soft_wrap=True)
        work.at("translating models into shaders", len(fitted), 0)
        try:
            text = page(fitted, measurements, [stem_of(file) for file in asked.results])
        except TranslationError as error:
            raise UsageError(f"view: {error}") from error
    write(text, path)
