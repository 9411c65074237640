"""What some rows of a measurement amount to, and the value between rows."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from data_formats import Measurement
from fitting.reflectance.beams import Directional, unit_vector
from fitting.solid_angle import from_normal, incidence_labels

NEAR_DEG = 1.0
_FARTHEST_DEG = 7.5
_WIDEST_GAP_DEG = 20.0
_BEYOND_DEG = 5.0
_NEIGHBOURS = 4


class Missing(ValueError):
    """Why the sampling does not allow a quantity, as part of a sentence."""


@dataclass(frozen=True)
class Part:
    """A sum over rows per channel ``(c,)``, and what of it is uncertain.

    ``extrapolated`` is the part of ``value`` that no row stands for, ``covered`` the share
    of the solid angle that rows do stand for, ``sigma`` from the rows' own (or None).
    """

    value: np.ndarray
    covered: np.ndarray
    extrapolated: np.ndarray
    sampling: np.ndarray
    sigma: np.ndarray | None
    rows: int
    notes: tuple[str, ...] = ()

    def noting(self, note: str) -> Part:
        return dataclasses.replace(self, notes=(*self.notes, note))


def at_incidence(
    m: Measurement, incident: Directional, of_rows: Callable[[Measurement], Part]
) -> Part:
    """A quantity of the rows of one angle of incidence, at any angle.

    That of the rows within 1 deg; else linear between the two angles around it, up to 20
    deg apart, of which half of the difference is uncertain; else that of an angle within
    5 deg. Raises `Missing`.
    """
    wanted = incident.theta_deg
    angles, groups = incidences(m, incident)
    gap = np.abs(angles - wanted)
    nearest = int(np.argmin(gap))
    below, above = np.flatnonzero(angles < wanted), np.flatnonzero(angles > wanted)
    if gap[nearest] > NEAR_DEG and below.size and above.size:
        one, other = int(below[-1]), int(above[0])
        if angles[other] - angles[one] <= _WIDEST_GAP_DEG + NEAR_DEG:
            share = (wanted - angles[one]) / (angles[other] - angles[one])
            parts = [of_rows(groups[k]) for k in (one, other)]
            return mixed(parts, np.array([1.0 - share, share])).noting(
                f"linear between the angles of incidence {angles[one]:.1f} and "
                f"{angles[other]:.1f} deg"
            )
    if gap[nearest] > _BEYOND_DEG:
        raise Missing(
            f"the angle of incidence nearest to {wanted:g} deg is {angles[nearest]:.1f} deg"
        )
    part = of_rows(groups[nearest])
    if gap[nearest] < 0.05:
        return part
    return part.noting(
        f"the light comes from {angles[nearest]:.1f} deg, the nearest that was measured"
    )


def incidences(
    m: Measurement, incident: Directional | None
) -> tuple[np.ndarray, list[Measurement]]:
    """Angles of incidence in deg from the normal, ascending, and their rows."""
    some = m.select(m.valid.any(axis=1))
    if not some.n_rows:
        raise Missing("it has no valid row")
    if some.symmetry == "anisotropic":
        at = 0.0 if incident is None else math.radians(incident.phi_deg)
        turned = np.abs(np.arctan2(np.sin(some.phi_i - at), np.cos(some.phi_i - at)))
        upright = from_normal(some.theta_i) < 1e-3
        if incident is None and np.any((turned > 0.02) & ~upright):
            raise Missing("it is anisotropic, and uniform light needs all azimuths")
        some = some.select((turned <= 0.02) | upright)
        if not some.n_rows:
            raise Missing(f"it has no light from the azimuth {math.degrees(at):g} deg")
    theta = from_normal(some.theta_i)
    label = incidence_labels(theta)
    groups = [some.select(label == k) for k in np.unique(label)]
    angles = np.array([theta[label == k].mean() for k in np.unique(label)])
    return np.degrees(angles), groups


def mixed(parts: list[Part], weight: np.ndarray, *, spread: bool = True) -> Part:
    value, covered, extrapolated, sampling = (
        weight @ np.stack([getattr(p, n) for p in parts])
        for n in ("value", "covered", "extrapolated", "sampling")
    )
    if spread:
        half = 0.5 * np.abs(parts[0].value - parts[-1].value)
        sampling = np.hypot(sampling, half / math.sqrt(3.0))
    sigma = None
    if parts[0].sigma is not None:
        own = np.stack([p.sigma for p in parts if p.sigma is not None])
        sigma = np.sqrt(np.sum((weight[:, None] * own) ** 2, axis=0))
    notes = tuple(dict.fromkeys(n for p in parts for n in p.notes))
    rows = sum(p.rows for p in parts)
    return Part(value, covered, extrapolated, sampling, sigma, rows, notes)


def between_directions(
    m: Measurement, incident: Directional, collected: Directional
) -> Part:
    """The value at one pair of directions, 1/sr; of the angle of incidence as above.

    The nearest row within 1 deg, else the mean of up to four rows within 7.5 deg weighted
    by the inverse square of their distance, of which half of the range is uncertain.
    Azimuths count relative to the source's unless the data are anisotropic. Where the
    pair was not measured the exchanged one is used. Raises `Missing`.
    """
    try:
        return _between(m, incident, collected)
    except Missing as first:
        if m.transmitted.any():
            raise
        try:
            part = _between(m, collected, incident)
        except Missing:
            raise first from None
    return part.noting("light and detector are exchanged, by reciprocity")


def _between(m: Measurement, incident: Directional, collected: Directional) -> Part:
    turn = collected.phi_deg
    if m.symmetry != "anisotropic":
        turn -= incident.phi_deg
    return at_incidence(
        m, incident, lambda rows: _at_detector(rows, collected.theta_deg, turn)
    )


def _at_detector(m: Measurement, theta_deg: float, azimuth_deg: float) -> Part:
    """Rows of one incidence near a detector's direction, averaged."""
    theta_r = from_normal(m.theta_r)
    azimuth, wanted = m.phi_r, math.radians(azimuth_deg)
    if m.symmetry != "anisotropic":
        azimuth = m.phi_r - m.phi_i
    if m.symmetry == "bilateral":
        azimuth = np.abs(np.arctan2(np.sin(azimuth), np.cos(azimuth)))
        wanted = abs(math.atan2(math.sin(wanted), math.cos(wanted)))
    distance = _angle(
        _vectors(theta_r, azimuth), unit_vector(theta_deg, math.degrees(wanted))
    )
    upright = from_normal(m.theta_i) < 1e-3
    if m.symmetry != "anisotropic" and upright.all():
        # Light along the normal knows no azimuth.
        distance = np.abs(np.degrees(theta_r) - theta_deg)
    rows = np.argsort(distance, kind="stable")[:_NEIGHBOURS]
    rows = rows[distance[rows] <= _FARTHEST_DEG]
    if not rows.size:
        raise Missing(f"no row is within {_FARTHEST_DEG:g} deg of these directions")
    if distance[rows[0]] <= NEAR_DEG:
        rows = rows[:1]
    weight = 1.0 / np.maximum(distance[rows], 1e-9) ** 2
    table = weight[:, None] * m.valid[rows]
    if not table.any(axis=0).all():
        raise Missing("the rows next to these directions are not valid in all channels")
    table = table / table.sum(axis=0)
    value = np.where(m.valid[rows], m.value[rows], 0.0)
    low = np.min(np.where(m.valid[rows], value, np.inf), axis=0)
    high = np.max(np.where(m.valid[rows], value, -np.inf), axis=0)
    sigma = None
    if m.sigma is not None:
        own = np.where(m.valid[rows], m.sigma[rows], 0.0)
        sigma = np.sqrt(np.sum((table * own) ** 2, axis=0))
    away = f"{distance[rows[0]]:.1f} deg away from the detector's direction"
    said = f"the nearest row is {away}"
    if rows.size > 1:
        said = f"{rows.size} rows are averaged, the nearest {away}"
    zero = np.zeros(m.n_channels)
    spread = 0.5 * (high - low) / math.sqrt(3.0)
    mean = np.sum(table * value, axis=0)
    return Part(mean, zero + 1.0, zero, spread, sigma, rows.size, (said,))


def _vectors(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )


def _angle(vectors: np.ndarray, other: np.ndarray) -> np.ndarray:
    half = 0.5 * np.linalg.norm(vectors - other, axis=-1)
    return np.degrees(2.0 * np.arcsin(np.minimum(half, 1.0)))
