"""What the data themselves say about reciprocity and energy; numpy only."""

from __future__ import annotations

import numpy as np

from data_formats import Measurement
from fitting.solid_angle import incidence_labels, solid_angles


def data_albedo(m: Measurement) -> list[tuple[float, float, float]]:
    """Per polar angle of incidence: ``(theta_i, albedo, covered)``.

    ``albedo`` is the sum of value times projected solid angle over the reflected rows, the
    largest of all channels; ``covered`` the share of the projected hemisphere (pi) that
    the rows stand for. Rows that are not valid count as not measured.
    """
    up = (m.theta_r <= 0.5 * np.pi) & m.valid.any(axis=1)
    label = incidence_labels(m.theta_i)
    out: list[tuple[float, float, float]] = []
    for k in np.unique(label[up]):
        rows = np.flatnonzero(up & (label == k))
        angle = solid_angles(m.theta_r[rows], m.phi_r[rows])
        if angle is None:
            continue
        projected = angle * np.cos(m.theta_r[rows])
        value = np.where(m.valid[rows], m.value[rows], 0.0)
        out.append(
            (
                float(m.theta_i[rows].mean()),
                float((projected @ value).max()),
                float(projected.sum() / np.pi),
            )
        )
    return out


def data_reciprocity(m: Measurement) -> tuple[float, int] | None:
    """Median relative difference of f(wi, wo) and f(wo, wi), and the number of pairs.

    For every pair of measured polar angles of incidence ``a, b`` and azimuth differences,
    the table of ``a`` is interpolated linearly at ``theta_r = b`` and the other way round,
    over the mean of the channels. None where the sampling does not allow it.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    up = (m.theta_r <= 0.5 * np.pi) & m.valid.any(axis=1)
    label = incidence_labels(m.theta_i)
    count = np.maximum(m.valid.sum(axis=1), 1)
    mean = np.where(m.valid, m.value, 0.0).sum(axis=1) / count
    azimuth = np.radians(np.arange(0.0, 181.0, 10.0))
    tables: list[tuple[float, LinearNDInterpolator]] = []
    for k in np.unique(label[up]):
        rows = np.flatnonzero(up & (label == k))
        delta = m.phi_r[rows] - m.phi_i[rows]
        x, y = _plane(m.theta_r[rows], delta)
        points, first = np.unique(
            np.round(np.stack([x, y], axis=1), 9), axis=0, return_index=True
        )
        try:
            table = LinearNDInterpolator(points, mean[rows][first])
        except (QhullError, ValueError):
            continue
        tables.append((float(m.theta_i[rows].mean()), table))
    differences: list[np.ndarray] = []
    for i, (a, of_a) in enumerate(tables):
        for b, of_b in tables[i + 1 :]:
            there = of_a(*_plane(np.full(azimuth.size, b), azimuth))
            back = of_b(*_plane(np.full(azimuth.size, a), azimuth))
            size = 0.5 * (np.abs(there) + np.abs(back))
            good = np.isfinite(there) & np.isfinite(back) & (size > 0)
            differences.append(np.abs(there - back)[good] / size[good])
    joined = np.concatenate(differences) if differences else np.zeros(0)
    if joined.size == 0:
        return None
    return float(np.median(joined)), int(joined.size)


def _plane(theta: np.ndarray, delta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    # Both halves folded onto one: isotropic data are compared as if symmetric.
    return theta * np.cos(delta), theta * np.abs(np.sin(delta))
