"""The part of the hemisphere that each measured direction stands for."""

from __future__ import annotations

import functools

import numpy as np

from data_formats import Measurement
from data_formats.measurement import PROJECTED_SOLID_ANGLE

_SAME_ANGLE = 1e-3
_BIN = np.radians(1.0)
_MANY = 90
_SPARSE = 4.0


def solid_angle_weights(
    theta_i: np.ndarray, phi_i: np.ndarray, theta_r: np.ndarray, phi_r: np.ndarray
) -> np.ndarray:
    """Relative weights, mean 1: solid angle per row within each incidence direction.

    Goniometers scan rings of constant polar angle, so a row's share is the zone between
    the mid-angles to the neighbouring rings, times the mid-azimuths to its neighbours on
    the ring. Scattered directions, where rings hold less than three rows on average, get
    the squared distance to their nearest neighbours instead. Each incidence direction
    has the same mean, on each side of the sample. Repeated directions share their weight.
    """
    polar = incidence_labels(theta_i)
    azimuth = angle_labels(np.where(np.sin(theta_i) > _SAME_ANGLE, phi_i, 0.0))
    below = theta_r > 0.5 * np.pi + 1e-9
    theta_r = np.where(below, np.pi - theta_r, theta_r)
    incidence = 2 * (polar * (azimuth.max(initial=0) + 1) + azimuth) + below
    weights = np.empty(theta_i.size)
    for label in np.unique(incidence):
        rows = np.flatnonzero(incidence == label)
        own = _of_one_incidence(theta_r[rows], phi_r[rows] - phi_i[rows])
        weights[rows] = own / own.mean()
    return weights


def from_normal(theta: np.ndarray) -> np.ndarray:
    """Angle to the normal of the side of the sample that a direction is on, rad."""
    return np.minimum(theta, np.pi - theta)


def projected_solid_angles(m: Measurement, rows: np.ndarray) -> np.ndarray | None:
    """Projected solid angle in sr of some rows of one incidence, all on one side.

    What the file states, in a column of that name (one source direction at a time), or
    what lies between the rows on rings; None where neither is known.
    """
    stated = m.auxiliary.get(PROJECTED_SOLID_ANGLE)
    if stated is not None:
        return stated[rows] / np.unique(np.round(m.phi_i[rows], 6)).size
    theta_r = from_normal(m.theta_r[rows])
    angle = solid_angles(theta_r, m.phi_r[rows] - m.phi_i[rows])
    return None if angle is None else angle * np.cos(theta_r)


def solid_angles(theta_r: np.ndarray, delta: np.ndarray) -> np.ndarray | None:
    """Solid angle in sr of each row of one incidence; ``delta = phi_r - phi_i``.

    None where the directions are not on rings, so that no absolute figure is known. Rows
    that lie on one side of the plane of incidence stand for both. Sparse rings, such as a
    fine scan of the plane of incidence between full ones, lie inside what the full rings
    stand for and get 0.
    """
    ring = angle_labels(theta_r)
    if not _on_rings(ring):
        return None
    sparse = _sparse_rings(theta_r, delta, ring)[ring]
    out = np.zeros(theta_r.size)
    full = np.flatnonzero(~sparse)
    if np.unique(ring[full]).size < 4:
        return None
    again = angle_labels(theta_r[full])
    out[full] = _zones(theta_r[full], again)[again] * _widths(delta, ring)[full]
    return out


def incidence_labels(theta_i: np.ndarray) -> np.ndarray:
    """A running number per polar angle of incidence, ascending.

    More than 90 of them are scattered and are put together by degrees.
    """
    label = angle_labels(theta_i)
    if label.max(initial=0) < _MANY:
        return label
    return np.unique(theta_i // _BIN, return_inverse=True)[1].reshape(-1)


def angle_labels(theta: np.ndarray) -> np.ndarray:
    """A running number per distinct angle, ascending.

    Angles belong together that follow each other by less than 1e-3 rad, which forgives
    the jitter of an instrument.
    """
    order = np.argsort(theta, kind="stable")
    label = np.empty(theta.size, dtype=np.int64)
    new = np.diff(theta[order]) > _SAME_ANGLE
    label[order] = np.concatenate([[0], np.cumsum(new)])[: theta.size]
    return label


def _on_rings(ring: np.ndarray) -> bool:
    count = int(ring.max()) + 1
    return count > 3 and ring.size >= 3 * count


def _of_one_incidence(theta: np.ndarray, delta: np.ndarray) -> np.ndarray:
    ring = angle_labels(theta)
    if ring.max() > 2 and not _on_rings(ring):
        return _of_scattered(theta, delta)
    sparse = _sparse_rings(theta, delta, ring)
    zones, widths = _zones(theta, ring), _widths(delta, ring)
    if sparse.any() and not sparse.all():
        # Full rings keep the zone between full rings; a sparse ring's rows are as wide
        # as a usual row.
        full = np.flatnonzero(~sparse[ring])
        zones[~sparse] = _zones(theta[full], angle_labels(theta[full]))
        arc = np.median(widths[full] * np.sin(theta[full]))
        rows = np.flatnonzero(sparse[ring])
        widths[rows] = arc / np.maximum(np.sin(theta[rows]), 1e-3)
    return zones[ring] * widths


def _zones(theta: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Difference of the cosines of the mid-angles around each ring."""
    level = np.bincount(ring, theta) / np.bincount(ring)
    if level.size == 1:
        return np.ones(1)
    middle = 0.5 * (level[1:] + level[:-1])
    first = 1.5 * level[0] - 0.5 * level[1]
    last = 1.5 * level[-1] - 0.5 * level[-2]
    if level[-1] < 0.5 * np.pi:
        last = min(last, 0.5 * np.pi)
    lower = np.concatenate([[max(first, 0.0)], middle])
    upper = np.concatenate([middle, [last]])
    return np.abs(np.cos(lower) - np.cos(upper)) + 1e-12


def _sparse_rings(theta: np.ndarray, delta: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Rings whose rows are much farther apart than those of the usual ring."""
    level = np.bincount(ring, theta) / np.bincount(ring)
    angle = np.mod(delta, 2 * np.pi)
    order = np.lexsort((angle, ring))
    gaps, own = np.diff(angle[order]), ring[order][1:]
    counts = (np.diff(ring[order]) == 0) & (gaps > _SAME_ANGLE)
    least = np.full(level.size, np.inf)
    np.minimum.at(least, own[counts], gaps[counts])
    arc = np.where(np.isfinite(least), least, np.pi) * np.sin(level)
    return arc > _SPARSE * np.median(arc) + _SAME_ANGLE


def _widths(delta: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Width in azimuth of every row, rad."""
    delta = np.asarray(delta, dtype=np.float64)
    side = np.sin(delta)
    one_sided = bool(np.all(side > -_SAME_ANGLE) or np.all(side < _SAME_ANGLE))
    out = np.empty(delta.size)
    order = np.argsort(ring, kind="stable")
    for rows in np.split(order, np.cumsum(np.bincount(ring))[:-1]):
        out[rows] = _azimuth_widths(delta[rows].tobytes(), one_sided)
    return out


@functools.lru_cache(maxsize=256)
def _azimuth_widths(raw: bytes, one_sided: bool) -> np.ndarray:
    """Width in azimuth between the mid-points to the neighbours on a ring, rad.

    A gap more than twice as wide as the usual one and as both of its neighbours is not
    bridged: what was not measured stands for nothing. Repeated directions share their
    width. ``raw`` holds float64 angles: most instruments scan every ring of every sample
    alike, so that most rings have been seen before.
    """
    delta = np.frombuffer(raw)
    angle = np.mod(delta, 2 * np.pi)
    if one_sided:
        angle = np.abs(np.arctan2(np.sin(delta), np.cos(delta)))
    group = angle_labels(angle)
    count = np.bincount(group)
    angle = np.bincount(group, angle) / count
    if angle.size == 1:
        return np.full(delta.size, 2 * np.pi / delta.size)
    inner = np.diff(angle)
    if one_sided:
        # The mirror images of the first and the last row are their neighbours.
        gaps = np.concatenate([2 * angle[:1], inner, 2 * (np.pi - angle[-1:])])
        around = np.concatenate([inner[:1], gaps, inner[-1:]])
    else:
        gaps = np.concatenate([inner, angle[:1] + 2 * np.pi - angle[-1:]])
        around = np.concatenate([gaps[-1:], gaps, gaps[:1]])
    beside = np.maximum(around[:-2], around[2:])
    gaps = np.minimum(gaps, 2.0 * np.maximum(beside, np.median(inner)))
    width = gaps[:-1] + gaps[1:] if one_sided else 0.5 * (gaps + np.roll(gaps, 1))
    return (width / count)[group] + 1e-12


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
