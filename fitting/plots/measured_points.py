"""Measured points: those that were fitted and those that were not, with their bars."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fitting.plots.style import GREY, tint
from fitting.plots.subject import Subject


def draw_points(
    axes: Axes, subject: Subject, rows: np.ndarray, x: np.ndarray, channel: int,
    style: dict[str, Any], height: Callable[[np.ndarray], np.ndarray] = np.asarray,
) -> None:  # fmt: skip
    """Values of rows of the data against ``x``; hollow where the fit did not use them.

    Bars are two standard uncertainties to both sides, where the data have them; ``height``
    makes what is drawn of a value.
    """
    m = subject.data
    y, used = m.value[rows, channel], subject.used[rows]
    for some, face in ((used, style["markerfacecolor"]), (~used, "white")):
        if not some.any():
            continue
        if m.sigma is not None:
            bar = 2.0 * m.sigma[rows[some], channel]
            ends = height(y[some] - bar), height(y[some] + bar)
            axes.vlines(
                x[some], ends[0], ends[1], color=style["color"], lw=0.7, zorder=2,
                rasterized=style["rasterized"], label="_sigma",
            )  # fmt: skip
        own: dict[str, Any] = style | {"markerfacecolor": face}
        label = "measured" if some is used else "not fitted"
        axes.plot(x[some], height(y[some]), zorder=3, label=label, **own)


def kinds_of_marks(subject: Subject, *, dotted: bool = True) -> list[Line2D]:
    """Legend entries that tell lines from points."""
    out = [Line2D([], [], color=GREY, label="fit")]
    if subject.measurement is None:
        return out
    if dotted:
        out.append(Line2D([], [], color=GREY, lw=0.7, ls=":", label="fit, beyond the data"))
    style: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": GREY}
    bars = r" ± 2 $\sigma$" if subject.measurement.sigma is not None else ""
    own: dict[str, Any] = style | {"markerfacecolor": tint(GREY)}
    out.append(Line2D([], [], label=f"measured{bars}", **own))
    if not subject.used[subject.measurement.valid.any(axis=1)].all():
        text = "measured, not fitted"
        out.append(Line2D([], [], markerfacecolor="white", label=text, **style))
    return out
