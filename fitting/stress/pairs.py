"""Pairs of directions above the surface, drawn from strata where lobes are difficult."""

from __future__ import annotations

import numpy as np

HORIZON = 0.5 * np.pi
THETAS_DEG = (0.0, 1e-6, 1e-3, 45.0, 89.0, 89.9, 90 - 1e-6, 90.0)


def directions(
    width: np.ndarray, rng: np.random.Generator, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """``theta_i, phi_i, theta_o, phi_o (count,)``, rad, for peaks of these widths."""
    width = np.broadcast_to(width, (count,))
    extreme = np.radians(THETAS_DEG)
    anywhere_i, anywhere_o = rng.uniform(0, HORIZON, (2, count))
    ti = np.where(rng.random(count) < 0.5, rng.choice(extreme, count), anywhere_i)
    to = np.where(rng.random(count) < 0.5, rng.choice(extreme, count), anywhere_o)
    apart = np.where(
        rng.random(count) < 0.5,
        rng.choice([0.0, 0.5, 0.5 * np.pi, 2.6, np.pi], count),
        rng.uniform(0, 2 * np.pi, count),
    )
    kind = rng.random(count)
    # The mirror direction or the way back, exactly and nearly on several scales.
    exact = rng.choice([np.pi, 0.0], count)
    off = rng.choice([0.0, 1e-7, 1e-4, 1e-2], count)
    near = kind < 0.2
    to = np.where(near, np.minimum(ti + off, HORIZON), to)
    apart = np.where(near, exact + rng.choice([0.0, 1e-5, 1e-2], count), apart)
    # Within some widths of the peak.
    inside = (kind >= 0.2) & (kind < 0.5)
    slope = width * rng.choice([1e-3, 0.1, 0.5, 1.0, 2.0, 4.0], count)
    theta_p, phi_p = mirrored(ti, slope, rng.uniform(0, 2 * np.pi, count))
    to = np.where(inside, np.minimum(theta_p, HORIZON), to)
    apart = np.where(inside, phi_p + np.where(exact == 0.0, np.pi, 0.0), apart)
    # Nearly opposite grazing directions.
    opposite = (kind >= 0.5) & (kind < 0.6)
    small = 10.0 ** rng.uniform(-9, -1, (3, count)) * (rng.random((3, count)) < 0.8)
    ti = np.where(opposite, HORIZON - small[0], ti)
    to = np.where(opposite, HORIZON - small[1], to)
    apart = np.where(opposite, np.pi + small[2], apart)
    ti = np.where((kind >= 0.6) & (kind < 0.65), 0.0, ti)
    phi = np.where(rng.random(count) < 1 / 3, 0.0, rng.uniform(0, 2 * np.pi, count))
    swap = rng.random(count) < 0.5
    return (
        np.where(swap, to, ti),
        np.where(swap, phi + apart, phi),
        np.where(swap, ti, to),
        np.where(swap, phi, phi + apart),
    )


def mirrored(
    theta: np.ndarray, slope: np.ndarray, azimuth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Reflection of the direction ``(theta, 0)`` at facets of a slope."""
    x, z = np.sin(theta), np.cos(theta)
    hz = 1 / np.sqrt(1 + slope**2)
    hx, hy = slope * hz * np.cos(azimuth), slope * hz * np.sin(azimuth)
    d = x * hx + z * hz
    ox, oy, oz = 2 * d * hx - x, 2 * d * hy, 2 * d * hz - z
    return np.arctan2(np.hypot(ox, oy), oz), np.arctan2(oy, ox)
