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
    over the mean of the channels. Gaps of more than 20 deg are not bridged. None where the
    sampling leaves no pair.
    """
    found: list[np.ndarray] = []
    for side in (~m.from_back, m.from_back):
        tables = _tables(m, ~m.transmitted & side)
        for i, one in enumerate(tables):
            for other in tables[i + 1 :]:
                found.append(_differences(one, other))
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
    return _median([_differences(one, other) for one in down for other in up])


_Table = tuple[float, "_Rings"]


def _tables(m: Measurement, chosen: np.ndarray, factor: float = 1.0) -> list[_Table]:
    """Per angle of incidence: the angle, and values over the detector's directions.

    Angles are those to the normal of the side that a direction is on.
    """
    some = chosen & m.valid.any(axis=1)
    label = incidence_labels(m.theta_i)
    count = np.maximum(m.valid.sum(axis=1), 1)
    mean = factor * np.where(m.valid, m.value, 0.0).sum(axis=1) / count
    tables: list[_Table] = []
    for k in np.unique(label[some]):
        rows = np.flatnonzero(some & (label == k))
        # Both halves folded onto one: isotropic data are compared as if symmetric.
        delta = np.abs(np.arctan2(*_sin_cos(m.phi_r[rows] - m.phi_i[rows])))
        table = _Rings.of(from_normal(m.theta_r[rows]), delta, mean[rows])
        if table.theta.size < 3:
            continue
        tables.append((float(from_normal(m.theta_i[rows]).mean()), table))
    return tables


def _differences(one: _Table, other: _Table) -> np.ndarray:
    """Relative differences of the one at the angle of the other, and the reverse."""
    azimuth = np.radians(np.arange(0.0, 181.0, 10.0))
    there, back = one[1].at(other[0], azimuth), other[1].at(one[0], azimuth)
    size = 0.5 * (np.abs(there) + np.abs(back))
    good = np.isfinite(there) & np.isfinite(back) & (size > 0)
    return np.abs(there - back)[good] / size[good]


def _median(differences: list[np.ndarray]) -> tuple[float, int] | None:
    joined = np.concatenate(differences) if differences else np.zeros(0)
    if joined.size == 0:
        return None
    return float(np.median(joined)), int(joined.size)


@dataclass(frozen=True)
class _Rings:
    """A table of one incidence: polar angles, and per ring azimuths and values."""

    theta: np.ndarray
    rings: list[tuple[np.ndarray, np.ndarray]]

    @staticmethod
    def of(theta: np.ndarray, delta: np.ndarray, value: np.ndarray) -> _Rings:
        ring = angle_labels(theta)
        levels, rings = [], []
        for k in range(ring.max() + 1):
            rows = np.flatnonzero(ring == k)
            rows = rows[np.argsort(delta[rows], kind="stable")]
            levels.append(theta[rows].mean())
            rings.append((delta[rows], value[rows]))
        return _Rings(np.asarray(levels), rings)

    def at(self, theta: float, azimuth: np.ndarray) -> np.ndarray:
        """Linear in azimuth on the two neighbouring rings and between them; else NaN."""
        above = int(np.searchsorted(self.theta, theta - _SAME_DIRECTION))
        if above == self.theta.size:
            return np.full(azimuth.size, np.nan)
        upper = self._on_ring(above, azimuth)
        if abs(self.theta[above] - theta) < _SAME_DIRECTION:
            return upper
        if above == 0 or self.theta[above] - self.theta[above - 1] > _WIDEST_GAP:
            return np.full(azimuth.size, np.nan)
        low, high = self.theta[above - 1], self.theta[above]
        share = (theta - low) / (high - low)
        return (1 - share) * self._on_ring(above - 1, azimuth) + share * upper

    def _on_ring(self, k: int, azimuth: np.ndarray) -> np.ndarray:
        delta, value = self.rings[k]
        if self.theta[k] < _SAME_DIRECTION:
            return np.full(azimuth.size, value.mean())
        nearest = np.abs(azimuth[:, None] - delta).min(axis=1)
        inside = (azimuth > delta[0] - _SAME_DIRECTION) & (
            azimuth < delta[-1] + _SAME_DIRECTION
        )
        good = inside & (nearest < 0.5 * _WIDEST_GAP)
        return np.where(good, np.interp(azimuth, delta, value), np.nan)


def _sin_cos(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.sin(angle), np.cos(angle)
