"""The lobe in three dimensions, logarithmic in radius, with the measured points on it.

A direction of the detector at a distance of ``log10`` of the value over that in the middle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D

from fitting.models import Way
from fitting.models.lobe import FROM_BACK, FROM_FRONT
from fitting.plots.canvas import finish, new_figure
from fitting.plots.in_plane import Cut, cuts
from fitting.plots.log_axis import log_limits
from fitting.plots.style import GREY, INK, MAGNITUDE, VERMILLION, raster
from fitting.plots.subject import Subject

DATA = "shown"

_MOST, _DECADES = 3, 5.0
_ELEVATION_DEG, _AZIMUTH_DEG = 24.0, 65.0
_BEHIND, _SURFACE, _BEFORE = 1, 2, 3
_SAME_INCIDENCE = math.radians(0.6)


class _Scale(NamedTuple):
    """The values in the middle and at the rim."""

    low: float
    high: float

    def radius(self, value: np.ndarray) -> np.ndarray:
        return np.log10(np.maximum(value, self.low) / self.low)

    @property
    def colours(self) -> ScalarMappable:
        return ScalarMappable(LogNorm(self.low, self.high), MAGNITUDE)


def figure(subject: Subject) -> Figure:
    """A lobe for each of up to three angles of incidence, of one channel."""
    c = subject.channel
    side = FROM_FRONT if subject.ways[0] in FROM_FRONT else FROM_BACK
    ways: list[Way] = [w for w in subject.ways if w in side]
    chosen = [cut for cut in cuts(subject, ways[0], _MOST) if not cut.azimuth][:_MOST]
    surfaces = [_surface(subject, cut, ways) for cut in chosen]
    points = [_rows(subject, cut, ways) for cut in chosen]
    values = np.concatenate([v.ravel() for _, v in surfaces])
    measured = np.zeros(0)
    if subject.measurement is not None:
        every = np.concatenate(points)
        measured = subject.data.value[every, c]
    low, high = log_limits(measured, values)
    low = max(0.7 * low, high * 10.0**-_DECADES)
    scale = _Scale(low, high)
    full = len(ways) > 1
    out = new_figure(
        subject, f"{subject.quantity} as a lobe, {subject.names[c]}",
        (max(3.3 * len(chosen) + 0.9, 6.0), 5.2 if full else 4.4),
    )  # fmt: skip
    hidden, azimuth = 0, _azimuth(subject, np.concatenate(points))
    panels = out.subplots(1, len(chosen), squeeze=False, subplot_kw={"projection": "3d"})[0]
    for axes, cut, (directions, value), rows in zip(
        panels, chosen, surfaces, points, strict=True
    ):
        _draw_surface(axes, directions, value, scale)
        if rows.size:
            hidden += _draw_points(axes, subject, rows, scale, azimuth)
        _frame(axes, cut, scale, full, azimuth)
    out.colorbar(
        scale.colours, ax=panels.tolist(), shrink=0.55, aspect=18, pad=0.02,
        label=f"fit (1/sr); the middle is {low:.1g}",
    )  # fmt: skip
    handles = [Line2D([], [], color=GREY, lw=1.6, label="source")]
    if subject.measurement is not None:
        handles += _legend()
    notes = [f"the radius is the logarithm of the {subject.quantity}"]
    if hidden:
        notes.append(f"{hidden} values that are zero, negative or lower are in the middle")
    return finish(out, subject, notes, handles)


def _surface(
    subject: Subject, cut: Cut, ways: Sequence[Way]
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Unit vectors ``(polar, azimuth)`` of detectors, and the model there."""
    peak = cut.peak(subject)
    near = np.concatenate([-np.geomspace(0.3, 15, 13), [0.0], np.geomspace(0.3, 15, 13)])
    polar = np.concatenate([np.linspace(0.0, 89.5, 40), math.degrees(peak) + near])
    polar = np.radians(np.unique(polar[(polar >= 0) & (polar <= 89.5)]))
    turn = np.concatenate([np.linspace(-180, 180, 61), near])
    turn = np.radians(np.unique(np.round(turn, 6))) + math.pi
    halves = [polar, math.pi - polar[::-1]] if len(ways) > 1 else [polar]
    if len(ways) == 1 and ways[0] in ("down", "back"):
        halves = [math.pi - polar]
    theta = np.concatenate(halves)[:, None]
    x, y, z = _unit(theta, turn[None, :])
    value = subject.evaluate(cut.theta_i, cut.phi_i, theta, cut.phi_i + turn[None, :])
    return (x, y, z), value[..., subject.channel]


def _rows(subject: Subject, cut: Cut, ways: Sequence[Way]) -> np.ndarray:
    """All rows of this direction of incidence, in the plane or not."""
    if subject.measurement is None:
        return np.zeros(0, dtype=int)
    m = subject.data
    here = np.abs(m.theta_i - cut.theta_i) < _SAME_INCIDENCE
    here &= m.valid[:, subject.channel] & np.isin(subject.way, ways)
    if m.symmetry == "anisotropic":
        turned = np.arctan2(np.sin(m.phi_i - cut.phi_i), np.cos(m.phi_i - cut.phi_i))
        here &= (np.abs(turned) < _SAME_INCIDENCE) | (np.sin(m.theta_i) < 1e-3)
    return np.flatnonzero(here)


def _draw_surface(
    axes: Axes3D, directions: tuple[np.ndarray, ...], value: np.ndarray, scale: _Scale
) -> None:
    r = scale.radius(value)
    x, y, z = (r * d for d in directions)
    inner = 0.25 * (value[1:, 1:] + value[:-1, 1:] + value[1:, :-1] + value[:-1, :-1])
    colour = scale.colours.to_rgba(np.maximum(inner, scale.low))
    axes.plot_surface(
        x, y, z, facecolors=colour, rstride=1, cstride=1, linewidth=0, antialiased=False,
        shade=False, rasterized=True, zorder=_SURFACE,
    )  # fmt: skip


def _draw_points(
    axes: Any, subject: Subject, rows: np.ndarray, scale: _Scale, azimuth: float
) -> int:
    """Points at the measured radius; returns how many are in the middle."""
    m, c = subject.data, subject.channel
    value = m.value[rows, c]
    r = scale.radius(value)
    x, y, z = (r * d for d in _unit(m.theta_r[rows], m.phi_r[rows] - m.phi_i[rows]))
    above = value > subject.fitted[rows, c]
    size = float(np.clip(3000.0 / rows.size, 1.2, 6.0))
    # The library cannot tell which points a surface hides: those that look away from the
    # viewer are drawn first.
    seen = _towards_viewer(x, y, z, azimuth)
    for side, order in ((~seen, _BEHIND), (seen, _BEFORE)):
        for some, colour in ((above & side, VERMILLION), (~above & side, INK)):
            axes.scatter(
                x[some], y[some], z[some], s=size, c=colour, linewidths=0,
                depthshade=False, rasterized=raster(rows.size), zorder=order,
            )  # fmt: skip
    return int(np.sum(value < scale.low))


def _azimuth(subject: Subject, rows: np.ndarray) -> float:
    """From where to look, in degrees: from the side where the data are."""
    if not rows.size:
        return _AZIMUTH_DEG
    m = subject.data
    side = np.sum(np.sin(m.theta_r[rows]) * np.sin(m.phi_r[rows] - m.phi_i[rows]))
    return _AZIMUTH_DEG if side >= -1e-6 else -_AZIMUTH_DEG


def _towards_viewer(
    x: np.ndarray, y: np.ndarray, z: np.ndarray, azimuth: float
) -> np.ndarray:
    up, around = math.radians(_ELEVATION_DEG), math.radians(azimuth)
    flat = math.cos(up)
    return x * flat * math.cos(around) + y * flat * math.sin(around) + z * math.sin(up) > 0


def _frame(axes: Any, cut: Cut, scale: _Scale, full: bool, azimuth: float) -> None:
    top = math.log10(scale.high / scale.low)
    axes.set_xlim(-top, top)
    axes.set_ylim(-top, top)
    axes.set_zlim(-top if full else 0.0, top)
    axes.set_box_aspect((2, 2, 2 if full else 1), zoom=1.42)
    axes.view_init(elev=_ELEVATION_DEG, azim=azimuth)
    axes.set_axis_off()
    axes.computed_zorder = False
    around = np.linspace(0.0, 2.0 * math.pi, 181)
    for share in (0.5, 1.0):
        axes.plot(
            share * top * np.cos(around), share * top * np.sin(around), 0.0 * around,
            color=GREY, lw=0.6, zorder=0,
        )  # fmt: skip
    axes.plot([-top, top], [0, 0], [0, 0], color=GREY, lw=0.6, zorder=0)
    x, y, z = (float(v) for v in _unit(np.array(cut.theta_i), np.array(0.0)))
    axes.plot([0, top * x], [0, top * y], [0, top * z], color=GREY, lw=1.6, zorder=0)
    axes.set_title(cut.label, loc="center", y=0.84)


def _legend() -> list[Line2D]:
    style: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.5}
    return [
        Line2D([], [], color=VERMILLION, label="measured, above the fit", **style),
        Line2D([], [], color=INK, label="measured, below the fit", **style),
    ]


def _unit(theta: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, ...]:
    """Unit vectors with the source in the half plane of positive x."""
    return np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.cos(theta)
