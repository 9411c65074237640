"""Hemispherical sums over the rows of a measurement."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from data_formats import Measurement
from fitting.quantities import percent
from fitting.reflectance.beams import Directional, Hemispherical, projected_solid_angle
from fitting.reflectance.rings import arc
from fitting.reflectance.rows import Missing, Part, at_incidence, incidences, mixed
from fitting.solid_angle import angle_labels, solid_angles

LEAST_COVERED = 0.5
_STEPS = 64


def at_angle(m: Measurement, incident: Directional, region: Hemispherical) -> Part:
    """``sum f cos dw`` for one angle of incidence, see `at_incidence`."""

    def of_rows(rows: Measurement) -> Part:
        part = _sum(rows, region)
        return part.noting(
            f"rows cover {percent(float(np.min(part.covered)))} of the projected solid "
            f"angle; {percent(_share(part))} of the value is extrapolated"
        )

    return at_incidence(m, incident, of_rows)


def over_sky(m: Measurement, region: Hemispherical) -> Part:
    """``2 int E mu dmu`` over the angles of incidence, with ``E`` linear in ``mu^2``.

    Outside of the measured angles ``E`` is that of the outermost, and counts as
    extrapolated. Schaepman-Strub et al. 2006, white-sky albedo. Raises `Missing` with
    fewer than three angles, or a quarter of the weight outside.
    """
    angles, groups = incidences(m, None)
    if angles.size < 3:
        raise Missing(f"it has {angles.size} angles of incidence; three are needed")
    weight, outside = _sky_weights(angles)
    if outside.sum() > 1.0 - LEAST_COVERED:
        raise Missing(
            f"angles of incidence from {angles[0]:.0f} to {angles[-1]:.0f} deg are "
            f"{percent(1.0 - outside.sum())} of uniform light"
        )
    parts = [_sum(g, region) for g in groups]
    total = mixed(parts, weight, spread=False)
    missing = outside @ np.stack([p.value for p in parts])
    every_second = np.arange(0, angles.size, 2)
    few, _ = _sky_weights(angles[every_second])
    thinned = few @ np.stack([parts[k].value for k in every_second])
    sampling = np.hypot(total.sampling, np.abs(thinned - total.value) / math.sqrt(3.0))
    whole = replace(
        total,
        covered=total.covered * (1.0 - outside.sum()),
        extrapolated=total.extrapolated + np.abs(missing),
        sampling=sampling,
    )
    return whole.noting(
        f"over {angles.size} angles of incidence, {angles[0]:.1f} to {angles[-1]:.1f} deg, "
        f"which are {percent(1.0 - outside.sum())} of uniform light; "
        f"{percent(_share(whole))} of the value is extrapolated"
    )


def _sky_weights(angles_deg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights of ``E`` at each angle, sum 1, and what of them is extrapolated."""
    s = np.sin(np.radians(angles_deg)) ** 2
    middle = 0.5 * (s[1:] + s[:-1])
    outside = np.zeros(s.size)
    outside[0], outside[-1] = s[0], 1.0 - s[-1]
    edges = np.concatenate([[0.0], middle, [1.0]])
    return np.diff(edges), outside


def _sum(m: Measurement, region: Hemispherical) -> Part:
    """The sum of one angle of incidence, what is missing, and how well it is sampled."""
    full = _plain_sum(m, region)
    if full is None or np.min(full.covered) < LEAST_COVERED:
        share = percent(0.0 if full is None else float(np.min(full.covered)))
        angle = math.degrees(float(np.minimum(m.theta_i, np.pi - m.theta_i).mean()))
        raise Missing(
            f"at {angle:.1f} deg the rows are not on rings around the normal"
            if full is None
            else f"at {angle:.1f} deg the rows cover {share} of it, less than half"
        )
    ring = angle_labels(np.minimum(m.theta_r, np.pi - m.theta_r))
    thinned = [_plain_sum(m.select(rows), region) for rows in (
        ring % 2 == 0, _every_second_azimuth(m, ring))]  # fmt: skip
    differences = [np.abs(t.value - full.value) for t in thinned if t is not None]
    if not differences:
        return full.noting("too few rings to judge the sampling")
    # Half of the rows are about four times as far off; no more is assumed than once.
    return replace(full, sampling=np.linalg.norm(differences, axis=0) / math.sqrt(3.0))


def _every_second_azimuth(m: Measurement, ring: np.ndarray) -> np.ndarray:
    keep = np.zeros(m.n_rows, dtype=bool)
    delta = np.mod(m.phi_r - m.phi_i, 2.0 * np.pi)
    for k in np.unique(ring):
        rows = np.flatnonzero(ring == k)
        keep[rows[angle_labels(delta[rows]) % 2 == 0]] = True
    return keep


def _plain_sum(m: Measurement, region: Hemispherical) -> Part | None:
    """Value times projected solid angle; the rest of each zone has the mean of its ring."""
    theta = np.minimum(m.theta_r, np.pi - m.theta_r)
    delta = m.phi_r - m.phi_i
    angle = solid_angles(theta, delta)
    if angle is None:
        return None
    # No row is in the trap.
    projected = angle * np.cos(theta) * ~_trapped(m, theta, delta, region)
    used = np.flatnonzero(angle > 0)
    ring = angle_labels(theta[used])
    level = np.bincount(ring, theta[used]) / np.bincount(ring)
    edges = np.concatenate([[0.0], 0.5 * (level[1:] + level[:-1]), [0.5 * np.pi]])
    zones = _zones(edges, region)
    valid = m.valid[used].astype(float)
    share = projected[used, None] * valid
    value = np.where(m.valid[used], m.value[used], 0.0)
    n = level.size
    covered, light = np.zeros((2, n, m.n_channels))
    np.add.at(covered, ring, share)
    np.add.at(light, ring, share * value)
    known = covered > 1e-12
    mean = np.divide(light, covered, out=np.zeros_like(light), where=known)
    for c in range(m.n_channels):
        if known[:, c].any() and not known[:, c].all():
            of = np.flatnonzero(known[:, c])
            near = np.abs(level[:, None] - level[of]).argmin(axis=1)
            mean[:, c] = mean[of[near], c]
    rest = zones[:, None] - covered
    # A ring's zone and its rows' solid angles differ in second order of its width.
    rest = np.where(rest > 0.005 * zones[:, None], rest, 0.0)
    missing = np.sum(rest * mean, axis=0)
    sigma = None
    if m.sigma is not None:
        own = np.where(m.valid[used], m.sigma[used], 0.0)
        sigma = np.sqrt(np.sum((share * own) ** 2, axis=0))
    covered_share = 1.0 - rest.sum(axis=0) / projected_solid_angle(region)
    return Part(
        light.sum(axis=0) + missing, covered_share, np.abs(missing),
        np.zeros(m.n_channels), sigma, used.size,
    )  # fmt: skip


def _trapped(
    m: Measurement, theta: np.ndarray, delta: np.ndarray, region: Hemispherical
) -> np.ndarray:
    """Rows inside the trap, which is around the mirror direction of their own source."""
    if region.exclude is None:
        return np.zeros(theta.size, dtype=bool)
    own = np.minimum(m.theta_i, np.pi - m.theta_i)
    cosine = np.cos(theta) * np.cos(own) - np.sin(theta) * np.sin(own) * np.cos(delta)
    return cosine > math.cos(math.radians(region.exclude.half_angle_deg))


def _zones(edges: np.ndarray, region: Hemispherical) -> np.ndarray:
    """Projected solid angle of each zone without the trap, sr."""
    step = np.diff(edges)[:, None] / _STEPS
    theta = edges[:-1, None] + step * (np.arange(_STEPS) + 0.5)
    return np.sum(arc(region, theta) * np.sin(theta) * np.cos(theta) * step, axis=1)


def _share(part: Part) -> float:
    top = float(np.max(np.abs(part.value)))
    return float(np.max(part.extrapolated)) / top if top > 0 else 0.0
