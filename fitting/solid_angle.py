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
        own = _of_one_incidence(theta_r[rows], phi_r[rows])
        weights[rows] = own / own.mean()
    return weights


def solid_angles(theta_r: np.ndarray, phi_r: np.ndarray) -> np.ndarray | None:
    """Solid angle in sr of each row of one incidence, which together cover the rings.

    None where the directions are not on rings, so that no absolute figure is known. Data
    of one half of the hemisphere stand for both.
    """
    ring = _labels(theta_r[None])
    count = int(ring.max()) + 1
    if count < 4 or theta_r.size < 3 * count:
        return None
    return 2.0 * np.pi * _of_rings(theta_r, phi_r, ring)


def incidence_labels(theta_i: np.ndarray) -> np.ndarray:
    """A running number per distinct polar angle of incidence, ascending."""
    return _labels(theta_i[None])


def _labels(columns: np.ndarray) -> np.ndarray:
    rounded = np.round(columns / _SAME_ANGLE).astype(np.int64)
    return np.unique(rounded, axis=1, return_inverse=True)[1].reshape(-1)


def _of_one_incidence(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    if theta.size == 1:
        return np.ones(1)
    ring = _labels(theta[None])
    count = ring.max() + 1
    if count > 3 and theta.size < 3 * count:
        return _of_scattered(theta, phi)
    return _of_rings(theta, phi, ring)


def _of_rings(theta: np.ndarray, phi: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Zone of each ring times the share of its rows in the circle."""
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
        out[rows] = zone[k] * _azimuth_shares(phi[rows])
    return out


def _azimuth_shares(phi: np.ndarray) -> np.ndarray:
    order = np.argsort(np.mod(phi, 2 * np.pi), kind="stable")
    sorted_phi = np.mod(phi, 2 * np.pi)[order]
    gaps = np.diff(np.concatenate([sorted_phi, sorted_phi[:1] + 2 * np.pi]))
    # The widest gap is unmeasured, for instance the other half of a symmetric sample.
    gaps = np.minimum(gaps, 2.0 * np.median(gaps) + 1e-12)
    share = 0.5 * (gaps + np.roll(gaps, 1)) + 1e-12
    out = np.empty(phi.size)
    out[order] = share / share.sum()
    return out


def _of_scattered(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    from scipy.spatial import KDTree

    points = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1
    )
    neighbours = min(5, theta.size)
    distance, _ = KDTree(points).query(points, k=neighbours)
    area = np.mean(distance[:, 1:], axis=1) ** 2 + 1e-12
    return np.minimum(area, 4.0 * np.median(area))
