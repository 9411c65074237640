"""A flat patch in the sun and under an overcast sky, and how the fit differs from the data.

As in a fish-eye view upside down: a viewer above is in the middle, one at grazing angles at
the rim, and the distance from the middle is the sine of the angle from the normal.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from msgspec.structs import replace

from fitting.plots.rendered import SCENES, compared, draw_compared
from fitting.plots.style import GREY, ORANGE
from fitting.plots.subject import Subject
from fitting.scene import load_scene
from fitting.scene.description import Disk, Flat
from fitting.scene.picture import Picture

DATA = "needed"

_POLAR, _AROUND = 48, 72
_LARGEST_THETA_DEG = 80.0
_RINGS_DEG = (30.0, 60.0, _LARGEST_THETA_DEG)


def figure(subject: Subject) -> Figure:
    """A disc of viewers per picture, a row per scene."""
    seen = views(math.radians(_LARGEST_THETA_DEG), _POLAR, _AROUND)
    found = [
        compared(subject, replace(load_scene(preset), seen=Flat()), name, seen)
        for preset, name in SCENES.items()
    ]
    rings = ", ".join(f"{r:g}°" for r in _RINGS_DEG)
    notes = [
        f"the viewer is above in the middle, circles are {rings} from the normal; direct "
        f"light only, of the scenes {' and '.join(SCENES)} (brdf scene)"
    ]
    heading = "A flat patch of the material, seen from every direction"
    out = draw_compared(subject, heading, found, _show, notes)
    sun = next(o for o in load_scene("sun").lights if isinstance(o, Disk))
    for axes in out.axes[:2]:
        _mark(axes, math.radians(sun.theta_deg), math.radians(sun.phi_deg))
    return out


def _mark(axes: Axes, theta: float, phi: float) -> None:
    """Where the sun is."""
    x, y = math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi)
    axes.plot([x], [y], "o", color=ORANGE, markeredgecolor="white", markersize=7, zorder=3)
    axes.annotate(
        "sun", (x, y), xytext=(6, 4), textcoords="offset points", color="white", fontsize=7
    )


def views(largest_theta: float, polar: int, around: int) -> Picture:
    """Cells of equal solid angle of the viewer, in ``(cos theta, phi)``."""
    cosine = np.linspace(math.cos(largest_theta), 1.0, polar + 1)
    phi = np.linspace(0.0, 2.0 * math.pi, around + 1)
    row, column = (a.ravel() for a in np.indices((polar, around)))
    low = np.stack([cosine[row], phi[column]], axis=1)
    high = np.stack([cosine[row + 1], phi[column + 1]], axis=1)
    n = polar * around
    one = np.ones(n)
    return Picture(low, high, one, one / n, (polar, around), np.arange(n))


def _show(axes: Axes, seen: Picture, pixels: np.ndarray) -> None:
    rows, columns = seen.shape
    cosine = np.append(seen.low[::columns, 0], seen.high[-1, 0])
    phi = np.append(seen.low[:columns, 1], seen.high[-1, 1])
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))[:, None]
    axes.pcolormesh(
        sine * np.cos(phi), sine * np.sin(phi), pixels.reshape(rows, columns, 4),
        rasterized=True, zorder=1,
    )  # fmt: skip
    axes.set_aspect("equal")
    around = np.linspace(0.0, 2.0 * math.pi, 181)
    for ring in np.sin(np.radians(_RINGS_DEG)):
        axes.plot(ring * np.cos(around), ring * np.sin(around), color=GREY, lw=0.5)
