"""Logarithmic axes that hide nothing: limits, and marks for what has no logarithm."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

# At most so many decades below the largest value are shown.
_DECADES, _MODEL_DECADES = 7.0, 4.0


def log_limits(data: np.ndarray, model: np.ndarray) -> tuple[float, float]:
    """Limits that hold the positive values of the data, up to some decades.

    The model counts down to a few decades below the largest value: its tails may be tiny.
    """
    measured, fitted = (v[np.isfinite(v) & (v > 0)] for v in (data, model))
    every = np.concatenate([measured, fitted])
    if not every.size:
        return 0.1, 10.0
    top = float(every.max())
    bottom = top
    if fitted.size:
        bottom = max(float(np.percentile(fitted, 5.0)), top * 10.0**-_MODEL_DECADES)
    if measured.size:
        # The lowest half percent is noise around zero, and may be cut off.
        least = float(np.percentile(measured, 0.5))
        bottom = min(bottom, max(least, top * 10.0**-_DECADES))
    bottom = min(bottom, 0.5 * top)
    room = (top / bottom) ** 0.06
    return bottom / (1.3 * room), top * 1.2 * room


def mark_unloggable(
    axes: Axes, x: np.ndarray, value: np.ndarray, low: float, *, colour: str
) -> tuple[int, int]:
    """Marks at the lower edge where values are zero or negative, or below the limit.

    Returns how many there are of each.
    """
    none = np.isfinite(value) & (value <= 0)
    below = np.isfinite(value) & (value > 0) & (value < low)
    for where, fill in ((none, "white"), (below, colour)):
        if where.any():
            axes.plot(
                x[where], np.full(int(where.sum()), 0.012),
                linestyle="none", marker="v", markersize=4.5, color=colour,
                markerfacecolor=fill, markeredgewidth=0.9, clip_on=False, zorder=4,
                transform=axes.get_xaxis_transform(), label="_edge",
            )  # fmt: skip
    return int(none.sum()), int(below.sum())


def edge_handles(none: int, below: int, colour: str) -> list[Line2D]:
    """Legend entries of the marks."""
    style = {"linestyle": "none", "marker": "v", "markersize": 4.5, "color": colour}
    out: list[Line2D] = []
    if none:
        text = f"zero or negative ({none})"
        out.append(Line2D([], [], markerfacecolor="white", label=text, **style))
    if below:
        out.append(Line2D([], [], label=f"below the axis ({below})", **style))
    return out


def set_log_scale(axis: Axis, low: float, high: float) -> None:
    """A logarithmic axis between limits, with plain numbers where powers of ten are few."""
    if isinstance(axis, XAxis):
        axis.axes.set_xscale("log")
        axis.axes.set_xlim(low, high)
    else:
        axis.axes.set_yscale("log")
        axis.axes.set_ylim(low, high)
    if math.log10(high / low) < 2.2:
        subs = (1.0, 2.0, 5.0) if math.log10(high / low) > 0.7 else tuple(range(1, 10))
        axis.set_major_locator(LogLocator(subs=subs, numticks=20))
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axis.set_minor_formatter(NullFormatter())


def decade(value: float) -> float:
    """The decade below a positive value, as a power of ten."""
    return 10.0 ** math.floor(math.log10(value))
