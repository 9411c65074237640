"""Polar diagrams of the plane of incidence, linear and logarithmic in radius.

The normal points up; the distance from the middle is the value in that direction.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from fitting.models import Way
from fitting.plots.canvas import finish, new_figure
from fitting.plots.in_plane import Cut, Palette, cuts, left_out
from fitting.plots.log_axis import log_limits
from fitting.plots.measured_points import draw_points, kinds_of_marks
from fitting.plots.style import GREY, MINUS
from fitting.plots.subject import Subject

DATA = "shown"

_SIDES: tuple[tuple[str, tuple[Way, Way]], ...] = (
    ("lit from the front", ("front", "down")),
    ("lit from the back", ("back", "up")),
)
_MOST = 4
# Inches: of a disc, of title and labels around it, of what is above and below all.
_DIAMETER, _LABELS, _TOP, _BOTTOM = 3.6, 0.95, 0.55, 0.7
# Of the smallest value, at the middle of the logarithmic diagram.
_ROOM = 0.4


def figure(subject: Subject) -> Figure:
    """A linear and a logarithmic diagram for each side that is lit, of one channel."""
    known = subject.ways
    sides: list[tuple[str, list[Way]]] = [
        (t, [w for w in ways if w in known]) for t, ways in _SIDES
    ]
    sides = [(t, ways) for t, ways in sides if ways]
    full = any(w in ("down", "up", "back") for _, ways in sides for w in ways)
    each = _DIAMETER * (1.0 if full else 0.5) + _LABELS
    out = new_figure(
        subject,
        f"{subject.quantity} in the plane of incidence, {subject.names[subject.channel]}",
        (9.0, _TOP + each * len(sides) + _BOTTOM),
        constrained=False,
    )
    palette, notes = Palette(), []
    for k, (title, ways) in enumerate(sides):
        top = _TOP + k * each
        pair = [_axes(out, column, top, full) for column in (0, 1)]
        shown = [cut for way in ways for cut in cuts(subject, way, _MOST)]
        notes += [left_out(subject, way, shown) for way in ways]
        if hidden := _diagrams(subject, shown, pair[0], pair[1], palette):
            notes.append(
                f"{hidden} values that are zero, negative or below the innermost circle "
                "lie in the middle of the logarithmic diagram"
            )
        for axes, scale in zip(pair, ("linear", "logarithmic"), strict=True):
            out.text(
                axes.get_position().x0, 1.0 - top / out.get_figheight(),
                f"{title}, {scale}" if len(sides) > 1 else scale, fontsize=9.5, va="top",
            )  # fmt: skip
    notes.append(
        f"the radius is the {subject.quantity} in 1/sr; a dot at the rim is where the "
        "light comes from"
    )
    handles = palette.handles(points=subject.measurement is not None)
    handles += kinds_of_marks(subject, dotted=False)
    return finish(out, subject, notes, handles)


def _axes(figure: Figure, column: int, top: float, full: bool) -> PolarAxes:
    """Axes of a disc, or of the upper half of one, which takes half of its square."""
    width, height = figure.get_size_inches()
    above = top + _LABELS - 0.25 - (0.0 if full else 0.25 * _DIAMETER)
    left = (column + 0.5) * width / 2.0 - 0.5 * _DIAMETER
    box = (
        left / width, 1.0 - (above + _DIAMETER) / height,
        _DIAMETER / width, _DIAMETER / height,
    )  # fmt: skip
    axes = figure.add_axes(box, projection="polar")
    assert isinstance(axes, PolarAxes)
    _frame(axes, full)
    return axes


def _diagrams(
    subject: Subject, shown: list[Cut], linear: PolarAxes, log: PolarAxes, palette: Palette
) -> int:
    """Draw both; returns how many points have no place on the logarithmic radius."""
    c = subject.channel
    curves, points = [], []
    for cut in shown:
        signed = cut.grid(subject)
        reach = np.abs(cut.angle).max() if cut.rows.size else math.inf
        signed = signed[np.abs(signed) <= reach + 1e-9]
        curves.append(
            (cut, _around(cut, signed), subject.evaluate(*cut.directions(signed)))
        )
        if cut.rows.size:
            good = subject.data.valid[cut.rows, c]
            points.append((cut, cut.rows[good], _around(cut, cut.angle[good])))
    y = np.concatenate([np.zeros(0), *(subject.data.value[r, c] for _, r, _ in points)])
    f = np.concatenate([np.zeros(0), *(v[:, c] for _, _, v in curves)])
    low, high = log_limits(y, f)
    low *= _ROOM
    total = sum(rows.size for _, rows, _ in points)
    for cut, at, value in curves:
        style = palette.line(cut)
        linear.plot(at, value[:, c], zorder=4, label=f"fit, {cut.label}", **style)
        log.plot(
            at, _decades(value[:, c], low), zorder=4, label=f"fit, {cut.label}", **style
        )
        for axes in (linear, log):
            _source(axes, cut, style["color"])
    hidden = 0
    for cut, rows, at in points:
        style = palette.points(cut, total)
        draw_points(linear, subject, rows, at, c, style)
        value = subject.data.value[rows, c]
        hidden += int(np.sum(value < low))
        draw_points(log, subject, rows, at, c, style, lambda v: _decades(v, low))
    top = max(float(y.max(initial=0.0)), float(f.max(initial=0.0))) or 1.0
    linear.set_rlim(0.0, 1.05 * top)
    linear.yaxis.set_major_locator(MaxNLocator(4, prune="lower"))
    _log_radius(log, low, high)
    return hidden


def _around(cut: Cut, signed: np.ndarray) -> np.ndarray:
    """The angle from the normal, clockwise to where a mirror sends light, rad."""
    return signed if cut.way in ("front", "up") else np.sign(signed + 0.0) * (
        math.pi - np.abs(signed)
    )  # fmt: skip


def _decades(value: np.ndarray, low: float) -> np.ndarray:
    return np.log10(np.maximum(value, low) / low)


def _source(axes: PolarAxes, cut: Cut, colour: str) -> None:
    """A dot on the rim where the light comes from."""
    axes.plot(
        [-cut.theta_i], [1.0], transform=axes.get_xaxis_transform(), marker="o",
        markersize=7, color=colour, clip_on=False, zorder=5,
        linestyle="none", label="_source",
    )  # fmt: skip


def _frame(axes: PolarAxes, full: bool) -> None:
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    ticks = np.arange(-150, 181, 30) if full else np.arange(-90, 91, 30)
    labels = [f"{abs(t) if t == 180 else t}°".replace("-", MINUS) for t in ticks]
    axes.set_xticks(np.radians(ticks), labels)
    if not full:
        axes.set_thetalim(-math.pi / 2, math.pi / 2)
    else:
        axes.set_thetalim(-math.pi, math.pi)
        axes.plot(
            [-math.pi / 2, math.pi / 2], [1, 1], transform=axes.get_xaxis_transform(),
            color=GREY, lw=0.8, zorder=1, label="_surface",
        )  # fmt: skip
    axes.tick_params(axis="y", labelsize=7, labelcolor=GREY)
    axes.set_rlabel_position(-90 if not full else -100)


def _log_radius(axes: PolarAxes, low: float, high: float) -> None:
    """Circles at powers of ten."""
    first, last = math.ceil(math.log10(low)), math.floor(math.log10(high))
    step = max(1, math.ceil((last - first) / 5))
    powers = np.arange(first, last + 1, step)
    axes.set_rlim(0.0, math.log10(high / low))
    axes.set_rticks(powers - math.log10(low), [f"$10^{{{p}}}$" for p in powers])
