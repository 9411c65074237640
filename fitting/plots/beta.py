"""Values against the distance from the mirror direction in sines, log-log: scatter's view.

The horizontal axis is ``|beta - beta_0|`` with ``beta = sin(theta_r)``, signed in the plane
of incidence, and ``beta_0`` that of the mirror direction or of the refracted way through.
Scatter that only depends on the roughness falls on one curve for all angles of incidence
(Harvey and Shack 1978; the ABg model is a straight line of slope -g with a shoulder).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting.plots.canvas import finish, new_figure
from fitting.plots.in_plane import Cut, Palette, cuts, left_out
from fitting.plots.log_axis import edge_handles, log_limits, mark_unloggable, set_log_scale
from fitting.plots.style import GREY, tint
from fitting.plots.subject import WAY_NAMES, Subject

DATA = "shown"

_WIDEST = 2.0
_NEAREST, _LEAST_X = 1e-6, 1e-4
_DOTTED = (0, (1, 1.2))
_SHOULDER = 0.9


def figure(subject: Subject) -> Figure:
    """A panel per way of light, of one channel."""
    ways = subject.ways
    columns = min(len(ways), 2)
    lines = math.ceil(len(ways) / columns)
    c = subject.channel
    out = new_figure(
        subject,
        rf"{subject.quantity} against $|\beta - \beta_0|$, {subject.names[c]}",
        (7.0 if columns == 1 else 9.5, 1.5 + (4.2 if columns == 1 else 3.4) * lines),
    )
    grid = out.subplots(lines, columns, squeeze=False).ravel()
    palette, notes, edge, exact = Palette(), [], np.zeros(2, dtype=int), 0
    for way, axes in zip(ways, grid, strict=False):
        shown = [cut for cut in cuts(subject, way) if not cut.azimuth]
        if shown and shown[0].azimuth is not None:
            notes.append(f"light from {shown[0].azimuth_label}")
        notes.append(left_out(subject, way, shown))
        none, below, at_peak = _panel(subject, shown, axes, palette)
        edge += (none, below)
        exact += at_peak
        axes.set_xlabel(r"$|\beta - \beta_0|$ with $\beta = \sin\,\theta_r$")
        axes.set_ylabel(f"{subject.quantity} (1/sr)")
        if len(ways) > 1:
            axes.set_title(WAY_NAMES[way])
    for axes in grid[len(ways) :]:
        axes.set_axis_off()
    handles = palette.handles(points=subject.measurement is not None, azimuths=False)
    handles += _sides(subject.measurement is not None)
    handles += edge_handles(int(edge[0]), int(edge[1]), GREY)
    if exact:
        text = rf"measured at $\beta_0$ ({exact})"
        handles.append(Line2D([], [], color=GREY, marker="<", ls="none", label=text))
    return finish(out, subject, notes, handles)


def _panel(
    subject: Subject, shown: list[Cut], axes: Axes, palette: Palette
) -> tuple[int, int, int]:
    """Draw it; returns the points at the lower edge, of two kinds, and at the left one."""
    c = subject.channel
    points = []
    for cut in shown:
        good = np.zeros(0, dtype=bool)
        if cut.rows.size:
            good = subject.data.valid[cut.rows, c]
        value = subject.data.value[cut.rows[good], c] if good.size else np.zeros(0)
        points.append((cut, _distance(subject, cut, cut.angle[good]), value))
    near = _nearest(subject, points)
    f, total = [np.zeros(0)], sum(v.size for _, _, v in points)
    for cut, x, y in points:
        style = palette.line(cut)
        reach = float(np.abs(cut.angle).max()) if cut.rows.size else math.inf
        for beyond, dashes in ((False, "-"), (True, _DOTTED)):
            own: dict[str, Any] = style | {"linestyle": dashes}
            at, value = _curve(subject, cut, near, beyond, reach)
            axes.plot(
                at, value[:, c], zorder=4, label=f"fit, {cut.label}", **own,
            )  # fmt: skip
            f.append(value[:, c])
        marks = palette.points(cut, total)
        for some, face in ((x <= 0, marks["markerfacecolor"]), (x > 0, "white")):
            own = marks | {"markerfacecolor": face}
            some = some & (np.abs(x) > _NEAREST) & (y > 0)
            axes.plot(
                np.abs(x[some]), y[some], zorder=3, label="measured", **own,
            )  # fmt: skip
    y = np.concatenate([np.zeros(0), *(v for _, _, v in points)])
    low, high = log_limits(y, np.concatenate(f))
    set_log_scale(axes.xaxis, near / 1.3, _WIDEST)
    set_log_scale(axes.yaxis, low, high)
    none = below = exact = 0
    for cut, x, value in points:
        colour = palette.line(cut)["color"]
        away = np.abs(x) > _NEAREST
        counts = mark_unloggable(axes, np.abs(x[away]), value[away], low, colour=colour)
        none, below = none + counts[0], below + counts[1]
        exact += _mark_peak(axes, value[~away & (value >= low)], near / 1.3, colour)
    return none, below, exact


def _distance(subject: Subject, cut: Cut, signed: np.ndarray) -> np.ndarray:
    """``beta - beta_0``, above zero on the side of grazing."""
    return np.sin(signed) - math.sin(cut.peak(subject))


def _nearest(subject: Subject, points: list[tuple[Cut, np.ndarray, np.ndarray]]) -> float:
    """Where the axis begins: nearer than measured points, on the model's shoulder."""
    near = 1e-2
    for cut, x, _ in points:
        x = np.abs(x)
        near = min(near, float(x[x > _NEAREST].min(initial=near)))
        distance, value = _curve(subject, cut, 2.0 * _LEAST_X, False, math.inf)
        if distance.size:
            own = value[:, subject.channel]
            fallen = np.flatnonzero(own < _SHOULDER * own[0])
            near = min(near, 0.5 * float(distance[fallen[0]]) if fallen.size else near)
    return max(near, _LEAST_X)


def _curve(
    subject: Subject, cut: Cut, near: float, beyond: bool, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Distances and values of the model on one side of the mirror direction."""
    peak = math.sin(cut.peak(subject))
    top = math.sin(min(reach, math.radians(89.5)))
    room = top - peak if beyond else top + peak
    if room <= near / 2:
        return np.zeros(0), np.zeros((0, len(subject.names)))
    distance = np.geomspace(near / 2, room, 160)
    sine = peak + distance if beyond else peak - distance
    signed = np.arcsin(np.clip(sine, -1.0, 1.0))
    return distance, subject.evaluate(*cut.directions(signed))


def _mark_peak(axes: Axes, value: np.ndarray, left: float, colour: str) -> int:
    """Values in the very direction of the peak, at the left edge: their distance is 0."""
    # An empty line outside of the axes would still take part in the layout.
    if value.size:
        axes.plot(
            np.full(value.size, left), value, linestyle="none", marker="<", markersize=4.5,
            color=colour, clip_on=False, zorder=5, label="_peak",
        )  # fmt: skip
    return value.size


def _sides(points: bool) -> list[Line2D]:
    marker = "o" if points else ""
    return [
        Line2D(
            [], [], color=GREY, ls=dashes, marker=marker, markerfacecolor=face, label=text
        )
        for dashes, face, text in (
            ("-", tint(GREY), "towards the source"),
            (_DOTTED, "white", "towards grazing"),
        )
    ]
