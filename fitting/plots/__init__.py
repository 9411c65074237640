"""Figures of fit results, one file each, loaded when drawn; matplotlib is only needed then.

    from fitting.plots import draw, names, save
    save(draw("slices", result, measurement), "slices.pdf")

A figure's module has a docstring whose first sentence says what is shown; ``DATA``: whether
the measurement is ``"needed"``, ``"shown"`` if there is one, or ``"unused"``; and
``figure(subject)``, which returns a matplotlib ``Figure`` or raises `NoFigure`.
"""

from __future__ import annotations

import ast
import importlib
import os
from collections.abc import Sequence
from importlib.resources import files
from types import ModuleType
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from data_formats import Measurement
    from fitting.result import FitResult

__all__ = [
    "FIGURES",
    "FORMATS",
    "Listed",
    "NoFigure",
    "PlotsMissing",
    "draw",
    "listed",
    "names",
    "require",
    "save",
]

# In the order in which somebody would look at them.
FIGURES = (
    "slices",
    "polar",
    "lobe",
    "image_slice",
    "beta",
    "sphere",
    "patch",
    "residuals",
    "albedo",
    "spectrum",
    "correlations",
    "starts",
)

FORMATS = ("png", "svg", "pdf")

Use = Literal["needed", "shown", "unused"]


class PlotsMissing(ImportError):
    """matplotlib is not installed."""


class NoFigure(ValueError):
    """Why a figure cannot be drawn, as a sentence."""


class Listed(NamedTuple):
    """A figure as listed to people: what it shows, and what it does with the data."""

    name: str
    shows: str
    data: Use


def names() -> tuple[str, ...]:
    """All figures."""
    return FIGURES


def listed() -> tuple[Listed, ...]:
    """All figures, with what they show; read from their files, without matplotlib."""
    out: list[Listed] = []
    for name in FIGURES:
        tree = ast.parse((files(__name__) / f"{name}.py").read_text("utf-8"))
        shows = (ast.get_docstring(tree) or "").partition("\n\n")[0]
        (use,) = (
            ast.literal_eval(line.value)
            for line in tree.body
            if isinstance(line, ast.Assign) and ast.unparse(line.targets[0]) == "DATA"
        )
        out.append(Listed(name, " ".join(shows.split()), use))
    return tuple(out)


def draw(
    name: str,
    result: FitResult,
    measurement: Measurement | None = None,
    *,
    channels: Sequence[str] = (),
) -> Figure:
    """Draw one figure of a result.

    ``measurement`` are the data to compare with, usually those that were fitted;
    ``channels`` the names of those to show where not all are: by default three spread over
    the spectrum. The figure belongs to no window and no pyplot state.

    Raises ``KeyError`` for an unknown name, `PlotsMissing` without matplotlib, and
    `NoFigure` if there is nothing to draw, which says why.
    """
    if name not in FIGURES:
        raise KeyError(name)
    module = _module(name)
    from fitting.plots.style import styled
    from fitting.plots.subject import Subject

    with styled():
        return module.figure(Subject(result, measurement, tuple(channels)))


def save(
    figure: Figure | Sequence[Figure],
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    dpi: float | None = None,
) -> None:
    """Write a figure, beside the target and then renamed, without the date in it.

    Text stays text in SVG and PDF; ``format`` is one of `FORMATS`, or by suffix; ``dpi`` is
    that of pixels, 200 by default. Several figures are the pages of a PDF. Raises
    ``OSError``, and ``ValueError`` for another format or several figures in one.
    """
    from fitting.plots.saving import write

    pages = list(figure) if isinstance(figure, Sequence) else [figure]
    write(pages, path, format=format, dpi=dpi)


def require() -> None:
    """Raises `PlotsMissing` without matplotlib, in a sentence that says what to do."""
    try:
        importlib.import_module("matplotlib")
    except ModuleNotFoundError as error:
        raise PlotsMissing(
            "figures need matplotlib, which is not installed; install the extra `plots`: "
            "pip install 'brdf-fitting[plots]'"
        ) from error


def _module(name: str) -> ModuleType:
    require()
    return importlib.import_module(f"fitting.plots.{name}")
