"""Residuals against angles and wavelength: where the fit is off, and to which side.

The residual is ``(fit - measured) / sigma`` where the data have uncertainties, else the
difference relative to the mean of both magnitudes, which lies between -200 and 200 %. It is
above zero where the fit is too bright.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fitting.plots import NoFigure
from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import (
    DIFFERENCE,
    GREY,
    INK,
    PALE,
    around_zero,
    marker_size,
    raster,
)
from fitting.plots.subject import Subject
from fitting.solid_angle import angle_labels, from_normal

DATA = "needed"

_BINS, _MOST_ANGLES, _MOST_POINTS = 18, 30, 12000
_INSIDE = 99.0
_MAP_BINS = 24
_FEWEST = 3


class _Residuals(NamedTuple):
    """Of every used row and channel ``(n, c)``; NaN where the data are not valid."""

    value: np.ndarray
    rows: np.ndarray
    unit: str
    label: str


def figure(subject: Subject) -> Figure:
    """Three panels against angles; below, of several channels, two against wavelength."""
    r = residuals(subject)
    several = len(subject.names) > 1
    out = new_figure(subject, "Residuals, fit − measured", (10.0, 7.2 if several else 4.2))  # noqa: RUF001
    parts = out.subfigures(2 if several else 1, 1, squeeze=False)[:, 0]
    size = float(np.nanpercentile(np.abs(r.value), _INSIDE)) if r.value.size else 0.0
    limit = 1.1 * size or 1.0
    m, rows = subject.data, r.rows
    off = np.degrees(_aspecular(subject))
    angles = (
        (f"from {_peak_name(subject)} (deg)", off),
        (
            r"detector $\theta_r$ (deg from the normal)",
            np.degrees(from_normal(m.theta_r[rows])),
        ),
        (
            r"source $\theta_i$ (deg from the normal)",
            np.degrees(from_normal(m.theta_i[rows])),
        ),
    )
    top = parts[0].subplots(1, 3, sharey=True)
    for axes, (label, angle) in zip(top, angles, strict=True):
        _against_angle(axes, subject, r, angle)
        axes.set_xlabel(label)
    top[0].set_ylim(-limit, limit)
    top[0].set_ylabel(r.label)
    if several:
        left, right = parts[1].subplots(1, 2, width_ratios=(3, 2))
        _map(parts[1], left, subject, r, off)
        left.set_ylabel(angles[0][0])
        _against_channel(right, subject, r)
        right.set_ylabel(r.label)
    outside = int(np.sum(np.abs(r.value[:, subject.chosen]) > limit))
    notes = ["residuals in % of the mean of both magnitudes"] if r.unit == "%" else []
    notes += [f"{outside} points beyond the axes"] if outside else []
    if rows.size < m.n_rows:
        notes.append(f"{rows.size} of {m.n_rows} rows, those that were fitted")
    return finish(out, subject, notes, _legend(subject))


def residuals(subject: Subject) -> _Residuals:
    """Raises `NoFigure` if no row of the data is used."""
    m = subject.data
    rows = np.flatnonzero(subject.used)
    if not rows.size:
        raise NoFigure("no row of the data is one that the model is compared with")
    fitted, measured = subject.fitted[rows], m.value[rows]
    if m.sigma is not None:
        scale, unit, label = m.sigma[rows], r"$\sigma$", r"residual ($\sigma$)"
    else:
        scale = 0.5 * (np.abs(fitted) + np.abs(measured)) / 100.0
        unit, label = "%", "residual (%)"
    good = m.valid[rows] & (scale > 0)
    value = np.full(fitted.shape, np.nan)
    np.divide(fitted - measured, scale, out=value, where=good)
    return _Residuals(value, rows, unit, label)


def _against_angle(axes: Axes, subject: Subject, r: _Residuals, angle: np.ndarray) -> None:
    step = max(1, math.ceil(r.rows.size * len(subject.chosen) / _MOST_POINTS))
    for c in subject.chosen:
        x, y = angle[::step], r.value[::step, c]
        axes.plot(
            x, y, linestyle="none", marker="o", markersize=0.7 * marker_size(x.size),
            color=subject.colours[c], alpha=0.6, markeredgewidth=0, zorder=2,
            rasterized=raster(x.size), label=subject.names[c],
        )  # fmt: skip
    middle, low, median, high = _quantiles(angle, r.value)
    axes.fill_between(middle, low, high, color=GREY, alpha=0.35, lw=0, zorder=3)
    axes.plot(middle, median, color=INK, lw=1.4, zorder=4, label="median")
    axes.axhline(0.0, color=INK, lw=0.7, zorder=1)


def _quantiles(angle: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, ...]:
    """Centres of groups of rows, and quantiles of all channels in them.

    Groups are the angles that occur, if they are few, else bins with equally many rows.
    """
    which = angle_labels(np.radians(angle))
    if which.max() >= _MOST_ANGLES:
        edges = np.unique(np.quantile(angle, np.linspace(0.0, 1.0, _BINS + 1)))
        which = np.clip(np.searchsorted(edges, angle, side="right") - 1, 0, edges.size - 2)
    found = []
    for k in np.unique(which):
        own = value[which == k]
        own = own[np.isfinite(own)]
        if own.size >= _FEWEST:
            middle = float(angle[which == k].mean())
            found.append((middle, *np.quantile(own, (0.16, 0.5, 0.84))))
    table = np.array(found).reshape(-1, 4)
    return table[:, 0], table[:, 1], table[:, 2], table[:, 3]


def _map(
    figure: SubFigure, axes: Axes, subject: Subject, r: _Residuals, angle: np.ndarray
) -> None:
    """Medians over channel and angle from the peak."""
    edges = np.linspace(0.0, max(float(angle.max()), 1.0), _MAP_BINS + 1)
    which = np.clip(np.digitize(angle, edges) - 1, 0, _MAP_BINS - 1)
    table = np.full((_MAP_BINS, r.value.shape[1]), np.nan)
    for k in np.unique(which):
        own = r.value[which == k]
        some = np.isfinite(own).any(axis=0)
        table[k, some] = np.nanmedian(own[:, some], axis=0)
    at, ticks = _channel_edges(subject)
    order = np.argsort(subject.wavelengths) if subject.wavelengths is not None else ...
    mesh = axes.pcolormesh(
        at, edges, np.ma.masked_invalid(table[:, order]), cmap=DIFFERENCE,
        norm=around_zero(table), rasterized=True,
    )  # fmt: skip
    axes.set_facecolor(PALE)
    axes.grid(False)
    axes.set_xlabel("wavelength (nm)" if ticks is None else "channel")
    if ticks is not None:
        axes.set_xticks(ticks, subject.names)
    figure.colorbar(mesh, ax=axes, extend="both", label=f"median residual ({r.unit})")


def _channel_edges(subject: Subject) -> tuple[np.ndarray, np.ndarray | None]:
    """Edges of the cells of channels, and ticks where they have names only."""
    w = subject.wavelengths
    if w is None:
        count = len(subject.names)
        return np.arange(count + 1) - 0.5, np.arange(count)
    w = np.sort(w)
    between = 0.5 * (w[1:] + w[:-1])
    return np.concatenate(
        [[1.5 * w[0] - 0.5 * w[1]], between, [1.5 * w[-1] - 0.5 * w[-2]]]
    ), None


def _against_channel(axes: Axes, subject: Subject, r: _Residuals) -> None:
    """Median and bands of every channel."""
    w = subject.wavelengths
    at = np.arange(len(subject.names)) if w is None else w
    some = np.flatnonzero(np.isfinite(r.value).any(axis=0))
    some = some[np.argsort(at[some])]
    levels = np.nanquantile(r.value[:, some], (0.025, 0.16, 0.5, 0.84, 0.975), axis=0)
    x = at[some]
    if w is None or x.size <= 3:
        for low, high, wide in ((levels[0], levels[4], 1.0), (levels[1], levels[3], 4.0)):
            axes.vlines(x, low, high, color=GREY, lw=wide, alpha=0.6, zorder=2)
        axes.plot(x, levels[2], "o", color=INK, zorder=3, label="median")
    else:
        axes.fill_between(x, levels[0], levels[4], color=GREY, alpha=0.18, lw=0)
        axes.fill_between(x, levels[1], levels[3], color=GREY, alpha=0.35, lw=0)
        axes.plot(x, levels[2], color=INK, lw=1.4, zorder=3, label="median")
    axes.axhline(0.0, color=INK, lw=0.7, zorder=1)
    axes.set_xlabel("channel" if w is None else "wavelength (nm)")
    if w is None:
        axes.set_xticks(at, subject.names)
        axes.set_xlim(-0.6, len(at) - 0.4)
    top = float(np.abs(levels).max(initial=0.0)) * 1.1 or 1.0
    axes.set_ylim(-top, top)


def _aspecular(subject: Subject) -> np.ndarray:
    """Angle between the detector and the mirror direction, or the way straight on, rad."""
    m, rows = subject.data, np.flatnonzero(subject.used)
    ti, tr = m.theta_i[rows], m.theta_r[rows]
    delta = m.phi_r[rows] - m.phi_i[rows]
    upright = np.where(m.transmitted[rows], -np.cos(ti), np.cos(ti))
    x, y, z = np.sin(tr) * np.cos(delta), np.sin(tr) * np.sin(delta), np.cos(tr)
    half = 0.5 * np.sqrt((x + np.sin(ti)) ** 2 + y**2 + (z - upright) ** 2)
    return 2.0 * np.arcsin(np.minimum(half, 1.0))


def _peak_name(subject: Subject) -> str:
    through = subject.data.transmitted[subject.used]
    if through.all():
        return "the way straight on"
    return "mirror direction or straight on" if through.any() else "the mirror direction"


def _legend(subject: Subject) -> list:
    dots = [
        Line2D(
            [], [], linestyle="none", marker="o", markersize=4, color=subject.colours[c],
            label=subject.names[c],
        )
        for c in subject.chosen
    ]  # fmt: skip
    return [
        *dots,
        Line2D([], [], color=INK, lw=1.4, label="median of all channels"),
        Patch(facecolor=GREY, alpha=0.35, label="16 to 84 %"),
        *([Patch(facecolor=GREY, alpha=0.18, label="2.5 to 97.5 %")]
          if len(subject.names) > 1 else []),
    ]  # fmt: skip
