"""What the data themselves say about reciprocity and energy; numpy only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from data_formats import Measurement
from fitting.solid_angle import (
    angle_labels,
    from_normal,
    incidence_labels,
    projected_solid_angles,
)

_SAME_DIRECTION = 1e-3
_WIDEST_GAP = np.radians(20.0)
# Where two tables are compared; and between the azimuths of rings, more than a half turn.
_AZIMUTHS = np.radians(np.arange(0.0, 181.0, 10.0))
_APART = 10.0


class Albedo(NamedTuple):
    """Of one angle of incidence, for the channel that reflects and transmits most.

    ``covered`` is the share of the projected hemisphere (pi) that the valid rows of that
    channel stand for. What is transmitted, a part of ``albedo``, is None without such rows.
    """

    theta_i: float
    albedo: float
    covered: float
    transmitted: float | None = None
    transmitted_covered: float | None = None


def data_albedo(m: Measurement) -> list[Albedo]:
    """Sums of value times projected solid angle, per polar angle of incidence."""
    some = m.valid.any(axis=1)
    label = incidence_labels(m.theta_i)
    out: list[Albedo] = []
    for k in np.unique(label[some]):
        here = some & (label == k)
        theta_i = float(m.theta_i[here].mean())
        reflected = _sums(m, np.flatnonzero(here & ~m.transmitted))
        through = _sums(m, np.flatnonzero(here & m.transmitted))
        if reflected is None and through is None:
            continue
        nothing = np.zeros((2, m.n_channels))
        r, t = (nothing if s is None else s for s in (reflected, through))
        total = r[0] + t[0]
        top = int(np.argmax(total))
        of_through = (None, None) if through is None else tuple(float(v) for v in t[:, top])
        out.append(Albedo(theta_i, float(total[top]), float(r[1, top]), *of_through))
    return out


def _sums(m: Measurement, rows: np.ndarray) -> np.ndarray | None:
    """Albedo of some rows, all on one side, and what they cover, ``(2, c)``."""
    if not rows.size:
        return None
    projected = projected_solid_angles(m, rows)
    if projected is None:
        return None
    value = np.where(m.valid[rows], m.value[rows], 0.0)
    return np.stack([projected @ value, projected @ m.valid[rows] / np.pi])


def data_reciprocity(m: Measurement) -> tuple[float, int] | None:
    """Median relative difference of f(wi, wo) and f(wo, wi), and the number of pairs.

    For every pair of measured polar angles of incidence ``a, b`` of reflected light, on
    either side of the sample, and azimuth differences,
    the table of ``a`` is interpolated linearly at ``theta_r = b`` and the other way round,
    over the mean of the channels and, where the azimuths of both halves are measured, of
    these. Gaps of more than 20 deg between polar angles are not bridged, and azimuths are
    left out that are further than 10 deg from a measured one. None where the sampling
    leaves no pair.
    """
    found: list[np.ndarray] = []
    for side in (~m.from_back, m.from_back):
        tables = _tables(m, ~m.transmitted & side)
        there, back = _compared(tables, tables)
        found.append(_differences(there, back)[np.triu_indices(len(tables), 1)])
    return _median(found)


def data_transmitted_reciprocity(
    m: Measurement, relative_index: float = 1.0
) -> tuple[float, int] | None:
    """Median relative difference of ``f(wi, wo) / n_o^2`` and ``f(wo, wi) / n_i^2``.

    Of transmitted light, from front to back against from back to front, compared as by
    `data_reciprocity`. ``relative_index`` is that of the medium behind the sample relative
    to the one in front. Walter et al. 2007, sec. 4.2.
    """
    down = _tables(m, m.transmitted & ~m.from_back, relative_index**-2.0)
    up = _tables(m, m.transmitted & m.from_back)
    return _median([_differences(*_compared(down, up))])


def _tables(m: Measurement, chosen: np.ndarray, factor: float = 1.0) -> list[_Table]:
    """Per angle of incidence: values over the detector's directions.

    Angles are those to the normal of the side that a direction is on.
    """
    some = chosen & m.valid.any(axis=1)
    label = incidence_labels(m.theta_i)
    count = np.maximum(m.valid.sum(axis=1), 1)
    mean = factor * np.where(m.valid, m.value, 0.0).sum(axis=1) / count
    tables: list[_Table] = []
    theta_i, theta_r = from_normal(m.theta_i), from_normal(m.theta_r)
    for k in np.unique(label[some]):
        rows = np.flatnonzero(some & (label == k))
        # Both halves folded onto one: isotropic data are compared as if symmetric.
        delta = np.abs(np.arctan2(*_sin_cos(m.phi_r[rows] - m.phi_i[rows])))
        table = _table(float(theta_i[rows].mean()), theta_r[rows], delta, mean[rows])
        if table.theta.size >= 3:
            tables.append(table)
    return tables


def _compared(ones: list[_Table], others: list[_Table]) -> tuple[np.ndarray, np.ndarray]:
    """``(a, b, azimuths)``: each of the ones at the angle of each other; the reverse."""
    shape = len(ones), len(others), _AZIMUTHS.size
    angles = np.array([t.theta_i for t in others]), np.array([t.theta_i for t in ones])
    there = np.reshape([t.at(angles[0]) for t in ones], shape)
    back = np.reshape([t.at(angles[1]) for t in others], (shape[1], shape[0], shape[2]))
    return there, np.swapaxes(back, 0, 1)


def _differences(there: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Relative differences, NaN where there is nothing to compare."""
    size = 0.5 * (np.abs(there) + np.abs(back))
    good = size > 0
    return np.where(good, np.abs(there - back), np.nan) / np.where(good, size, 1.0)


def _median(differences: list[np.ndarray]) -> tuple[float, int] | None:
    joined = np.concatenate([d.ravel() for d in differences])
    joined = joined[~np.isnan(joined)]
    if joined.size == 0:
        return None
    return float(np.median(joined)), int(joined.size)


@dataclass(frozen=True)
class _Table:
    """One incidence: rings of polar angles ``theta (r,)``, and on each of them values at
    `_AZIMUTHS`, ``(r, azimuths)``, NaN where nothing was measured near."""

    theta_i: float
    theta: np.ndarray
    rings: np.ndarray

    def at(self, theta: np.ndarray) -> np.ndarray:
        """Linear between the two neighbouring rings of angles ``(q,)``; else NaN."""
        above = np.searchsorted(self.theta, theta - _SAME_DIRECTION)
        high, low = np.minimum(above, self.theta.size - 1), np.maximum(above - 1, 0)
        upper, lower = self.theta[high], self.theta[low]
        same = np.abs(upper - theta) < _SAME_DIRECTION
        between = (above > 0) & (upper - lower <= _WIDEST_GAP)
        known = (above < self.theta.size) & (same | between)
        wide = np.where(upper > lower, upper - lower, 1.0)
        share = np.where(same, 1.0, (theta - lower) / wide)[:, None]
        mixed = (1 - share) * self.rings[low] + share * self.rings[high]
        out = np.where(same[:, None], self.rings[high], mixed)
        return np.where(known[:, None], out, np.nan)


def _table(
    theta_i: float, theta: np.ndarray, delta: np.ndarray, value: np.ndarray
) -> _Table:
    """Linear in azimuth on every ring, all of them at once."""
    ring = angle_labels(theta)
    level, normal = _means(ring, theta), _means(ring, value)
    order = np.lexsort((delta, ring))
    ring, delta, value = ring[order], delta[order], value[order]
    # Rows of one direction count as their mean, such as those of both halves.
    new = (np.diff(ring, prepend=-1) > 0) | (np.diff(delta, prepend=0.0) > _SAME_DIRECTION)
    spot = np.cumsum(new) - 1
    ring, delta, value = ring[new], _means(spot, delta), _means(spot, value)
    count = np.bincount(ring)
    last = np.cumsum(count)[:, None] - 1
    first = last - count[:, None] + 1
    # Azimuths are below pi: one search among those of all rings.
    query = _APART * np.arange(count.size)[:, None] + _AZIMUTHS
    place = np.searchsorted(_APART * ring + delta, query, side="right")
    low, high = np.clip(place - 1, first, last), np.clip(place, first, last)
    gap = delta[high] - delta[low]
    slope = (value[high] - value[low]) / np.where(gap > 0, gap, 1.0)
    rings = value[low] + slope * (_AZIMUTHS - delta[low])
    nearest = np.minimum(np.abs(_AZIMUTHS - delta[low]), np.abs(_AZIMUTHS - delta[high]))
    inside = (delta[first] - _AZIMUTHS < _SAME_DIRECTION) & (
        _AZIMUTHS - delta[last] < _SAME_DIRECTION
    )
    near = nearest < 0.5 * _WIDEST_GAP + _SAME_DIRECTION
    rings = np.where(inside & near, rings, np.nan)
    at_normal = (level < _SAME_DIRECTION)[:, None]
    return _Table(theta_i, level, np.where(at_normal, normal[:, None], rings))


def _means(label: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.bincount(label, values) / np.bincount(label)


def _sin_cos(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.sin(angle), np.cos(angle)
