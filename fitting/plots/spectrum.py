"""Coefficients and other parameters of each channel over the spectrum, with error bands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fitting.plots import NoFigure
from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import BLUE, GREY, VERMILLION
from fitting.plots.subject import Subject
from fitting.quantities import with_uncertainty
from fitting.result import ParameterResult

DATA = "unused"

_COLUMNS = 3
_WIDEST = 3.0


def figure(subject: Subject) -> Figure:
    """A panel per parameter that has a value for each channel."""
    if len(subject.names) < 2:
        raise NoFigure("the result has a single channel, and no spectrum")
    spectral = [p for p in subject.result.parameters if len(p.value) > 1]
    if not spectral:
        raise NoFigure("no parameter has a value for each channel")
    columns = min(_COLUMNS, len(spectral))
    lines = math.ceil(len(spectral) / columns)
    out = new_figure(
        subject, "Parameters over the spectrum", (3.3 * columns + 0.4, 1.4 + 2.2 * lines)
    )
    panels = out.subplots(lines, columns, squeeze=False, sharex=True).ravel()
    for p, axes in zip(spectral, panels, strict=False):
        _panel(axes, subject, p)
    for axes in panels[len(spectral) :]:
        axes.set_axis_off()
    for axes in panels[max(len(spectral) - columns, 0) : len(spectral)]:
        named = subject.wavelengths is None
        axes.set_xlabel("channel" if named else "wavelength (nm)")
        axes.tick_params(labelbottom=True)
    return finish(out, subject, [_shared(subject)], _legend(spectral))


def _panel(axes: Axes, subject: Subject, p: ParameterResult) -> None:
    w = subject.wavelengths
    x = np.arange(len(p.value), dtype=float) if w is None else w
    order = np.argsort(x)
    x, value = x[order], np.array(p.value)[order]
    none = (math.nan, math.nan)
    ends = np.array([none if i is None else i for i in p.interval_95])[order]
    bound = np.array(p.at_bound, dtype=bool)[order]
    many = w is not None and x.size > 4
    if many:
        axes.fill_between(x, ends[:, 0], ends[:, 1], color=BLUE, alpha=0.22, lw=0, zorder=2)
    known = np.isfinite(ends).all(axis=1)
    size = np.abs(ends - value[:, None]).T
    if not many:
        axes.errorbar(
            x[known], value[known], yerr=size[:, known], fmt="none", ecolor=BLUE,
            elinewidth=1.2, capsize=2.5, zorder=2,
        )  # fmt: skip
    line = "-" if many else "none"
    axes.plot(x, value, ls=line, lw=1.2, color=BLUE, zorder=3, label=p.name)
    unknown = ~known & ~bound
    for some, face, colour in (
        (known & ~bound, BLUE, BLUE), (unknown, "white", BLUE), (bound, "white", VERMILLION)
    ):  # fmt: skip
        if p.fixed and some.any():
            colour = face = GREY
        axes.plot(
            x[some], value[some], ls="none", marker="s" if some is bound else "o",
            markersize=3.0 if many else 5.0, color=colour, markerfacecolor=face, zorder=4,
            label="_values",
        )  # fmt: skip
    unit = "" if p.unit in ("", "1") else f" ({p.unit})"
    axes.set_title(f"{p.name}{unit}" + (", fixed" if p.fixed else ""))
    axes.set_ylim(*_limits(value, ends))
    if w is None:
        axes.set_xticks(x, subject.names)
        axes.set_xlim(-0.5, x.size - 0.5)


def _limits(value: np.ndarray, ends: np.ndarray) -> tuple[float, float]:
    """Limits for values and bars; bars much longer than the values' range are cut."""
    low, high = float(value.min()), float(value.max())
    size = max(high - low, 0.05 * abs(high), 1e-12)
    if np.isfinite(ends).any():
        low = max(min(low, float(np.nanmin(ends))), low - _WIDEST * size)
        high = min(max(high, float(np.nanmax(ends))), high + _WIDEST * size)
    room = 0.06 * max(high - low, 0.05 * abs(high), 1e-12)
    return low - room, high + room


def _shared(subject: Subject) -> str:
    """What all channels have in common, with its uncertainty."""
    shared = [p for p in subject.result.parameters if len(p.value) == 1]
    said = [f"{p.name} {with_uncertainty(p.value[0], p.standard_uncertainty[0])}"
            for p in shared]  # fmt: skip
    return "shared by all channels: " + ", ".join(said) if said else ""


def _legend(spectral: list[ParameterResult]) -> list:
    out: list = [Patch(facecolor=BLUE, alpha=0.22, label="95 % interval")]
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.0}
    style: dict[str, Any]
    if any(any(p.at_bound) for p in spectral):
        style = dot | {"marker": "s", "color": VERMILLION, "markerfacecolor": "white"}
        out.append(Line2D([], [], label="at a bound, no interval", **style))
    if any(
        i is None and not b and not p.fixed
        for p in spectral
        for i, b in zip(p.interval_95, p.at_bound, strict=True)
    ):
        style = dot | {"color": BLUE, "markerfacecolor": "white"}
        out.append(Line2D([], [], label="not determined, no interval", **style))
    if any(p.fixed for p in spectral):
        out.append(Line2D([], [], color=GREY, label="fixed", **dot))
    return out
