"""Panels of a region: rays between breaks in azimuth, and stretches of them.

A panel is a rectangle in (azimuth, distance), with nodes of Gauss-Kronrod's rule in both.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from fitting.reflectance.charts import Chart
from fitting.reflectance.region import Cap, crossings, roots

# Kronrod's 15 nodes around the 7 of Gauss (Piessens et al. 1983, QUADPACK, qk15).
_X = (0.991455371120812639206854697526329, 0.949107912342758524526189684047851,
      0.864864423359769072789712788640926, 0.741531185599394439863864773280788,
      0.586087235467691130294144691693253, 0.405845151377397166906606412076961,
      0.207784955007898467600689403773245, 0.0)  # fmt: skip
_K = (0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
      0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
      0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
      0.204432940075298892414161999234649, 0.209482141084727828012999174891714)  # fmt: skip
_G = (0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
      0.381830050505118944950369775488975, 0.417959183673469387755102040816327)  # fmt: skip

NODES = 0.5 + 0.5 * np.array([*(-x for x in _X), *_X[-2::-1]])
KRONROD = 0.5 * np.array([*_K, *_K[-2::-1]])
GAUSS = np.zeros(NODES.size)
GAUSS[1::2] = 0.5 * np.array([*_G, *_G[-2::-1]])

# Of the roots along a ray the first are the centre and infinity.
_ORIGIN, _INFINITY = 0, 1
_FACTOR, _FARTHEST = 30.0, 1e8


@dataclass(frozen=True)
class Panels:
    """Rectangles, one per entry: of an owner, between two azimuths and two circles.

    ``phi0, phi1`` bound the segment of azimuths of which ``x0, x1`` are a part; ``low,
    high`` tell the roots between which a ray runs, of which ``y0, y1`` are a part.
    """

    owner: np.ndarray
    phi0: np.ndarray
    phi1: np.ndarray
    low: np.ndarray
    high: np.ndarray
    x0: np.ndarray
    x1: np.ndarray
    y0: np.ndarray
    y1: np.ndarray

    def __len__(self) -> int:
        return len(self.owner)

    def take(self, chosen: np.ndarray) -> Panels:
        return Panels(*(getattr(self, f.name)[chosen] for f in fields(self)))

    def split(self, along_x: np.ndarray) -> Panels:
        """Two halves of each."""
        values: dict[str, Any] = {
            f.name: np.repeat(getattr(self, f.name), 2) for f in fields(self)
        }
        first = np.arange(2 * len(self)) % 2 == 0
        for axis, here in (("x", along_x), ("y", ~along_x)):
            low, high, split = values[f"{axis}0"], values[f"{axis}1"], np.repeat(here, 2)
            middle = 0.5 * (low + high)
            values[f"{axis}0"] = np.where(split & ~first, middle, low)
            values[f"{axis}1"] = np.where(split & first, middle, high)
        return Panels(**values)


def first_panels(chart: Chart, caps: tuple[Cap, ...]) -> Panels:
    """The panels of the region inside of, and not outside of, all caps.

    Azimuths break at the plane of incidence, where a ray touches a
    circle, and where two circles cross: between, every ray meets the same circles in the
    same order.
    """
    breaks = np.mod(chart.round_azimuth(_breaks(chart, caps)), 2 * np.pi)
    breaks = np.sort(np.where(np.isnan(breaks), breaks[:1], breaks), axis=0)
    ends = np.concatenate([breaks, breaks[:1] + 2 * np.pi])
    phi0, phi1 = ends[:-1].T, ends[1:].T
    owner = np.broadcast_to(np.arange(chart.owners)[:, None], phi0.shape)
    some = phi1 - phi0 > 1e-13
    owner, phi0, phi1 = owner[some], phi0[some], phi1[some]

    psi, _, _ = chart.stretched(0.5 * (phi0 + phi1))
    bounds = _roots(chart, caps, owner, psi)
    clean = np.where(bounds >= 0, bounds, np.inf)
    order = np.argsort(clean, axis=0)
    ordered = np.take_along_axis(clean, order, axis=0)
    low, high = ordered[:-1], ordered[1:]
    open_ended = np.isinf(high)
    with np.errstate(invalid="ignore"):
        middle = np.where(open_ended, 2.0 * low + 1.0, 0.5 * (low + high))
    kept = np.isfinite(low) & (high > low)
    middle = np.where(kept, middle, 0.0)
    for cap in caps:
        if cap.role == "cut":
            continue
        a, b, c = chart.quadratic(cap, owner, psi)
        within = (a * middle + b) * middle + c > 0
        kept &= within if cap.role == "inside" else ~within
    stretch, segment = np.nonzero(kept)
    _, scale, _ = chart.stretched(0.5 * (phi0 + phi1))
    index, y0, y1 = _by_scale(
        low[stretch, segment] / scale[segment], high[stretch, segment] / scale[segment]
    )
    stretch, segment = stretch[index], segment[index]
    last = np.where(open_ended, _INFINITY, order[1:])
    return Panels(
        owner[segment], phi0[segment], phi1[segment],
        order[:-1][stretch, segment], last[stretch, segment],
        np.zeros(segment.size), np.ones(segment.size), y0, y1,
    )  # fmt: skip


def _by_scale(
    low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stretches ``(k,)`` in parts: which one, and where each part begins and ends.

    What a narrow lobe has near the horizon lies within the last ``1 / high`` of ``v``, too
    little for a rule to notice: no part spans more than a factor.
    """
    central = low == 0
    first, last = np.maximum(low, 1.0), np.minimum(high, _FARTHEST)
    count = 1 + np.floor(np.log(np.maximum(last / first, 1.0)) / np.log(_FACTOR)).astype(
        int
    )
    index = np.repeat(np.arange(low.size), count)
    k = np.arange(index.size) - np.repeat(np.cumsum(count) - count, count)
    ratio = np.maximum(last / first, 1.0)[index]
    v0, v1 = np.arctan(low)[index], np.arctan(high)[index]

    def share(step: np.ndarray) -> np.ndarray:
        v = np.arctan(first[index] * ratio ** (step / count[index]))
        share = (v - v0) / np.maximum(v1 - v0, 1e-300)
        share = np.where(step == 0, 0.0, np.where(step == count[index], 1.0, share))
        return _uncrowded(np.clip(share, 0.0, 1.0), central[index])

    return index, share(k), share(k + 1)


def nodes_of(
    chart: Chart, caps: tuple[Cap, ...], panels: Panels
) -> tuple[np.ndarray, np.ndarray]:
    """Directions ``(P, 15, 15, 3)`` and measures ``cos dw`` per unit square.

    Azimuths are crowded at both ends of a segment like ``3 x^2 - 2 x^3``, which takes the
    root away with which a ray leaves a circle. Distances are ``scale tan(v)``, with ``v``
    crowded at circles: masking ends a narrow lobe within its width of the horizon.
    """
    x = panels.x0[:, None] + (panels.x1 - panels.x0)[:, None] * NODES
    length = (panels.phi1 - panels.phi0)[:, None]
    phi = panels.phi0[:, None] + length * x * x * (3.0 - 2.0 * x)
    dphi = length * 6.0 * x * (1.0 - x) * (panels.x1 - panels.x0)[:, None]
    psi, scale, dpsi = chart.stretched(phi)
    bounds = _roots(chart, caps, panels.owner, psi)
    t0, t1 = (
        np.take_along_axis(bounds, np.broadcast_to(i[None, :, None], (1, *psi.shape)), 0)[0]
        for i in (panels.low, panels.high)
    )
    with np.errstate(invalid="ignore"):
        v0 = np.arctan(np.maximum(np.nan_to_num(t0, posinf=np.inf), 0.0) / scale)
        v1 = np.arctan(np.maximum(np.nan_to_num(t1, posinf=np.inf), 0.0) / scale)
    span = np.maximum(v1 - v0, 0.0)[:, :, None]
    part = (panels.y1 - panels.y0)[:, None]
    y, dy = _crowded(panels.y0[:, None] + part * NODES, panels.low[:, None] == _ORIGIN)
    r = np.tan(v0[:, :, None] + span * y[:, None, :])
    dr = (1.0 + r * r) * span * (dy * part)[:, None, :]
    wide = scale[:, :, None]
    t = r * wide
    psi = np.broadcast_to(psi[:, :, None], t.shape)
    owner = np.broadcast_to(panels.owner[:, None, None], t.shape)
    direction, density = chart.directions(owner, psi, t)
    return direction, density * t * dr * wide * (dpsi * dphi)[:, :, None]


def _crowded(y: np.ndarray, central: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``1 - (1 - y)^2`` from the centre on, else ``3 y^2 - 2 y^3``, and the slopes."""
    rest = 1.0 - y
    return (
        np.where(central, 1.0 - rest * rest, y * y * (3.0 - 2.0 * y)),
        np.where(central, 2.0 * rest, 6.0 * y * rest),
    )


def _uncrowded(share: np.ndarray, central: np.ndarray) -> np.ndarray:
    """The inverse of `_crowded`."""
    other = 0.5 - np.sin(np.arcsin(1.0 - 2.0 * share) / 3.0)
    return np.where(central, 1.0 - np.sqrt(1.0 - share), other)


def _breaks(chart: Chart, caps: tuple[Cap, ...]) -> np.ndarray:
    """Azimuths ``psi (k, N)`` at which segments end."""
    owner = np.arange(chart.owners)
    out = [chart.start() + np.pi * k for k in range(2)]
    for cap in caps:
        # The discriminant is m0 + m1 cos(2 psi) + m2 sin(2 psi): three values tell it.
        third = np.pi / 3.0
        d = []
        for k in range(3):
            a, b, c = chart.quadratic(cap, owner, np.full(owner.size, k * third))
            d.append(b * b - 4.0 * a * c)
        m0 = (d[0] + d[1] + d[2]) / 3.0
        m1, m2 = d[0] - m0, (d[1] - d[2]) / np.sqrt(3.0)
        size = np.hypot(m1, m2)
        with np.errstate(invalid="ignore", divide="ignore"):
            half = np.arccos(-m0 / size)
        middle = np.arctan2(m2, m1)
        out += [0.5 * (middle + s * half) + k * np.pi for s in (-1, 1) for k in (0, 1)]
    for first, second in itertools.combinations(caps, 2):
        out += list(chart.azimuth_of(crossings(first, second)))
    return np.stack([np.broadcast_to(o, owner.shape) for o in out])


def _roots(
    chart: Chart, caps: tuple[Cap, ...], owner: np.ndarray, psi: np.ndarray
) -> np.ndarray:
    """Where rays meet the circles: 0, infinity, and two of each, ``(2 q + 2, ...)``."""
    out = [np.zeros(psi.shape), np.full(psi.shape, np.inf)]
    for cap in caps:
        a, b, c = chart.quadratic(cap, owner, psi)
        some = b * b - 4.0 * a * c > 0
        for root in roots(a, b, c):
            out.append(np.where(some | (psi.ndim > 1), root, np.nan))
    return np.stack(out)
