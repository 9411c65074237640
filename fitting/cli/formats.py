"""``brdf formats``: which files can be read and written."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import DebugFlag

if TYPE_CHECKING:
    from rich.console import Console

    from data_formats import FormatInfo


def formats(
    name: Annotated[str | None, Parameter(help="Of a format, to describe it.")] = None,
    /,
    *,
    flags: DebugFlag | None = None,
) -> int:
    """List the file formats, or describe one in full."""
    import data_formats
    from fitting.cli.terminal import stdout, table

    out = stdout()
    known = data_formats.formats()
    if name is not None:
        _describe(out, name, known)
        return 0
    rows = table("format", "suffixes", "write", "what it is", left=4)
    for f in known:
        write = "yes" if f.can_write else "no"
        rows.add_row(f.name, " ".join(f.suffixes), write, _plain(f.description))
    out.print(rows)
    out.print(
        "\nFiles are recognised by their content. One format in full: brdf formats NAME",
        style="dim",
    )
    return 0


def _describe(out: Console, name: str, known: tuple[FormatInfo, ...]) -> None:
    from data_formats.registry import FORMATS
    from fitting.cli.assignments import nearest
    from fitting.cli.reading import reader_options
    from fitting.cli.terminal import bullet

    found = next((f for f in known if f.name == name), None)
    if found is None:
        names = [f.name for f in known]
        raise UsageError(f"there is no format {name!r}{nearest(name, names)}")
    out.print(f"{found.name} ({', '.join(found.suffixes)})", style="bold")
    bullet(out, "can be read" + (" and written" if found.can_write else ""))
    modules = [importlib.import_module(f"data_formats.{m}") for m in FORMATS]
    module = next((m for m in modules if name == m.NAME), None)
    if module is None:
        out.print(_plain(found.description))
        return
    for option in reader_options(module):
        bullet(out, f"option of the reader (--reader): {option}")
    out.print()
    out.print(_plain(module.__doc__ or found.description).strip())


def _plain(text: str) -> str:
    return text.replace("``", "").replace("`", "")
