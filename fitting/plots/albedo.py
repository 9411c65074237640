"""Directional albedo against the angle of incidence, under its energy limit of 1.

What is reflected, transmitted, and both together; sums over measured rows, with their
uncertainty and how much of the hemisphere they cover.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from data_formats import MeasurementError
from fitting.albedo import LEAVING, Side, lit_sides, model_albedo
from fitting.compiled import compiled
from fitting.model import Model
from fitting.models import Way
from fitting.models.lobe import THROUGH
from fitting.plots import NoFigure
from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import BLUE, GREY, INK, MARKERS, VERMILLION, tint
from fitting.plots.subject import Subject
from fitting.reflectance.beams import Directional, Hemispherical
from fitting.reflectance.measured import measured
from fitting.solid_angle import from_normal, incidence_labels

DATA = "shown"

THETA_DEG = np.concatenate([np.arange(0.0, 80.0, 2.0), np.arange(80.0, 90.0, 0.5)])
_NODES = 32
_MOST_SUMS = 12
_SAME_DEG = 0.9
_SAMPLE_AZIMUTHS_DEG = (0.0, 90.0)


class _Curve(NamedTuple):
    """What is shown of one side: a name, ways of light, a channel, and how it is drawn."""

    label: str
    ways: tuple[Way, ...]
    channel: int
    style: dict[str, Any]
    marker: str


class _Sum(NamedTuple):
    theta_deg: float
    value: float
    uncertainty: float
    covered: float


def figure(subject: Subject) -> Figure:
    """A panel per side that light comes from, with the coverage of the data below it."""
    sides: list[Side] = [
        s for s in lit_sides(subject.model) if set(LEAVING[s]) & set(subject.ways)
    ]
    if not sides:
        raise NoFigure("the model does nothing with light from the side that was measured")
    curves: dict[Side, list[_Curve]] = {s: _curves(subject, s) for s in sides}
    sums = {s: [_measured(subject, s, c) for c in curves[s]] for s in sides}
    some = any(found for of_side in sums.values() for found, _ in of_side)
    out = new_figure(
        subject,
        "Directional albedo",
        (6.8 if len(sides) == 1 else 10.0, 5.6 if some else 4.6),
    )
    ratios = (5, 1) if some else (1,)
    grid = out.subplots(
        len(ratios), len(sides), squeeze=False, sharex=True, sharey="row",
        height_ratios=ratios,
    )  # fmt: skip
    notes: list[str] = []
    for column, side in zip(grid.T, sides, strict=True):
        _draw_model(column[0], subject, side, curves[side])
        for (found, why), curve in zip(sums[side], curves[side], strict=True):
            if found:
                _draw_sums(column[0], column[1], found, curve)
            notes += [f"no sums of the data: {why}"] if why else []
        column[-1].set_xlabel(r"$\theta_i$ (deg from the normal)")
        column[-1].set_xlim(-1.5, 90)
        column[-1].set_xticks(np.arange(0, 91, 15))
        if len(sides) > 1:
            column[0].set_title(f"lit from the {side}")
    grid[0, 0].set_ylabel("albedo (share of the light)")
    top = max(float(axes.get_ylim()[1]) for axes in grid[0])
    for axes in grid[0]:
        _draw_limit(axes, max(top, 1.08))
    if some:
        grid[1, 0].set_ylabel("covered")
        grid[1, 0].set_ylim(0.0, 1.05)
        grid[1, 0].set_yticks([0, 0.5, 1])
        notes.append(
            "bars are two standard uncertainties; what rows do not cover is extrapolated "
            "from the nearest ring"
        )
    return finish(out, subject, notes, _legend(subject, curves, some))


def _curves(subject: Subject, side: Side) -> list[_Curve]:
    known = subject.model.ways
    ways: tuple[Way, ...] = tuple(w for w in LEAVING[side] if w in known)
    through: tuple[Way, ...] = tuple(w for w in ways if w in THROUGH)
    back: tuple[Way, ...] = tuple(w for w in ways if w not in THROUGH)
    if not through or not back:
        only = "transmitted" if through else "reflected"
        return [_alone(subject, only, ways, k) for k in range(len(subject.chosen))]
    c, name = subject.channel, subject.names[subject.channel]
    return [
        _Curve(f"reflected, {name}", back, c, {"color": BLUE}, "o"),
        _Curve(f"transmitted, {name}", through, c, {"color": VERMILLION}, "s"),
        _Curve(f"together, {name}", ways, c, {"color": INK}, "D"),
    ]


def _alone(subject: Subject, what: str, ways: tuple[Way, ...], k: int) -> _Curve:
    c = subject.chosen[k]
    marker = MARKERS[k % len(MARKERS)]
    label = f"{what}, {subject.names[c]}"
    return _Curve(label, ways, c, {"color": subject.colours[c]}, marker)


def albedo_curve(
    subject: Subject, ways: tuple[Way, ...], azimuth_deg: float = 0.0
) -> np.ndarray:
    """The model's albedo ``(k, c)`` at `THETA_DEG`."""
    with jax.enable_x64(True):
        values = {k: jnp.asarray(v, jnp.float64) for k, v in subject.result.values.items()}
        cosines = jnp.asarray(np.cos(np.radians(THETA_DEG)))
        azimuth = jnp.asarray(math.radians(azimuth_deg))
        found = np.asarray(_albedo(subject.model, values, cosines, azimuth, ways))
    return np.broadcast_to(
        found.reshape(THETA_DEG.size, -1), (THETA_DEG.size, len(subject.names))
    )


@compiled()
def _albedo(
    model: Model, values: dict[str, Any], cosines: jax.Array, azimuth: jax.Array,
    ways: tuple[Way, ...],
) -> jax.Array:  # fmt: skip
    return model_albedo(model, values, cosines, azimuth=azimuth, nodes=_NODES, ways=ways)


def _draw_model(axes: Axes, subject: Subject, side: Side, curves: list[_Curve]) -> None:
    azimuths = _SAMPLE_AZIMUTHS_DEG if subject.model.anisotropic else (0.0,)
    for azimuth, dashes in zip(azimuths, ("-", (0, (4, 1.5))), strict=False):
        one = {w: albedo_curve(subject, (w,), azimuth) for w in LEAVING[side]
               if w in subject.model.ways}  # fmt: skip
        for curve in curves:
            value = np.sum([one[w][:, curve.channel] for w in curve.ways], axis=0)
            axes.plot(
                THETA_DEG, value, ls=dashes, zorder=3, label=curve.label, **curve.style
            )


def _draw_limit(axes: Axes, top: float) -> None:
    axes.set_ylim(0.0, top)
    axes.axhline(1.0, color=GREY, lw=1.0, ls=(0, (6, 2)), zorder=1, label="energy limit")
    axes.axhspan(1.0, top, color=GREY, alpha=0.12, lw=0, zorder=0)
    axes.text(
        0.015, 0.99, "more than arrives", fontsize=7, color=GREY, va="top", zorder=2,
        transform=axes.transAxes,
    )  # fmt: skip


def _measured(subject: Subject, side: Side, curve: _Curve) -> tuple[list[_Sum], str]:
    """Sums of the data of some angles of incidence, or why there are none."""
    if subject.measurement is None:
        return [], ""
    m = subject.data
    here = m.from_back == (side == "back")
    if not here.any():
        return [], ""
    theta = from_normal(m.theta_i[here])
    label = incidence_labels(theta)
    levels = [float(np.degrees(theta[label == k].mean())) for k in np.unique(label)]
    if len(levels) > _MOST_SUMS:
        at = np.linspace(0, len(levels) - 1, _MOST_SUMS).round().astype(int)
        levels = [levels[k] for k in at]
    found, why = [], ""
    for level in levels:
        try:
            parts = [_sum_of(subject, side, w in THROUGH, level, curve.channel)
                     for w in curve.ways]  # fmt: skip
        except MeasurementError as error:
            why = why or _reason(str(error))
            continue
        value, spread = sum(p.value for p in parts), [p.uncertainty for p in parts]
        covered = min(p.covered for p in parts)
        found.append(_Sum(level, value, float(np.linalg.norm(spread)), covered))
    return found, "" if found else why


def _sum_of(
    subject: Subject, side: Side, through: bool, theta_deg: float, channel: int
) -> _Sum:
    m = subject.data
    # Only the rows of this angle: looking at all would be repeated for every angle.
    own = np.abs(np.degrees(from_normal(m.theta_i)) - theta_deg) < _SAME_DEG
    r = measured(
        m.select(own),
        Directional(theta_deg),
        Hemispherical(),
        side=side,
        transmitted=through,
    )
    sd = r.standard_uncertainty[channel] if r.standard_uncertainty else 0.0
    covered = r.covered[channel] if r.covered else 1.0
    return _Sum(theta_deg, r.value[channel], sd, covered)


def _reason(error: str) -> str:
    """The reason alone, without the file before it and the advice after it."""
    return (
        error.partition("cannot be taken from the data: ")[2].partition("; fit")[0] or error
    )


def _draw_sums(axes: Axes, below: Axes, found: list[_Sum], curve: _Curve) -> None:
    theta, value, sd, covered = np.array(found).T
    colour = curve.style["color"]
    axes.errorbar(
        theta, value, yerr=2.0 * sd, fmt="none", ecolor=colour, elinewidth=0.9, zorder=4
    )
    axes.plot(
        theta, value, ls="none", marker=curve.marker, markersize=5, color=colour,
        markerfacecolor=tint(colour), zorder=5, label=f"sum of the data, {curve.label}",
    )  # fmt: skip
    below.plot(
        theta, covered, ls="none", marker=curve.marker, markersize=4, color=colour,
        markerfacecolor=tint(colour), label="covered",
    )  # fmt: skip


def _legend(subject: Subject, curves: dict[Side, list[_Curve]], some: bool) -> list[Line2D]:
    out = {
        c.label: Line2D(
            [], [], label=c.label, marker=c.marker if some else "",
            markerfacecolor=tint(c.style["color"]), **c.style,
        )
        for of_side in curves.values()
        for c in of_side
    }  # fmt: skip
    handles = list(out.values())
    if subject.model.anisotropic:
        handles += [
            Line2D([], [], color=GREY, ls=dashes, label=rf"$\varphi_i$ = {azimuth:.0f}°")
            for azimuth, dashes in zip(
                _SAMPLE_AZIMUTHS_DEG, ("-", (0, (4, 1.5))), strict=True
            )
        ]
    if some:
        style: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": GREY}
        handles.append(
            Line2D([], [], markerfacecolor=tint(GREY), label="sum of the data", **style)
        )
    handles.append(Line2D([], [], color=GREY, ls=(0, (6, 2)), label="energy limit"))
    return handles
