"""Reading a file as a command does, and what to call it in the output."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting.cli.failures import UsageError

if TYPE_CHECKING:
    from data_formats import Measurement

RESULT_SUFFIX = ".fit.json"


def read_file(
    path: Path, format: str | None, reader: Mapping[str, Any] | None = None
) -> Measurement:
    """The measurement of a file; ``reader`` are options of the format's own reader.

    A fit result stands for the values of its model, so that another can be fitted to it.
    """
    import data_formats

    if path.name.endswith(RESULT_SUFFIX):
        from fitting.conversion import resample
        from fitting.result import load_result

        return resample(load_result(path))

    if format is not None:
        known = [f.name for f in data_formats.formats()]
        if format not in known:
            raise UsageError(
                f"--format {format}: there is no such format; known: {', '.join(known)}"
            )
    try:
        return data_formats.read(path, format=format, **(reader or {}))
    except TypeError as error:
        if reader and "unexpected keyword argument" in str(error):
            name = str(error).rpartition("'")[0].rpartition("'")[2]
            raise UsageError(
                f"--reader {name}: the reader of {path.name} has no such option; see "
                "`brdf formats NAME`"
            ) from error
        raise


def read_files(
    paths: Sequence[Path], format: str | None, reader: Mapping[str, Any] | None = None
) -> Measurement:
    """The measurement of one file, or of several files of one sample together.

    Raises `UsageError` for the same file twice: its rows would pass for twice the evidence.
    """
    import data_formats

    found = [read_file(path, format, reader) for path in paths]
    seen: dict[str, Path] = {}
    for m, path in zip(found, paths, strict=True):
        if m.provenance.sha256 in seen:
            raise UsageError(
                f"{seen[m.provenance.sha256]} and {path} are the same file; give each once"
            )
        seen[m.provenance.sha256] = path
    return found[0] if len(found) == 1 else data_formats.join(*found)


def reader_options(module: Any) -> list[str]:
    """Options of a format's reader: name, default, and what its documentation says."""
    lines = inspect.cleandoc(module.read.__doc__ or "").split("\n- ")
    said = {k: " ".join(v.partition("\n\n")[0].split()) for k, v in map(_term, lines)}
    return [
        f"{p.name}={p.default}: {said.get(p.name, '')}".rstrip(": ")
        for p in inspect.signature(module.read).parameters.values()
        if p.kind is inspect.Parameter.KEYWORD_ONLY
    ]


def _term(line: str) -> tuple[str, str]:
    name, _, text = line.partition(": ")
    return name.strip("`"), text.replace("`", "")


def stem(path: Path) -> str:
    """The name of a file without its suffix, and without ``.gz``.

    A converted result gets a name that does not overwrite the first one.
    """
    if path.name.endswith(RESULT_SUFFIX):
        return f"{path.name.removesuffix(RESULT_SUFFIX)}.converted"
    name = path.name.removesuffix(".gz")
    return Path(name).stem or name


def headline(measurement: Measurement, *paths: Path) -> str:
    """One line on what the data are."""
    from fitting.quantities import channel_span, count

    names = [c.name for c in measurement.channels]
    sample = measurement.provenance.sample
    about = f" ({sample})" if sample else ""
    rows, files = count(measurement.n_rows, "row"), " + ".join(p.name for p in paths)
    return f"{files}{about}: {rows}, {channel_span(names)}, {measurement.symmetry}"
