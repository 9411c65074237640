"""An empty figure with a title that says what is shown, and a footnote with the rest."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence
from importlib.metadata import version

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from fitting.plots.style import GREY
from fitting.plots.subject import Subject

# Characters per inch of width, of the title's and the footnote's sizes of type.
_TITLE, _FOOTNOTE, _LEGEND = 12.5, 19.0, 15.0
_SMALL, _LEGEND_SIZE = 6.5, 8.0
_EDGE = 0.06


def new_figure(
    subject: Subject, heading: str, size: tuple[float, float], *, constrained: bool = True
) -> Figure:
    """A figure of a size in inches; its title names model and file. See `finish`."""
    figure = Figure(figsize=size, layout="constrained" if constrained else None)
    about = f"{subject.result.model}  |  {subject.source}"
    wide = int(size[0] * _TITLE)
    lines = [*textwrap.wrap(heading, wide), *textwrap.wrap(about, wide)]
    figure.suptitle("\n".join(lines), x=0.01, ha="left")
    return figure


def finish(
    figure: Figure, subject: Subject, notes: Sequence[str], handles: Sequence[Artist] = ()
) -> Figure:
    """Write footnote and legend below all panels, where they cover nothing; the figure.

    Empty notes do not count. To be called once, when all panels are drawn.
    """
    width, height = figure.get_size_inches()
    lines = _footnote(subject, notes, int(width * _FOOTNOTE))
    figure.text(
        0.01, _EDGE / height, "\n".join(lines), ha="left", va="bottom", fontsize=_SMALL,
        color=GREY, gid="footnote",
    )  # fmt: skip
    used = _EDGE + 1.3 * _SMALL * len(lines) / 72.0
    if handles:
        longest = max(_length(str(h.get_label())) for h in handles)
        columns = max(min(int(width * _LEGEND / (longest + 5)), len(handles), 8), 1)
        ordered = _row_by_row(handles, columns)
        figure.legend(
            handles=ordered, ncols=columns, loc="lower left", borderpad=0.0,
            bbox_to_anchor=(0.01, used / height, 0.98, 0.01), borderaxespad=0.5,
        )  # fmt: skip
        rows = math.ceil(len(handles) / columns)
        used += (1.55 * rows + 1.0) * _LEGEND_SIZE / 72.0
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(rect=(0.0, used / height, 1.0, 1.0 - used / height))
    return figure


def _row_by_row(handles: Sequence[Artist], columns: int) -> list[Artist]:
    """In the order in which columns, filled one after another, read row by row."""
    return [h for c in range(columns) for h in handles[c::columns]]


def _footnote(subject: Subject, notes: Sequence[str], wide: int) -> list[str]:
    own = subject.result.versions.get("brdf-fitting")
    program = f"brdf-fitting {version('brdf-fitting')}"
    if own is not None and own != version("brdf-fitting"):
        program += f" (fitted with {own})"
    said = [n for n in notes if n]
    said += [f"objective {subject.result.settings.objective}", program]
    return textwrap.wrap("; ".join(dict.fromkeys(said)), wide)


def _length(label: str) -> int:
    """Characters that are seen, of a label with formulas."""
    return len(re.sub(r"\\[a-z]+|[${}_^]", "x", label).replace("xx", "x"))
