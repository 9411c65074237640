"""Hemispherical sums over the rows of a measurement."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from data_formats import Measurement
from data_formats.measurement import PROJECTED_SOLID_ANGLE
from fitting.quantities import percent
from fitting.reflectance.beams import (
    Conical,
    Directional,
    Hemispherical,
    projected_solid_angle,
)
from fitting.reflectance.rings import arc
from fitting.reflectance.rows import Missing, Part, at_incidence, incidences, mixed
from fitting.solid_angle import angle_labels, from_normal, projected_solid_angles

LEAST_COVERED = 0.5
STATED = (
    "the file states the projected solid angle of each row; its values count as averages "
    "over patches that fill the hemisphere, and nothing is added for the sampling"
)
_STEPS = 256
# A ring's zone and its rows' solid angles differ in second order of its width.
_SAME_ZONE = 0.005


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
        angle = math.degrees(float(from_normal(m.theta_i).mean()))
        raise Missing(
            f"at {angle:.1f} deg the rows are not on rings around the normal"
            if full is None
            else f"at {angle:.1f} deg the rows cover {share} of it, less than half"
        )
    if PROJECTED_SOLID_ANGLE in m.auxiliary:
        return full.noting(STATED)
    ring = angle_labels(from_normal(m.theta_r))
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
    """``sum_k Z_k <f>_k`` over the rings ``k``, or None if the rows are on none.

    ``Z_k`` is the projected solid angle of the zone of a ring without the trap, ``<f>_k``
    the mean of its rows outside of the trap. What its rows do not cover of ``Z_k`` is
    extrapolated, as is a ring without such rows, which has the mean of the nearest.
    """
    projected = projected_solid_angles(m, np.arange(m.n_rows))
    if projected is None:
        return None
    used = np.flatnonzero(projected > 0)
    m, projected = m.select(used), projected[used]
    theta = from_normal(m.theta_r)
    own = _around_own_mirror(m, region)
    ring = angle_labels(theta)
    level = np.bincount(ring, theta) / np.bincount(ring)
    if PROJECTED_SOLID_ANGLE in m.auxiliary:
        zones, beyond = _stated_zones(np.bincount(ring, projected), own)
    else:
        edges = np.concatenate([[0.0], 0.5 * (level[1:] + level[:-1]), [0.5 * np.pi]])
        zones, beyond = _zones(edges, own), 0.0
    share = np.where(m.valid & ~_trapped(m, theta, own)[:, None], projected[:, None], 0.0)
    value = np.where(m.valid, m.value, 0.0)
    covered, light = np.zeros((2, level.size, m.n_channels))
    np.add.at(covered, ring, share)
    np.add.at(light, ring, share * value)
    known = covered > 1e-12
    mean = np.divide(light, covered, out=np.zeros_like(light), where=known)
    # No rows stand for more than the zone they are in.
    full = covered > (1.0 - _SAME_ZONE) * zones[:, None]
    scale = np.divide(
        zones[:, None], covered, out=np.ones_like(covered), where=full & known
    )
    rest = np.where(full, 0.0, zones[:, None] - covered)
    for c in range(m.n_channels):
        if known[:, c].any() and not known[:, c].all():
            of = np.flatnonzero(known[:, c])
            near = np.abs(level[:, None] - level[of]).argmin(axis=1)
            mean[:, c] = mean[of[near], c]
    counted = np.sum(scale * light, axis=0)
    counts = np.sum(scale * covered, axis=0)
    average = np.divide(counted, counts, out=np.zeros_like(counts), where=counts > 0)
    missing = np.sum(rest * mean, axis=0) + beyond * average
    sigma = np.zeros(m.n_channels)
    if m.sigma is not None:
        each = np.where(m.valid, m.sigma, 0.0)
        sigma = np.sqrt(np.sum((scale[ring] * share * each) ** 2, axis=0))
    # The value goes with the region that was asked for, at another angle of incidence.
    whole = projected_solid_angle(own)
    to_region = projected_solid_angle(region) / whole
    return Part(
        to_region * (counted + missing),
        1.0 - (rest.sum(axis=0) + beyond) / whole,
        to_region * np.abs(missing),
        np.zeros(m.n_channels),
        None if m.sigma is None else to_region * sigma,
        used.size,
    )


def _around_own_mirror(m: Measurement, region: Hemispherical) -> Hemispherical:
    """The hemisphere with the trap around the mirror direction of these rows' source."""
    if region.exclude is None:
        return region
    theta_i = float(from_normal(m.theta_i).mean())
    cone = Conical(math.degrees(theta_i), 180.0, region.exclude.half_angle_deg)
    return Hemispherical(cone)


def _trapped(m: Measurement, theta: np.ndarray, region: Hemispherical) -> np.ndarray:
    """Rows inside the trap; those on its edge are not."""
    if region.exclude is None:
        return np.zeros(theta.size, dtype=bool)
    own = math.radians(region.exclude.theta_deg)
    aside = np.cos(m.phi_r - m.phi_i)
    cosine = np.cos(theta) * math.cos(own) - np.sin(theta) * math.sin(own) * aside
    return cosine > math.cos(math.radians(region.exclude.half_angle_deg)) + 1e-9


def _stated_zones(whole: np.ndarray, region: Hemispherical) -> tuple[np.ndarray, float]:
    """What the trap leaves of each ring's stated solid angle, and what no row states, sr.

    From the normal on, rings that fill ``sin^2 theta`` of the projected hemisphere end at
    ``theta``.
    """
    filled = np.concatenate([[0.0], np.cumsum(whole)]) / max(math.pi, whole.sum())
    edges = np.arcsin(np.sqrt(np.clip(filled, 0.0, 1.0)))
    left = 1.0
    if region.exclude is not None:
        left = _zones(edges, region) / np.maximum(_zones(edges, Hemispherical()), 1e-300)
    zones = whole * left
    beyond = projected_solid_angle(region) - zones.sum()
    return zones, beyond if beyond > 1e-6 else 0.0


def _zones(edges: np.ndarray, region: Hemispherical) -> np.ndarray:
    """Projected solid angle of each zone without the trap, sr."""
    step = np.diff(edges)[:, None] / _STEPS
    theta = edges[:-1, None] + step * (np.arange(_STEPS) + 0.5)
    return np.sum(arc(region, theta) * np.sin(theta) * np.cos(theta) * step, axis=1)


def _share(part: Part) -> float:
    top = float(np.max(np.abs(part.value)))
    return float(np.max(part.extrapolated)) / top if top > 0 else 0.0
