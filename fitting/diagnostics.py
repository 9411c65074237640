"""What the data themselves say about reciprocity and energy; numpy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_formats import Measurement
from fitting.solid_angle import angle_labels, incidence_labels, solid_angles

_SAME_DIRECTION = 1e-3
_WIDEST_GAP = np.radians(20.0)


def data_albedo(m: Measurement) -> list[tuple[float, float, float]]:
    """Per polar angle of incidence: ``(theta_i, albedo, covered)``.

    ``albedo`` is the sum of value times projected solid angle over the reflected rows, the
    largest of all channels; ``covered`` the share of the projected hemisphere (pi) that
    the valid rows of that channel stand for.
    """
    up = _reflected(m)
    label = incidence_labels(m.theta_i)
    out: list[tuple[float, float, float]] = []
    for k in np.unique(label[up]):
        rows = np.flatnonzero(up & (label == k))
        angle = solid_angles(m.theta_r[rows], m.phi_r[rows] - m.phi_i[rows])
        if angle is None:
            continue
        projected = angle * np.cos(m.theta_r[rows])
        value = np.where(m.valid[rows], m.value[rows], 0.0)
        albedo = projected @ value
        covered = projected @ m.valid[rows] / np.pi
        top = int(np.argmax(albedo))
        out.append((float(m.theta_i[rows].mean()), float(albedo[top]), float(covered[top])))
    return out


def data_reciprocity(m: Measurement) -> tuple[float, int] | None:
    """Median relative difference of f(wi, wo) and f(wo, wi), and the number of pairs.

    For every pair of measured polar angles of incidence ``a, b`` and azimuth differences,
    the table of ``a`` is interpolated linearly at ``theta_r = b`` and the other way round,
    over the mean of the channels. Gaps of more than 20 deg are not bridged. None where the
    sampling leaves no pair.
    """
    up = _reflected(m)
    label = incidence_labels(m.theta_i)
    count = np.maximum(m.valid.sum(axis=1), 1)
    mean = np.where(m.valid, m.value, 0.0).sum(axis=1) / count
    azimuth = np.radians(np.arange(0.0, 181.0, 10.0))
    tables: list[tuple[float, _Rings]] = []
    for k in np.unique(label[up]):
        rows = np.flatnonzero(up & (label == k))
        # Both halves folded onto one: isotropic data are compared as if symmetric.
        delta = np.abs(np.arctan2(*_sin_cos(m.phi_r[rows] - m.phi_i[rows])))
        table = _Rings.of(m.theta_r[rows], delta, mean[rows])
        if table.theta.size < 3:
            continue
        tables.append((float(m.theta_i[rows].mean()), table))
    differences: list[np.ndarray] = []
    for i, (a, of_a) in enumerate(tables):
        for b, of_b in tables[i + 1 :]:
            there, back = of_a.at(b, azimuth), of_b.at(a, azimuth)
            size = 0.5 * (np.abs(there) + np.abs(back))
            good = np.isfinite(there) & np.isfinite(back) & (size > 0)
            differences.append(np.abs(there - back)[good] / size[good])
    joined = np.concatenate(differences) if differences else np.zeros(0)
    if joined.size == 0:
        return None
    return float(np.median(joined)), int(joined.size)


def _reflected(m: Measurement) -> np.ndarray:
    horizon = 0.5 * np.pi + 1e-9
    return (m.theta_i <= horizon) & (m.theta_r <= horizon) & m.valid.any(axis=1)


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
