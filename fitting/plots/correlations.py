"""Correlations of the free parameters: what the data determine together, not apart."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fitting.plots import NoFigure
from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import DIFFERENCE, GREY, INK, MINUS, PALE
from fitting.plots.subject import Subject

DATA = "unused"

_MOST_NUMBERS = 14
_NORM = Normalize(-1.0, 1.0)
_CELL = 0.34
_STRONG = 0.6


def figure(subject: Subject) -> Figure:
    """A matrix per shown channel."""
    found = subject.result.correlations
    names = found.names
    if not names:
        raise NoFigure("no parameter was free")
    if len(names) == 1:
        raise NoFigure(f"only {names[0]} was free")
    several = len(found.matrices) > 1
    shown = subject.chosen if several else [0]
    size = max(_CELL * len(names), 1.6)
    label = 0.075 * max(map(len, names)) + 0.2
    width = max((size + 0.25) * len(shown) + label + 1.0, 5.0)
    out = new_figure(
        subject, "Correlations of the free parameters", (width, size + label + 1.5)
    )
    panels = out.subplots(1, len(shown), squeeze=False, sharey=True)[0]
    for c, axes in zip(shown, panels, strict=True):
        table = np.array(found.matrices[c], dtype=float)
        _panel(axes, table, names)
        if several:
            axes.set_title(subject.names[c])
    out.colorbar(
        ScalarMappable(_NORM, DIFFERENCE),
        ax=panels.tolist(),
        label="correlation",
        shrink=0.85,
        aspect=18,
    )
    notes = (
        ["crossed out: at a bound, without uncertainty"]
        if _any_none(found.matrices)
        else []
    )
    if several and len(shown) < len(found.matrices):
        notes.append(f"{len(shown)} of {len(found.matrices)} channels")
    return finish(out, subject, notes)


def _panel(axes: Axes, table: np.ndarray, names: list[str]) -> None:
    axes.imshow(
        np.ma.masked_invalid(table),
        cmap=DIFFERENCE,
        norm=_NORM,
        aspect="equal",
    )
    axes.set_facecolor(PALE)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    every = np.arange(len(names))
    axes.set_xticks(every, names, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(every, names)
    axes.tick_params(length=0)
    for i, j in np.argwhere(~np.isfinite(table)):
        axes.plot(
            [j - 0.35, j + 0.35], [i + 0.35, i - 0.35], color=GREY, lw=0.7, label="_none"
        )
    if len(names) <= _MOST_NUMBERS:
        for i, j in np.argwhere(np.isfinite(table)):
            if i != j:
                strong = abs(table[i, j]) > _STRONG
                text = f"{table[i, j]:.2f}".replace("-", MINUS).replace("0.", ".")
                axes.text(
                    j, i, text, ha="center", va="center", fontsize=6.5,
                    color="white" if strong else INK,
                )  # fmt: skip


def _any_none(matrices: list) -> bool:
    return any(v is None for matrix in matrices for row in matrix for v in row)
