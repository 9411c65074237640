"""Where text goes: the answer to stdout, everything else to stderr."""

from __future__ import annotations

import os
import sys
import textwrap
from typing import TextIO

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

_PIPED_WIDTH = 100


def stdout() -> Console:
    """For the answer."""
    return _console(sys.stdout)


def stderr() -> Console:
    """For progress and warnings."""
    return _console(sys.stderr)


def _console(stream: TextIO) -> Console:
    # Piped output has no width of its own.
    free = stream.isatty() or "COLUMNS" in os.environ
    return Console(
        file=stream,
        width=None if free else _PIPED_WIDTH,
        highlight=False,
        markup=False,
        emoji=False,
    )


def table(*columns: str, left: int = 1) -> Table:
    """A table with a line under its head and no other lines.

    The first ``left`` columns are text, the others numbers.
    """
    out = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, header_style="bold")
    for k, name in enumerate(columns):
        out.add_column(
            name, justify="left" if k < left else "right", overflow="fold", min_width=3
        )
    return out


def heading(text: str) -> Text:
    """A line that begins a section."""
    return Text(f"\n{text}", style="bold")


def paragraph(out: Console, text: str, style: str = "") -> None:
    """Print a sentence or more, with lines broken between words."""
    out.print(_filled(out, text), style=style, soft_wrap=True)


def bullet(out: Console, text: str, style: str = "") -> None:
    """Print a sentence with a mark, whose further lines are indented."""
    out.print(_filled(out, text, "- ", "  "), style=style, soft_wrap=True)


def _filled(out: Console, text: str, first: str = "", further: str = "") -> str:
    # A percent sign stays with its number.
    lines = textwrap.fill(
        text.replace(" %", "\xa0%"),
        max(out.width, 20),
        initial_indent=first,
        subsequent_indent=further,
        break_on_hyphens=False,
    )
    return lines.replace("\xa0", " ")
