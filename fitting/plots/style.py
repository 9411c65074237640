"""How all figures look: fonts that stay text, colours that everyone tells apart.

Lines have the colours of Okabe and Ito (2008, Color Universal Design), magnitudes are shown
by viridis, which is even in lightness, and differences by a diverging map with white at
zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import matplotlib
import numpy as np
from matplotlib.colors import Normalize, to_rgb

# Okabe and Ito's colours but the yellow, which white paper swallows; black is for data.
BLUE, VERMILLION, GREEN = "#0072B2", "#D55E00", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"
INK, GREY, PALE = "#1A1A1A", "#6E6E6E", "#DDDDDD"
LINES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, INK)
MARKERS = ("o", "s", "^", "D", "v", "P", "X")

MAGNITUDE = "viridis"
DIFFERENCE = "RdBu_r"

MINUS = "\N{MINUS SIGN}"

# Clouds of more points than this are drawn as pixels also in vector formats.
MOST_VECTOR_POINTS = 1500

STYLE: dict[str, object] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "brdf",
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
    "text.usetex": False,
    "font.family": "sans-serif",
    "font.size": 9.0,
    "mathtext.fontset": "dejavusans",
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.facecolor": "white",
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": True,
    "axes.xmargin": 0.02,
    "grid.color": "#E8E8E8",
    "grid.linewidth": 0.6,
    "grid.linestyle": "-",
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.5,
    "lines.markersize": 4.0,
    "errorbar.capsize": 2.0,
    "image.cmap": MAGNITUDE,
    "figure.facecolor": "white",
    "figure.dpi": 100.0,
    "figure.titlesize": 10.5,
    "figure.constrained_layout.h_pad": 0.06,
    "figure.constrained_layout.w_pad": 0.06,
    "savefig.dpi": 200.0,
    "savefig.facecolor": "white",
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw and save with this style, whatever the user's own configuration."""
    with matplotlib.rc_context(STYLE):  # pyright: ignore[reportArgumentType]
        yield


def channel_colours(
    names: Sequence[str], wavelengths_nm: Sequence[float | None]
) -> list[str]:
    """A colour per channel: red, green and blue for what is so, else in order.

    Up to three wavelengths are blue, green and vermillion from short to long.
    """
    bands = {"R": VERMILLION, "G": GREEN, "B": BLUE}
    bands |= {"X": VERMILLION, "Y": GREEN, "Z": BLUE}
    if len(names) > 1 and all(n.upper() in bands for n in names):
        return [bands[n.upper()] for n in names]
    known = [w for w in wavelengths_nm if w is not None]
    if len(known) == len(names) and 1 < len(names) <= 3:
        order = np.argsort(np.argsort(known))
        ladder = (BLUE, GREEN, VERMILLION) if len(names) == 3 else (BLUE, VERMILLION)
        return [ladder[int(k)] for k in order]
    return [LINES[k % len(LINES)] for k in range(len(names))]


def around_zero(values: np.ndarray, percentile: float = 98.0) -> Normalize:
    """Limits for a diverging map: the same to both sides of zero.

    ``percentile`` of the magnitudes is inside, so that a few outliers do not wash out the
    rest.
    """
    size = np.abs(values[np.isfinite(values)])
    top = float(np.percentile(size, percentile)) if size.size else 0.0
    if not top > 0:
        top = float(size.max(initial=0.0)) or 1.0
    return Normalize(-top, top)


def tint(colour: str, share: float = 0.5) -> tuple[float, float, float]:
    """A colour mixed with a share of white: points below the line of the same colour."""
    r, g, b = to_rgb(colour)
    return r + share * (1 - r), g + share * (1 - g), b + share * (1 - b)


def raster(points: int) -> bool:
    """Whether so many points are better pixels than vectors."""
    return points > MOST_VECTOR_POINTS


def marker_size(points: int) -> float:
    """Diameter of a marker in points, smaller the more there are in one panel."""
    return float(np.clip(9.0 / math.log10(max(points, 2) + 10.0) - 1.0, 1.5, 4.5))
