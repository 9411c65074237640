"""The part of the hemisphere that each measured direction stands for."""

from __future__ import annotations

import numpy as np

_SAME_ANGLE = 2e-4


def solid_angle_weights(
    theta_i: np.ndarray, phi_i: np.ndarray, theta_r: np.ndarray, phi_r: np.ndarray
) -> np.ndarray:
    """Relative weights, mean 1: solid angle per row within each incidence direction.

    Goniometers scan rings of constant polar angle, so a row's share is the zone between
    the mid-angles to the neighbouring rings, times the mid-azimuths to its neighbours on
    the ring. Scattered directions, where rings hold less than three rows on average, get
    the squared distance to their nearest neighbours instead. Each incidence direction
    has the same total. Repeated directions share their weight.
    """
    incidence = _labels(np.stack([theta_i, np.where(theta_i > 0, phi_i, 0.0)]))
    weights = np.empty(theta_i.size)
    for label in range(incidence.max(initial=-1) + 1):
        rows = np.flatnonzero(incidence == label)
        own = _of_one_incidence(theta_r[rows], phi_r[rows] - phi_i[rows])
        weights[rows] = own / own.mean()
    return weights


def solid_angles(theta_r: np.ndarray, delta: np.ndarray) -> np.ndarray | None:
    """Solid angle in sr of each row of one incidence; ``delta = phi_r - phi_i``.

    None where the directions are not on rings, so that no absolute figure is known. Rows
    that lie on one side of the plane of incidence stand for both.
    """
    ring = _labels(theta_r[None])
    count = int(ring.max()) + 1
    if count < 4 or theta_r.size < 3 * count:
        return None
    return _of_rings(theta_r, delta, ring)


def incidence_labels(theta_i: np.ndarray) -> np.ndarray:
    """A running number per distinct polar angle of incidence, ascending."""
    return _labels(theta_i[None])


def _labels(columns: np.ndarray) -> np.ndarray:
    rounded = np.round(columns / _SAME_ANGLE).astype(np.int64)
    return np.unique(rounded, axis=1, return_inverse=True)[1].reshape(-1)


def _of_one_incidence(theta: np.ndarray, delta: np.ndarray) -> np.ndarray:
    if theta.size == 1:
        return np.ones(1)
    ring = _labels(theta[None])
    count = ring.max() + 1
    if count > 3 and theta.size < 3 * count:
        return _of_scattered(theta, delta)
    return _of_rings(theta, delta, ring)


def _of_rings(theta: np.ndarray, delta: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Zone of each ring times the azimuth that each of its rows stands for."""
    side = np.sin(delta)
    one_sided = bool(np.all(side > -_SAME_ANGLE) or np.all(side < _SAME_ANGLE))
    count = int(ring.max()) + 1
    level = np.bincount(ring, theta) / np.bincount(ring)
    middle = 0.5 * (level[1:] + level[:-1])
    first = 1.5 * level[0] - 0.5 * level[1] if count > 1 else 0.0
    last = 1.5 * level[-1] - 0.5 * level[-2] if count > 1 else 0.5 * np.pi
    if level[-1] < 0.5 * np.pi:
        last = min(last, 0.5 * np.pi)
    lower = np.concatenate([[max(first, 0.0)], middle])
    upper = np.concatenate([middle, [last]])
    zone = np.abs(np.cos(lower) - np.cos(upper)) + 1e-12
    out = np.empty(theta.size)
    for k in range(count):
        rows = np.flatnonzero(ring == k)
        out[rows] = zone[k] * _azimuth_widths(delta[rows], one_sided)
    return out


def _azimuth_widths(delta: np.ndarray, one_sided: bool) -> np.ndarray:
    """Width in azimuth between the mid-points to the neighbours on a ring, rad.

    A gap wider than twice the usual one is not bridged: what was not measured stands for
    nothing. Repeated directions share their width.
    """
    angle = np.mod(delta, 2 * np.pi)
    if one_sided:
        angle = np.abs(np.arctan2(np.sin(delta), np.cos(delta)))
    distinct, which, count = np.unique(
        np.round(angle / _SAME_ANGLE).astype(np.int64),
        return_inverse=True,
        return_counts=True,
    )
    angle = distinct * _SAME_ANGLE
    if angle.size == 1:
        return np.full(delta.size, 2 * np.pi / delta.size)
    inner = np.diff(angle)
    reach = np.median(inner)
    if one_sided:
        # The mirror images of the first and the last row are their neighbours.
        before, after = 2 * angle[:1], 2 * (np.pi - angle[-1:])
        gaps = np.minimum(np.concatenate([before, inner, after]), 2.0 * reach)
        width = gaps[:-1] + gaps[1:]
    else:
        around = np.concatenate([inner, angle[:1] + 2 * np.pi - angle[-1:]])
        gaps = np.minimum(around, 2.0 * reach)
        width = 0.5 * (gaps + np.roll(gaps, 1))
    return (width / count)[which.reshape(-1)] + 1e-12


def _of_scattered(theta: np.ndarray, delta: np.ndarray) -> np.ndarray:
    from scipy.spatial import KDTree

    points = np.stack(
        [np.sin(theta) * np.cos(delta), np.sin(theta) * np.sin(delta), np.cos(theta)],
        axis=1,
    )
    neighbours = min(5, theta.size)
    distance, _ = KDTree(points).query(points, k=neighbours)
    area = np.mean(distance[:, 1:], axis=1) ** 2 + 1e-12
    return np.minimum(area, 4.0 * np.median(area))
