"""Pairs of directions over which two BSDFs are compared, with their weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.geometry import Geometry, from_components
from fitting.model import Model
from fitting.models import AxisPeak, SlopeWidths, Way
from fitting.models.lobe import FROM_BACK, THROUGH
from fitting.models.retro import Retro
from fitting.models.turned_over import TurnedOver

PAIRS = 16384
# Beyond it little is ever measured, and facets are masked differently by every program.
LARGEST_THETA_DEG = 85.0
Vectors = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Pairs:
    """``n`` pairs, so that ``int int f cos_i cos_o dwi dwo = sum(weight f)``.

    ``weight (n,)`` in sr^2; the integral is that over all ways of light asked for.
    """

    geometry: Geometry
    weight: np.ndarray


@dataclass(frozen=True)
class _Peak:
    """Where a lobe peaks: facets of a width around the normal, or an axis of a width."""

    alpha_x: float
    alpha_y: float
    angle: float
    turned: bool
    axis: float | None = None


def pairs_of(model: Model, values: dict, ways: Sequence[Way], count: int = PAIRS) -> Pairs:
    """Quasi-random pairs for the integrals of a model over some ways of light.

    The source is even in projected solid angle. Of reflected light half of the detectors
    are, too, and the others are drawn around the peaks of the lobes, whose narrowest would
    be missed otherwise; the weights are those of the balance heuristic (Veach 1997, eq.
    9.8). Transmitted light is only even: its narrow peaks are seen roughly. No direction
    is more than 85 degrees from its normal.
    """
    each = max(count // max(len(ways), 1), 1)
    found = [_of_way(_peaks(model, values, way), way, each) for way in ways]
    joined = [np.concatenate(arrays) for arrays in zip(*found, strict=True)]
    return Pairs(from_components(*joined[:6]), joined[6])


def widths(model: Model, values: dict) -> list[float]:
    """About the half widths of the peaks of all lobes, in degrees of the detector.

    A slope of the facets turns the reflected beam by twice its angle.
    """
    found = [p for way in model.ways for p in _peaks(model, values, way)]
    return [
        float(np.degrees((1.0 if p.axis is not None else 2.0) * np.arctan(w)))
        for p in found
        for w in (min(p.alpha_x, p.alpha_y),)
    ]


def _of_way(peaks: list[_Peak], way: Way, count: int) -> tuple[np.ndarray, ...]:
    u = _sequence(count)
    wi = _cosine(u[0], u[1])
    peaks = [] if way in THROUGH else peaks
    shares = [0.5 if peaks else 1.0, *([0.5 / len(peaks)] * len(peaks) if peaks else [])]
    which = np.searchsorted(np.cumsum(shares)[:-1], u[4], side="right")
    wo = list(_cosine(u[2], u[3]))
    for k, peak in enumerate(peaks, start=1):
        mine = which == k
        source = wi[0][mine], wi[1][mine], wi[2][mine]
        drawn = _around(peak, source, u[2][mine], u[3][mine])
        for axis, value in zip(wo, drawn, strict=True):
            axis[mine] = value
    lowest = np.cos(np.radians(LARGEST_THETA_DEG))
    up = (wo[2] > lowest) & (wi[2] > lowest)
    density = shares[0] * np.maximum(wo[2], 0.0) / np.pi
    for k, peak in enumerate(peaks, start=1):
        density = density + shares[k] * _density(peak, wi, (wo[0], wo[1], wo[2]))
    ok = up & (density > 0)
    weight = np.pi * wo[2][ok] / (density[ok] * count)
    sign_i = -1.0 if way in FROM_BACK else 1.0
    sign_o = sign_i * (-1.0 if way in THROUGH else 1.0)
    return (
        wi[0][ok], wi[1][ok], sign_i * wi[2][ok],
        wo[0][ok], wo[1][ok], sign_o * wo[2][ok], weight,
    )  # fmt: skip


def _peaks(model: Model, values: dict, way: Way) -> list[_Peak]:
    """The peaks of the lobes on one way of light, with the widths of all channels."""
    import jax
    import jax.numpy as jnp

    out: set[_Peak] = set()
    arrays = {n: np.atleast_1d(np.asarray(v, dtype=np.float64)) for n, v in values.items()}
    channels = max((v.size for v in arrays.values()), default=1)
    with jax.enable_x64(True):
        for i, lobe in enumerate(model.lobes):
            inner = lobe.inner if isinstance(lobe, TurnedOver) else lobe
            turned = isinstance(inner, Retro)
            for c in range(channels):
                own = {n: jnp.asarray(v[min(c, v.size - 1)]) for n, v in arrays.items()}
                peak = lobe.peak(model.of_lobe(i, own))
                if way not in lobe.ways or peak is None:
                    continue
                if isinstance(peak, AxisPeak):
                    width = float(np.sqrt(2.0 / (peak.exponent + 2.0)))
                    slope = float(peak.c_xy / peak.c_z) * (-1.0 if turned else 1.0)
                    out.add(_Peak(width, width, 0.0, False, axis=slope))
                elif isinstance(peak, SlopeWidths):
                    x, y, angle = (round(float(p), 12) for p in peak)
                    out.add(_Peak(x, y, angle, turned))
    # One peak per kind and octave is enough for channels of their own widths.
    kept: dict[tuple, _Peak] = {}
    for p in sorted(out, key=lambda p: p.alpha_x):
        kept.setdefault(
            (round(np.log2(p.alpha_x)), round(np.log2(p.alpha_y)), p.turned, p.axis), p
        )
    return list(kept.values())


def _around(p: _Peak, wi: Vectors, u: np.ndarray, v: np.ndarray) -> Vectors:
    """Detectors around a peak of a source: GGX facets, or GGX slopes around an axis."""
    slope, turn = np.sqrt(u / (1.0 - u)), 2.0 * np.pi * v
    along, across = p.alpha_x * slope * np.cos(turn), p.alpha_y * slope * np.sin(turn)
    c, s = np.cos(p.angle), np.sin(p.angle)
    x, y = c * along - s * across, s * along + c * across
    z = 1.0 / np.sqrt(1.0 + x * x + y * y)
    x, y = x * z, y * z
    if p.axis is not None:
        ax, ay, az = _axis(p, wi)
        tx, ty, tz, bx, by, bz = _frame(ax, ay, az)
        return (
            tx * x + bx * y + ax * z, ty * x + by * y + ay * z, tz * x + bz * y + az * z,
        )  # fmt: skip
    turned = -1.0 if p.turned else 1.0
    ix, iy, iz = turned * wi[0], turned * wi[1], wi[2]
    twice = 2.0 * (ix * x + iy * y + iz * z)
    return twice * x - ix, twice * y - iy, twice * z - iz


def _density(p: _Peak, wi: Vectors, wo: Vectors) -> np.ndarray:
    """Probability per steradian of `_around`."""
    if p.axis is not None:
        ax, ay, az = _axis(p, wi)
        cosine = np.clip(ax * wo[0] + ay * wo[1] + az * wo[2], -1.0, 1.0)
        ahead = cosine > 0
        c = np.where(ahead, cosine, 1.0)
        tangent2 = np.maximum(1.0 - c * c, 0.0) / (c * c)
        d = 1.0 / (np.pi * p.alpha_x**2 * c**3 * (1.0 + tangent2 / p.alpha_x**2) ** 2)
        return np.where(ahead, d, 0.0)
    turned = -1.0 if p.turned else 1.0
    g = from_components(turned * wi[0], turned * wi[1], wi[2], *wo)
    c, s = np.cos(p.angle), np.sin(p.angle)
    along, across = c * g.hx + s * g.hy, c * g.hy - s * g.hx
    h2 = (along / p.alpha_x) ** 2 + (across / p.alpha_y) ** 2
    d = 1.0 / (np.pi * p.alpha_x * p.alpha_y * (h2 + g.hz * g.hz) ** 2)
    return d * g.hz / (4.0 * np.maximum(g.cos_d, 1e-12))


def _axis(p: _Peak, wi: Vectors) -> Vectors:
    """Unit vector along ``(a x, a y, z)`` of a source ``(x, y, z)``."""
    a = 1.0 if p.axis is None else p.axis
    length = np.sqrt(a * a * (wi[0] ** 2 + wi[1] ** 2) + wi[2] ** 2)
    return a * wi[0] / length, a * wi[1] / length, wi[2] / length


def _frame(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
    """Two unit vectors across a direction with ``z >= 0`` (Duff et al. 2017)."""
    a = -1.0 / (1.0 + z)
    b = x * y * a
    return 1.0 + x * x * a, b, -x, b, 1.0 + y * y * a, -y


def _cosine(u: np.ndarray, v: np.ndarray) -> Vectors:
    r, phi = np.sqrt(u), 2.0 * np.pi * v
    return r * np.cos(phi), r * np.sin(phi), np.sqrt(1.0 - u)


def _sequence(count: int) -> np.ndarray:
    """``(5, count)`` of a Kronecker sequence of generalised golden ratios in (0, 1)."""
    # The root of x^6 = x + 1.
    base = 1.1347241384015194
    n = np.arange(count) + 0.5
    return np.stack([np.mod(n * base ** -(k + 1) + 0.5, 1.0) for k in range(5)])
