"""What ``brdf report`` does: find the data, draw, write one file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from data_formats.source import replacing
from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags
from fitting.cli.result_data import check_data_format, check_writable, data_of, stem_of
from fitting.cli.terminal import stderr
from fitting.cli.work import Work
from fitting.report import Reported, page
from fitting.report.figures import FIRST, MORE
from fitting.result import FitResult, load_result

_SUFFIXES = (".html", ".htm")


@dataclass(frozen=True)
class Asked:
    """The options of the command line."""

    results: tuple[Path, ...]
    data: tuple[Path, ...]
    output: Path | None
    viewer: bool
    data_format: str | None
    reader: Mapping[str, Any]

    @property
    def target(self) -> Path:
        """Where the report goes."""
        name = f"{stem_of(self.results[0])}.report.html"
        if self.output is None:
            return Path(name)
        return self.output / name if self.output.is_dir() else self.output


class Done(msgspec.Struct, frozen=True):
    """What the command did; ``without_data`` says why a measurement is not in it."""

    path: str
    level: str
    verdict: str
    without_data: str | None


def check(asked: Asked) -> None:
    """Raises `UsageError` for what makes no sense, before any work."""
    target = asked.target
    if target.suffix.lower() not in _SUFFIXES:
        raise UsageError(f"-o {target}: expected a name that ends in .html, or a folder")
    if not target.parent.is_dir():
        raise UsageError(f"{target}: the folder {target.parent} does not exist")
    check_writable(target.parent)
    check_data_format(asked.data_format, asked.data)
    twice = [p for k, p in enumerate(asked.results) if p in asked.results[:k]]
    if twice:
        raise UsageError(f"{twice[0]}: given twice")


def load(asked: Asked) -> list[FitResult]:
    """All results; raises `ResultError`."""
    return [load_result(path) for path in asked.results]


def run(results: Sequence[FitResult], asked: Asked, flags: Flags) -> Done:
    """Draw and write. Without the measurement the report says what it lacks."""
    console = stderr()
    total = len(results) + len(FIRST) + len(MORE)
    with Work(console, total, quiet=flags.quiet or not console.is_terminal) as work:
        done = 0

        def at(name: str) -> None:
            nonlocal done
            work.at(name, done, 0)
            done += 1

        every: list[Reported] = []
        for k, (r, path) in enumerate(zip(results, asked.results, strict=True)):
            at(f"data of {path.name}")
            every.append(_reported(r, path, asked, first=k == 0))
        html = page(every, viewer=asked.viewer, progress=at)
    first = every[0]
    if first.why and not flags.quiet:
        without = "without measured points: " if first.measurement is None else ""
        console.print(f"{without}{first.why}", soft_wrap=True)
    with replacing(asked.target) as beside:
        beside.write_text(html, encoding="utf-8", newline="\n")
    said = first.verdict
    return Done(
        str(asked.target), said.level, said.headline,
        first.why if first.measurement is None else None,
    )  # fmt: skip


def _reported(result: FitResult, path: Path, asked: Asked, *, first: bool) -> Reported:
    """A result with its measurement, and what is to be said about that."""
    given = asked.data if first else ()
    found, why = data_of(result, path, given, asked.data_format, asked.reader)
    return Reported(result, found, why or "", path.name)
