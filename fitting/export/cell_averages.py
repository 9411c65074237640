"""Averages of a function over many boxes, with more points where it varies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Function = Callable[[np.ndarray], np.ndarray]

_CHUNK = 1 << 16
# Points per dimension, and the spread among them above which the next number is taken.
_POINTS = {2: 0.05, 4: 0.3, 8: np.inf}


def averages(function: Function, corner: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Averages ``(n, c)`` over boxes at ``corner (n, d)`` of the sides ``size (n, d)``.

    ``function`` maps points ``(m, d)`` to values ``(m, c)``. By midpoints of a grid in each
    box: 2 per dimension, 4 where the brightest channel's values at them differ by more
    than 5 % of their mean, and 8 where those differ by more than 30 %.
    """
    out = np.zeros((len(corner), 0))
    boxes = np.arange(len(corner))
    for points, most in _POINTS.items():
        mean, spread = _midpoints(function, corner[boxes], size[boxes], points)
        if out.shape[1] == 0:
            out = np.empty((len(corner), mean.shape[1]))
        out[boxes] = mean
        boxes = boxes[spread > most]
        if not boxes.size:
            break
    return out


def _midpoints(
    function: Function, corner: np.ndarray, size: np.ndarray, points: int
) -> tuple[np.ndarray, np.ndarray]:
    """Means ``(n, c)`` and relative spreads ``(n,)`` on a grid of midpoints."""
    n, d = corner.shape
    axes = np.meshgrid(*[(np.arange(points) + 0.5) / points] * d, indexing="ij")
    grid = np.stack([a.ravel() for a in axes], axis=1)
    each = max(_CHUNK // len(grid), 1)
    means: list[np.ndarray] = []
    spreads: list[np.ndarray] = []
    for start in range(0, n, each):
        box = slice(start, start + each)
        at = corner[box, None] + grid * size[box, None]
        flat = at.reshape(-1, d)
        # Always as many points, so that the model is compiled once.
        lacking = each * len(grid) - len(flat)
        padded = np.concatenate([flat, np.repeat(flat[:1], lacking, axis=0)])
        value = function(padded)[: len(flat)].reshape(*at.shape[:2], -1)
        mean = value.mean(axis=1)
        bright = value[..., int(np.argmax(mean.sum(axis=0)))]
        top = np.maximum(np.abs(bright.mean(axis=1)), 1e-12)
        means.append(mean)
        spreads.append(np.ptp(bright, axis=1) / top)
    return np.concatenate(means), np.concatenate(spreads)
