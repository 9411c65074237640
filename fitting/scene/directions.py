"""Sums over the directions of a light: what it gives to surfaces that face any way."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

_COARSEST = math.radians(1.0)
_FEWEST = 48
_AT_ONCE = 200_000
_STEPS = 60
# Steps that all starts make before the best goes on alone.
_STEPS_OF_ALL = 3

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

    Cells of half of ``finest``, or 1 degree, in polar angle and azimuth; their solid angles
    are exact.
    """
    size = min(0.5 * finest, _COARSEST)
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


def vector_irradiance(
    pattern: Pattern,
    axis: np.ndarray,
    half_angle: float,
    finest: float,
    weights: np.ndarray,
    normals: np.ndarray,
) -> np.ndarray:
    """``int L w dw`` ``(m, 3)`` over each normal's side, L = ``weights (k,)`` @ pattern."""
    if half_angle == 0:
        value = float(weights @ pattern(*(np.array([a]) for a in axis))[:, 0])
        return np.where((normals @ axis > 0)[:, None], value * axis, 0.0)
    total = 0.0
    for directions, solid in cells(axis, half_angle, finest):
        weighed = (weights @ pattern(*directions.T)) * solid
        seen = (normals @ directions.T > 0).astype(np.float64)
        total = total + seen @ (weighed[:, None] * directions)
    return np.asarray(total)


def brightest_normal(
    vector: Callable[[np.ndarray], np.ndarray], starts: np.ndarray
) -> np.ndarray:
    """Unit normal ``(3,)`` whose irradiance is largest; ``starts (m, 3)`` need no length.

    Irradiance is convex in the normal and homogeneous, and its gradient is the ``vector``
    irradiance; going to the gradient's direction never makes it smaller.
    """
    normals = starts / np.linalg.norm(starts, axis=1, keepdims=True)
    best = 0.0
    for step in range(_STEPS):
        gradient = vector(normals)
        length = np.linalg.norm(gradient, axis=1)
        lit = length > 0
        if not lit.any():
            return np.array([0.0, 0.0, 1.0])
        normals = gradient[lit] / length[lit, None]
        if step >= _STEPS_OF_ALL:
            normals = normals[[int(np.argmax(length[lit]))]]
            if length.max() <= best * (1 + 1e-9):
                break
        best = float(length.max())
    return normals[0]
