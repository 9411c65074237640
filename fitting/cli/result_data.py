"""The measurement that goes with a result, and names that follow from a result's."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from data_formats import Measurement
from fitting.cli import reading
from fitting.cli.failures import UsageError
from fitting.plots.find_data import DataNotFound, find_data, read_again
from fitting.quantities import channel_span
from fitting.result import FitResult


def data_of(
    result: FitResult,
    path: Path,
    given: Sequence[Path],
    data_format: str | None,
    reader: Mapping[str, Any],
    *,
    called: str = "the result",
) -> tuple[Measurement | None, str | None]:
    """The measurement, and what is to be said about it; or None, and why.

    ``given`` are the files of ``--data``; without, it is looked for where it was. Raises
    `UsageError` if those have other channels than the result, which is ``called`` so.
    """
    if given:
        found = reading.read_files(given, data_format, reader)
        theirs, ours = ([c.name for c in o.channels] for o in (found, result))
        if theirs != ours:
            raise UsageError(
                f"--data {given[0]}: it has {channel_span(theirs)} and {called} has "
                f"{channel_span(ours)}; they must be the same"
            )
        return found, read_again(result, found)
    try:
        found = find_data(result, path, reader=reader)
    except DataNotFound as error:
        return None, str(error)
    different = read_again(result, found)
    return (None, different) if different else (found, None)


def check_data_format(data_format: str | None, given: Sequence[Path]) -> None:
    """Raises `UsageError` for a format of nothing."""
    if data_format is not None and not given:
        raise UsageError("--data-format is that of --data; give that, too")


def check_writable(folder: Path) -> None:
    """Raises `UsageError` if no file can be made in a folder that exists."""
    if not os.access(folder, os.W_OK):
        raise UsageError(f"{folder.resolve()} cannot be written to; choose another with -o")


def stem_of(result: Path) -> str:
    """NAME of NAME.fit.json."""
    return result.name.removesuffix(".json").removesuffix(".fit")
