"""Whether the starts of the search agree, and how much more the next minimum costs."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import BLUE, GREY, INK, VERMILLION
from fitting.plots.subject import Subject

DATA = "unused"

# What the summary of a fit calls hardly more, and far more.
_HARDLY, _FAR = 1e-3, 1e4
_LEAST, _MOST = 1e-8, 1e8
_FEW = 20


def figure(subject: Subject) -> Figure:
    """Starts as a row of dots, and the cost of the next minimum that the result knows."""
    s = subject.result.solver
    out = new_figure(subject, f"Starts of the search: {s.sentence}", (8.5, 2.9))
    left, right = out.subplots(1, 2, width_ratios=(1, 1))
    _dots(left, s.starts, s.starts_agreeing)
    _next_minimum(right, s.runner_up_cost_ratio)
    notes = [f"cost of the best minimum {s.cost:.6g}"]
    if not s.converged:
        notes.insert(0, "not converged")
    return finish(out, subject, notes)


def _dots(axes: Axes, starts: int, agreeing: int) -> None:
    at = np.arange(1, starts + 1)
    same = at <= agreeing
    size = float(np.clip(180.0 / starts, 3.0, 11.0))
    for some, face, label in ((same, BLUE, "agreeing"), (~same, "white", "elsewhere")):
        axes.plot(
            at[some], np.zeros(int(some.sum())), ls="none", marker="o", markersize=size,
            color=BLUE if some is same else GREY, markerfacecolor=face, label=label,
        )  # fmt: skip
    axes.set_xlim(0.3, starts + 0.7)
    axes.set_ylim(-1.0, 1.0)
    axes.set_yticks([])
    axes.grid(False)
    axes.spines["left"].set_visible(False)
    if starts <= _FEW:
        axes.set_xticks(at)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("starts, those that agree first")
    axes.set_title(f"{agreeing} of {starts} reached the best minimum (filled)")


def _next_minimum(axes: Axes, ratio: float | None) -> None:
    """A logarithmic axis of the excess cost, with what counts as little and as much."""
    axes.set_title("cost of the next minimum")
    axes.set_xscale("log")
    axes.set_xlim(_LEAST, _MOST)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    for edge in (_HARDLY, _FAR):
        axes.axvline(edge, color=GREY, lw=0.8, ls=":", zorder=1, label="_edge")
    for x, text in ((3e-6, "hardly more"), (3.0, "more"), (1e6, "far more")):
        axes.text(x, 0.9, text, ha="center", color=GREY, fontsize=7)
    axes.set_xlabel("(cost - best cost) / best cost")
    if ratio is None:
        axes.text(
            0.5, 0.4, "no start ended in another minimum", color=INK, ha="center",
            transform=axes.transAxes,
        )  # fmt: skip
        return
    excess = float(np.clip(ratio - 1.0, _LEAST, _MOST))
    axes.plot([excess], [0.45], "o", markersize=9, color=VERMILLION, label="next", zorder=3)
    axes.annotate(
        f"{ratio - 1.0:.3g}", (excess, 0.45), xytext=(0, 9), textcoords="offset points",
        ha="center", color=INK,
    )  # fmt: skip
