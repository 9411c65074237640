"""Whether the starts of the search agree: how many found the best minimum, and how much
the next one costs.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import BLUE, GREY, INK, ORANGE
from fitting.plots.subject import Subject

DATA = "unused"

_LEAST_RANGE = 1.1


def figure(subject: Subject) -> Figure:
    """Starts as a row of dots, and the costs that the result knows."""
    s = subject.result.solver
    out = new_figure(subject, f"Starts of the search: {s.sentence}", (8.0, 2.9))
    left, right = out.subplots(1, 2, width_ratios=(3, 2))
    _dots(left, s.starts, s.starts_agreeing)
    _costs(right, s.runner_up_cost_ratio)
    notes = [f"cost {s.cost:.6g}", "the result keeps no costs but the two lowest"]
    if not s.converged:
        notes.insert(0, "not converged")
    return finish(out, subject, notes)


def _dots(axes: Axes, starts: int, agreeing: int) -> None:
    at = np.arange(1, starts + 1)
    same = at <= agreeing
    axes.plot(
        at[same], np.zeros(int(same.sum())), ls="none", marker="o", markersize=11,
        color=BLUE, label="agreeing", clip_on=False,
    )  # fmt: skip
    axes.plot(
        at[~same], np.zeros(int((~same).sum())), ls="none", marker="o", markersize=11,
        color=GREY, markerfacecolor="white", label="elsewhere", clip_on=False,
    )  # fmt: skip
    axes.set_xlim(0.3, starts + 0.7)
    axes.set_ylim(-1.0, 1.0)
    axes.set_yticks([])
    axes.grid(False)
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("number of starts")
    title = f"{agreeing} of {starts} reached the best minimum (filled)"
    axes.set_title(title)


def _costs(axes: Axes, ratio: float | None) -> None:
    axes.set_title("cost relative to the best minimum")
    axes.axvline(1.0, color=BLUE, lw=2.0, label="best")
    axes.text(
        1.0, 0.62, " best", color=BLUE, va="center", transform=axes.get_xaxis_transform()
    )
    if ratio is not None:
        axes.axvline(ratio, color=ORANGE, lw=2.0, label="next")
        axes.text(
            ratio, 0.38, f"next: {ratio:.4g} ", color=INK, va="center", ha="right",
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    else:
        axes.text(
            0.5, 0.3, "no other minimum was found", color=GREY, ha="center",
            transform=axes.transAxes,
        )  # fmt: skip
    top = max(_LEAST_RANGE, ratio or 0.0)
    if top > 10.0:
        axes.set_xscale("log")
    room = (top - 1.0) * 0.1 if top <= 10.0 else 0.3 * top
    axes.set_xlim(1.0 - min(room, 0.2), top + room)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("sum of squared residuals (best = 1)")
