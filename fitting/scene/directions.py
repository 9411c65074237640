"""Sums over the directions of a light: what it gives to surfaces that face any way."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

_COARSEST = math.radians(1.0)
_FEWEST = 48
_AT_ONCE = 200_000
_STEPS = 60
_ROWS = 36

# k patterns over directions x, y, z.
Pattern = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def frame(axis: np.ndarray) -> np.ndarray:
    """Rows are an orthonormal frame whose third vector is the axis."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(helper, axis)
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])


def cells(
    axis: np.ndarray, half_angle: float, finest: float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Directions ``(n, 3)`` and solid angles ``(n,)`` that fill a cap, in pieces.

    Cells of ``finest`` or a whole part of it, at most 1 degree, in polar angle and azimuth;
    their solid angles are exact. Those of a map are in line with its rows.
    """
    size = finest / math.ceil(finest / _COARSEST)
    rings = max(math.ceil(half_angle / size - 1e-9), _FEWEST)
    edges = np.linspace(0.0, half_angle, rings + 1)
    theta = 0.5 * (edges[1:] + edges[:-1])
    around = max(math.ceil(2 * math.pi * math.sin(min(half_angle, math.pi / 2)) / size), 96)
    around += around % 2
    # Middles of cells that begin where a map's pixels do.
    phi = (np.arange(around) + 0.5) * 2 * math.pi / around
    solid = np.diff(-np.cos(edges)) * 2 * math.pi / around
    turned = frame(axis) if abs(axis[2]) < 1 else np.diag([1.0, axis[2], axis[2]])
    per_piece = max(_AT_ONCE // around, 1)
    for first in range(0, rings, per_piece):
        t = theta[first : first + per_piece, None]
        local = np.stack(
            np.broadcast_arrays(np.sin(t) * np.cos(phi), np.sin(t) * np.sin(phi), np.cos(t))
        )
        weights = np.repeat(solid[first : first + per_piece], around)
        yield local.reshape(3, -1).T @ turned, weights


def irradiance(
    pattern: Pattern,
    axis: np.ndarray,
    half_angle: float,
    finest: float,
    normals: np.ndarray,
) -> np.ndarray:
    """Irradiance ``(m, k)`` of surfaces with the unit ``normals (m, 3)``.

    ``int pattern max(0, n . w) dw`` by midpoints; the relative error is below 1e-4 for a
    light that is not hidden by the horizon to more than half.
    """
    if half_angle == 0:
        value = pattern(*(np.array([a]) for a in axis))
        return np.maximum(normals @ axis, 0.0)[:, None] * value[:, 0]
    total = 0.0
    for directions, solid in cells(axis, half_angle, finest):
        weighed = pattern(*directions.T) * solid
        total = total + np.maximum(normals @ directions.T, 0.0) @ weighed.T
    return np.asarray(total)


def fluxes(
    pattern: Pattern,
    axis: np.ndarray,
    half_angle: float,
    finest: float,
    weights: np.ndarray,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Directions ``(n, 3)`` and the flux ``(n,)`` from each, in pieces.

    Of radiance ``weights (k,)`` @ pattern times solid angle; of a direction, irradiance.
    """
    if half_angle == 0:
        return [(axis[None], weights @ pattern(*(np.array([a]) for a in axis)))]
    return [
        (directions, (weights @ pattern(*directions.T)) * solid)
        for directions, solid in cells(axis, half_angle, finest)
    ]


def brightest_normal(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Unit normal ``(3,)`` of the surface that gets the largest irradiance from `fluxes`.

    Irradiance is convex in the normal and homogeneous, and its gradient is the flux vector
    of the side that it faces; going to the gradient's direction never makes it smaller. The
    start is the best of many, for the light gathered from about 5 degrees around.
    """
    gathered = sum(_gathered(*piece) for piece in pieces)
    starts = np.concatenate([_spread(500), *(d[:1] for d, _ in pieces)])
    coarse = np.maximum(starts @ np.asarray(gathered).T, 0.0).sum(axis=1)
    normal, best = starts[int(np.argmax(coarse))], 0.0
    for _ in range(_STEPS):
        gradient = sum((flux * (d @ normal > 0)) @ d for d, flux in pieces)
        length = float(np.linalg.norm(gradient))
        if not length > 0:
            return normal
        normal = np.asarray(gradient) / length
        if length <= best * (1 + 1e-10):
            break
        best = length
    return normal


def _gathered(directions: np.ndarray, flux: np.ndarray) -> np.ndarray:
    """Flux vectors ``(m, 3)`` of cells of about 5 degrees."""
    x, y, z = directions.T
    row = np.minimum((np.arccos(np.clip(z, -1, 1)) * _ROWS / np.pi).astype(int), _ROWS - 1)
    column = ((np.arctan2(y, x) / (2 * np.pi) + 0.5) * 2 * _ROWS).astype(int) % (2 * _ROWS)
    cell = row * 2 * _ROWS + column
    each = (np.bincount(cell, flux * a, 2 * _ROWS**2) for a in (x, y, z))
    return np.stack(list(each), axis=1)


def _spread(count: int) -> np.ndarray:
    """Unit vectors ``(count, 3)`` all around, by the golden angle."""
    k = np.arange(count) + 0.5
    z, phi = 1 - 2 * k / count, math.pi * (1 + math.sqrt(5)) * k
    sine = np.sqrt(1 - z * z)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1)
