"""Values in the plane of incidence, linear and logarithmic: measured points and fit.

A panel per way of light and channel; a colour and a marker per angle of incidence.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.models import Way
from fitting.plots.canvas import finish, new_figure
from fitting.plots.in_plane import Cut, Palette, cuts, left_out
from fitting.plots.log_axis import edge_handles, log_limits, mark_unloggable, set_log_scale
from fitting.plots.measured_points import draw_points, kinds_of_marks
from fitting.plots.style import GREY
from fitting.plots.subject import WAY_NAMES, Subject

DATA = "shown"

_MOST_ROWS = 4


def figure(subject: Subject) -> Figure:
    """Panels in rows of a linear and a logarithmic one."""
    rows: list[tuple[Way, int]] = [(way, c) for way in subject.ways for c in subject.chosen]
    if len(rows) > _MOST_ROWS:
        rows = [(way, subject.channel) for way in subject.ways]
    height = 1.1 + max(2.4 * len(rows), 2.8)
    out = new_figure(
        subject, f"{subject.quantity} in the plane of incidence", (9.0, height)
    )
    grid = out.subplots(len(rows), 2, squeeze=False, sharex=True)
    notes, palette, edge = [], Palette(), np.zeros(2, dtype=int)
    for (way, c), (linear, log) in zip(rows, grid, strict=True):
        shown = cuts(subject, way)
        edge += _panels(subject, shown, c, linear, log, palette)
        several = len(subject.ways) > 1
        if text := left_out(subject, way, shown):
            notes.append(text)
        title = f"{WAY_NAMES[way]}, {subject.names[c]}" if several else subject.names[c]
        linear.set_title(title)
        log.set_title(f"{title}, logarithmic")
        linear.set_ylabel(f"{subject.quantity} (1/sr)")
    for axes in grid[-1]:
        axes.set_xlabel(r"detector angle in the plane, source $-$, mirror $+$ (deg)")
        axes.set_xlim(-90, 90)
        axes.set_xticks(np.arange(-90, 91, 30))
    handles = palette.handles(points=subject.measurement is not None)
    handles += [*kinds_of_marks(subject), *edge_handles(int(edge[0]), int(edge[1]), GREY)]
    return finish(out, subject, notes, handles)


def _panels(
    subject: Subject, shown: list[Cut], c: int, linear: Axes, log: Axes, palette: Palette
) -> tuple[int, int]:
    """Draw one row; returns how many points are at the lower edge of the right panel."""
    measured, modelled = [np.zeros(0)], [np.zeros(0)]
    marks = []
    total = sum(cut.rows.size for cut in shown)
    for cut in shown:
        style = palette.line(cut)
        signed = cut.grid(subject)
        value = subject.evaluate(*cut.directions(signed))[:, c]
        reach = np.abs(cut.angle).max() if cut.rows.size else np.inf
        inside = np.abs(signed) <= reach + 1e-9
        for axes in (linear, log):
            axes.plot(
                np.degrees(signed),
                value,
                zorder=2,
                **style | {"linewidth": 0.7, "linestyle": ":"},
            )
            axes.plot(
                np.degrees(signed[inside]), value[inside], zorder=4,
                label=f"fit, {cut.label}", **style,
            )  # fmt: skip
        modelled.append(value[inside])
        if not cut.rows.size:
            continue
        m = subject.data
        good = m.valid[cut.rows, c]
        rows, x = cut.rows[good], np.degrees(cut.angle[good])
        for axes in (linear, log):
            draw_points(axes, subject, rows, x, c, palette.points(cut, total))
        measured.append(m.value[rows, c])
        marks.append((x, m.value[rows, c], style["color"]))
    y, f = np.concatenate(measured), np.concatenate(modelled)
    low, high = log_limits(y, f)
    set_log_scale(log.yaxis, low, high)
    counts = [mark_unloggable(log, x, v, low, colour=colour) for x, v, colour in marks]
    top = max(float(np.max(y, initial=0.0)), float(np.max(f, initial=0.0))) or 1.0
    least = float(np.min(y, initial=0.0))
    linear.set_ylim(least - 0.03 * (top - least), top + 0.06 * (top - least))
    linear.set_xlim(-90, 90)
    return sum(n for n, _ in counts), sum(b for _, b in counts)
