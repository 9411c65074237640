"""Half and difference angles: measured, fit and the logarithm of their ratio as images.

The axes are those of Disney's BRDF Explorer (Burley 2012, sec. 3.1; Rusinkiewicz 1998): at
the left edge is the mirror direction, at the top grazing light, at the lower edge the way
back to the source. Cells are means of rows over the azimuth ``phi_d``, of the data and of
the fit in the same rows. Of transmitted light the detector is mirrored to the lit side.
Without data the fit is that at ``phi_d = 90 deg``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator

from data_formats.half_difference import directions, half_difference
from fitting.models import Way
from fitting.plots import NoFigure
from fitting.plots.canvas import finish, new_figure
from fitting.plots.log_axis import log_limits
from fitting.plots.style import DIFFERENCE, INK, MAGNITUDE, PALE, around_zero
from fitting.plots.subject import WAY_NAMES, Subject
from fitting.solid_angle import from_normal

DATA = "shown"

# Cells per right angle; few rows get larger cells.
_MOST_CELLS, _FEWEST_CELLS, _ROWS_PER_CELL = 36, 10, 4.0
# Beyond this a model may be huge; the colours are for what is below it, rad.
_GRAZING = math.radians(80.0)
_FINE = 128
_TICKS_DEG = (0, 5, 15, 30, 60, 90)


class _Image(NamedTuple):
    """Cells ``(theta_d, theta_h)``: edges, means, and how many rows are in each.

    Without data ``rows`` are 2, or 1 near grazing, or 0 below the horizon.
    """

    edges_h: np.ndarray
    edges_d: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    rows: np.ndarray


def figure(subject: Subject) -> Figure:
    """Three panels per way of light, or one without data; of one channel."""
    c = subject.channel
    heading = f"{subject.quantity} over half and difference angle, {subject.names[c]}"
    if subject.measurement is None:
        return _without_data(subject, heading)
    images: dict[Way, _Image] = {
        w: i for w in subject.ways if (i := _binned(subject, w)) is not None
    }
    if not images:
        raise NoFigure(f"no row has a valid value of {subject.names[c]}")
    out = new_figure(
        subject, heading, (10.0, 1.2 + (3.0 if len(images) == 1 else 2.7) * len(images))
    )
    grid = out.subplots(len(images), 3, squeeze=False, sharex=True, sharey=True)
    hidden = 0
    for (way, image), axes in zip(images.items(), grid, strict=True):
        hidden += _three(out, subject, image, axes)
        name = f"{WAY_NAMES[way]}\n" if len(images) > 1 else ""
        axes[0].set_ylabel(name + r"$\theta_d$ (deg)")
    for one in grid.ravel():
        _frame(one)
    for one in grid[-1]:
        one.set_xlabel(r"$\theta_h$ (deg, square-root scale)")
    for one, text in zip(grid[0], ("measured", "fit", "fit / measured"), strict=True):
        one.set_title(text)
    notes = [r"cells are means of all rows over the azimuth; pale cells have no row"]
    handles = []
    if hidden:
        text = f"mean of the data is zero or negative ({hidden})"
        handles.append(
            Line2D([], [], color=INK, marker="x", ls="none", markersize=4, label=text)
        )
    return finish(out, subject, notes, handles)


def _three(figure: Figure, subject: Subject, image: _Image, axes: np.ndarray) -> int:
    """Draw measured, fit, ratio; returns in how many cells the data have no logarithm."""
    low, high = log_limits(image.measured, image.fitted)
    norm = LogNorm(low, high)
    unit = f"{subject.quantity} (1/sr)"
    for one, value in zip(axes[:2], (image.measured, image.fitted), strict=True):
        shown = np.ma.masked_where(~(value > 0), np.maximum(value, low))
        _mesh(one, image, shown, cmap=MAGNITUDE, norm=norm)
    figure.colorbar(
        ScalarMappable(norm, MAGNITUDE),
        ax=list(axes[:2]),
        label=unit,
        extend="min",
        shrink=0.85,
    )
    both = (image.measured > 0) & (image.fitted > 0)
    ratio = np.full(both.shape, np.nan)
    ratio[both] = np.log10(image.fitted[both] / image.measured[both])
    mesh = _mesh(
        axes[2],
        image,
        np.ma.masked_invalid(ratio),
        cmap=DIFFERENCE,
        norm=around_zero(ratio),
    )
    figure.colorbar(
        mesh, ax=axes[2], label=r"$\log_{10}$(fit / measured)", extend="both", shrink=0.85
    )
    none = (image.rows > 0) & (image.measured <= 0)
    d, h = np.nonzero(none)
    for one in (axes[0], axes[2]):
        one.plot(
            _centres(image.edges_h)[h], _centres(image.edges_d)[d], linestyle="none",
            marker="x", color=INK, markersize=2.5, markeredgewidth=0.7, label="_none",
        )  # fmt: skip
    return int(none.sum())


def _binned(subject: Subject, way: Way) -> _Image | None:
    m, c = subject.data, subject.channel
    rows = np.flatnonzero((subject.way == way) & m.valid[:, c])
    if not rows.size:
        return None
    theta_i, theta_r = from_normal(m.theta_i[rows]), from_normal(m.theta_r[rows])
    theta_h, theta_d, _ = half_difference(theta_i, m.phi_i[rows], theta_r, m.phi_r[rows])
    cells = int(np.clip(math.sqrt(rows.size / _ROWS_PER_CELL), _FEWEST_CELLS, _MOST_CELLS))
    edges_h, edges_d = _edges(cells)
    h = np.clip(np.digitize(theta_h, edges_h) - 1, 0, cells - 1)
    d = np.clip(np.digitize(theta_d, edges_d) - 1, 0, cells - 1)
    cell = d * cells + h
    count = np.bincount(cell, minlength=cells**2)

    def mean(value: np.ndarray) -> np.ndarray:
        total = np.bincount(cell, value, minlength=cells**2)
        out = np.full(cells**2, np.nan)
        np.divide(total, count, out=out, where=count > 0)
        return out.reshape(cells, cells)

    measured, fitted = mean(m.value[rows, c]), mean(subject.fitted[rows, c])
    return _Image(edges_h, edges_d, measured, fitted, count.reshape(cells, cells))


def _edges(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Of theta_h even in its square root, of theta_d even, rad."""
    share = np.linspace(0.0, 1.0, cells + 1)
    return 0.5 * math.pi * share**2, 0.5 * math.pi * share


def _without_data(subject: Subject, heading: str) -> Figure:
    """The model at ``phi_d = 90 deg``."""
    ways = subject.ways
    out = new_figure(subject, heading, (1.0 + 4.4 * len(ways), 4.6))
    panels = out.subplots(1, len(ways), squeeze=False, sharey=True)[0]
    for way, axes in zip(ways, panels, strict=True):
        image = _modelled(subject, way)
        low, high = log_limits(np.zeros(0), np.where(image.rows == 2, image.fitted, 0.0))
        shown = np.ma.masked_where(~(image.fitted > 0), np.maximum(image.fitted, low))
        mesh = _mesh(axes, image, shown, cmap=MAGNITUDE, norm=LogNorm(low, high))
        out.colorbar(
            mesh, ax=axes, label=f"{subject.quantity} (1/sr)", extend="both", shrink=0.85
        )
        axes.set_title("fit" + (f", {WAY_NAMES[way]}" if len(ways) > 1 else ""))
        axes.set_xlabel(r"$\theta_h$ (deg, square-root scale)")
        _frame(axes)
    panels[0].set_ylabel(r"$\theta_d$ (deg)")
    return finish(out, subject, [r"at the azimuth $\varphi_d$ = 90°, without data"])


def _modelled(subject: Subject, way: Way) -> _Image:
    edges_h, edges_d = _edges(_FINE)
    theta_h, theta_d = np.meshgrid(_centres(edges_h), _centres(edges_d))
    theta_i, phi_i, theta_r, phi_r = directions(
        theta_h, theta_d, np.full(theta_h.shape, 0.5 * math.pi)
    )
    steepest = np.maximum(theta_i, theta_r)
    above = (steepest < 0.5 * math.pi).astype(int) + (steepest < _GRAZING)
    if way in ("back", "up"):
        theta_i = math.pi - theta_i
    if way in ("back", "down"):
        theta_r = math.pi - theta_r
    value = subject.evaluate(theta_i, phi_i, theta_r, phi_r)[..., subject.channel]
    value = np.where(above > 0, value, np.nan)
    return _Image(edges_h, edges_d, value, value, above)


def _mesh(axes: Axes, image: _Image, value: np.ma.MaskedArray, **style):
    axes.set_facecolor(PALE)
    return axes.pcolormesh(
        image.edges_h, image.edges_d, value, rasterized=True, zorder=1, **style
    )


def _centres(edges: np.ndarray) -> np.ndarray:
    return 0.5 * (edges[1:] + edges[:-1])


def _frame(axes: Axes) -> None:
    """Axes in degrees; the horizontal one as its square root, which widens peaks."""
    axes.set_xscale("function", functions=(_root, np.square))
    axes.set_xlim(0.0, 0.5 * math.pi)
    axes.set_ylim(0.0, 0.5 * math.pi)
    axes.grid(False)
    axes.set_box_aspect(1)
    ticks = np.radians(_TICKS_DEG)
    axes.xaxis.set_major_locator(FixedLocator(ticks.tolist()))
    axes.set_xticks(ticks, [str(t) for t in _TICKS_DEG])
    axes.set_yticks(np.radians([0, 30, 60, 90]), ["0", "30", "60", "90"])


def _root(theta: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(theta, 0.0))
