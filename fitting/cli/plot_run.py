"""What ``brdf plot`` does: find the data, draw figures, write files."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from data_formats import Measurement
from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags
from fitting.cli.result_data import check_data_format, check_writable, data_of, stem_of
from fitting.cli.terminal import stderr
from fitting.cli.work import Work
from fitting.plots import FIGURES, FORMATS, NoFigure, draw, save
from fitting.result import FitResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Asked:
    """The options of the command line."""

    figures: tuple[str, ...]
    data: tuple[Path, ...]
    output: Path | None
    format: str | None
    channels: tuple[str, ...]
    dpi: float | None
    data_format: str | None
    reader: Mapping[str, Any]


class Written(msgspec.Struct, frozen=True):
    """A figure and its file."""

    figure: str
    path: str


class LeftOut(msgspec.Struct, frozen=True):
    """A figure that was not drawn, and why."""

    figure: str
    why: str


class Done(msgspec.Struct, frozen=True):
    """What the command did; ``without_data`` says why there was no measurement."""

    written: list[Written]
    left_out: list[LeftOut]
    without_data: str | None


def check(asked: Asked, result: Path) -> None:
    """Raises `UsageError` for what makes no sense, before any work."""
    for name in asked.figures:
        if name not in FIGURES:
            near = difflib.get_close_matches(name, FIGURES, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(FIGURES)}"
            raise UsageError(f"there is no figure {name!r}; {hint}")
    if asked.dpi is not None and not 10 <= asked.dpi <= 2400:
        raise UsageError(f"--dpi {asked.dpi:g}: expected 10 to 2400")
    check_data_format(asked.data_format, asked.data)
    file = _as_file(asked)
    if file is None:
        folder = asked.output or Path()
        if folder.exists() and not folder.is_dir():
            kinds = ", ".join(f".{k}" for k in FORMATS)
            raise UsageError(
                f"{folder}: exists and is not a folder; expected one, or a file that ends "
                f"in {kinds}"
            )
        parent = folder if folder.exists() else folder.parent
    else:
        if file.resolve() == result.resolve():
            raise UsageError(f"{file}: is the result itself; choose another name with -o")
        several = len(set(asked.figures)) != 1
        if several and _kind(asked) != "pdf":
            raise UsageError(
                f"{file}: several figures do not fit in one {_kind(asked)} file; name one "
                "figure, or give a folder or a .pdf"
            )
        parent = file.parent
    if not parent.is_dir():
        raise UsageError(f"{asked.output}: the folder {parent} does not exist")
    check_writable(parent)


def run(result: FitResult, path: Path, asked: Asked, flags: Flags) -> Done:
    """Draw and write. Figures that were not asked for by name may be left out."""
    _check_channels(result, asked)
    measurement, why = data_of(result, path, asked.data, asked.data_format, asked.reader)
    done = _drawn(result, measurement, why, path, asked, flags)
    if not flags.quiet:
        console = stderr()
        if why:
            text = why if measurement is not None else f"without measured points: {why}"
            console.print(text, soft_wrap=True)
        for item in done.left_out:
            console.print(f"left out: {item.figure} ({item.why})", soft_wrap=True)
    return done


def _drawn(
    result: FitResult,
    measurement: Measurement | None,
    why: str | None,
    path: Path,
    asked: Asked,
    flags: Flags,
) -> Done:
    chosen = tuple(dict.fromkeys(asked.figures)) or FIGURES
    written: list[Written] = []
    left_out: list[LeftOut] = []
    pages: list[Figure] = []
    target = _as_file(asked)
    quiet = flags.quiet or not stderr().is_terminal
    with Work(stderr(), len(chosen), quiet=quiet) as work:
        for k, name in enumerate(chosen):
            work.at(name, k, 0)
            try:
                figure = draw(name, result, measurement, channels=asked.channels)
            except NoFigure as error:
                reason = f"{error}; {why}" if measurement is None and why else str(error)
                if asked.figures:
                    raise UsageError(f"{name}: {reason}") from error
                left_out.append(LeftOut(name, str(error)))
                continue
            if target is not None:
                pages.append(figure)
                written.append(Written(name, str(target)))
                continue
            file = _file_of(name, path, asked)
            file.parent.mkdir(exist_ok=True)
            save(figure, file, format=_kind(asked), dpi=asked.dpi)
            written.append(Written(name, str(file)))
        if target is not None and pages:
            save(pages, target, format=_kind(asked), dpi=asked.dpi)
    return Done(written, left_out, why if measurement is None else None)


def _check_channels(result: FitResult, asked: Asked) -> None:
    known = [c.name for c in result.channels]
    for name in asked.channels:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise UsageError(f"--channel {name}: there is no such channel; {hint}")


def _as_file(asked: Asked) -> Path | None:
    """The file to write, if a file was asked for and not a folder."""
    path = asked.output
    if path is None or path.is_dir() or path.suffix.lstrip(".").lower() not in FORMATS:
        return None
    return path


def _kind(asked: Asked) -> str:
    file = _as_file(asked)
    suffix = "png" if file is None else file.suffix.lstrip(".").lower()
    return asked.format or suffix


def _file_of(name: str, result: Path, asked: Asked) -> Path:
    return (asked.output or Path()) / f"{stem_of(result)}.{name}.{_kind(asked)}"
