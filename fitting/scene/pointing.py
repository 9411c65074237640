"""Directions drawn where they matter: in a light, or around where a lobe may be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fitting.scene.directions import frame
from fitting.scene.emitters import Emitter

# rad; half of the nodes are within about the geometric mean of this and pi.
_NARROWEST = 1e-3
_STRETCH = math.asinh(math.pi / _NARROWEST)
# Cells over which the brightness of a light is looked at, at most, per dimension.
_COARSE, _FINE = 64, 1024
_EVEN = 0.3
# rad; a light without details smaller than this needs no sampler of its own.
_SMOOTH = 0.09


def around(axis: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Directions ``(n, 3)`` around ``axis (n, 3)``, alike at all scales of angle.

    The angle is ``d sinh(u asinh(pi / d))`` with d = 1e-3 rad: as many nodes between 0.01
    and 0.1 as between 0.1 and 1, so that a lobe of any width gets its share.
    """
    angle = _NARROWEST * np.sinh(_STRETCH * u[:, 0])
    phi = 2 * np.pi * u[:, 1]
    first, second = _any_frame(axis)
    sin = np.sin(angle)
    out = (
        (sin * np.cos(phi))[:, None] * first
        + (sin * np.sin(phi))[:, None] * second
        + np.cos(angle)[:, None] * axis
    )
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def density_around(axis: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Density of `around` per solid angle, ``(n,)``."""
    # From the difference: the cosine loses small angles.
    chord = np.linalg.norm(w - axis, axis=1)
    angle = 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    ring = 2 * np.pi * np.maximum(np.sin(angle), 1e-12)
    return 1.0 / (_STRETCH * np.hypot(angle, _NARROWEST) * ring)


def by_cosine(normal: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Directions ``(n, 3)`` with the density ``cos / pi`` around normals ``(n, 3)``."""
    sin, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    first, second = _any_frame(normal)
    out = (
        (sin * np.cos(phi))[:, None] * first
        + (sin * np.sin(phi))[:, None] * second
        + np.sqrt(1.0 - u[:, 0])[:, None] * normal
    )
    return out


def _any_frame(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors that are normal to each axis (Duff et al. 2017)."""
    x, y, z = axis.T
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    return first, second


@dataclass(frozen=True)
class LightSampler:
    """Directions towards a light, more where it is brighter.

    Cells of equal solid angle in ``cos`` and azimuth around the axis; within one the
    density is even.
    """

    emitter: Emitter
    cumulative: np.ndarray
    chance: np.ndarray
    shape: tuple[int, int]

    @staticmethod
    def of(emitter: Emitter) -> LightSampler:
        """The sampler of a light."""
        e = emitter
        size = int(np.clip(math.pi / max(e.finest, 1e-9), _COARSE, _FINE))
        small = e.half_angle < 0.3
        shape = (1, 1) if small else (size // 2, size)
        row, column = (a.ravel() for a in np.indices(shape))
        u = np.stack([(row + 0.5) / shape[0], (column + 0.5) / shape[1]], axis=1)
        power = np.ones(len(u))
        if not small:
            wi = _in_cap(e, u)
            power = np.abs(e.spectrum.sum(axis=1)) @ e.pattern(*np.ascontiguousarray(wi.T))
            total = power.sum()
            power = power / total if total > 0 else np.full(len(u), 1.0 / len(u))
            power = (1 - _EVEN) * power + _EVEN / len(u)
        chance = power / power.sum()
        return LightSampler(e, np.cumsum(chance), chance, shape)

    @property
    def detailed(self) -> bool:
        """Whether the light has details that a look all around would miss."""
        return self.emitter.finest < _SMOOTH

    def draw(self, u: np.ndarray) -> np.ndarray:
        """Directions ``(n, 3)`` for ``u (n, 2)`` in [0, 1)."""
        if self.emitter.half_angle == 0:
            return np.broadcast_to(self.emitter.axis, (len(u), 3))
        if self.chance.size == 1:
            return _in_cap(self.emitter, u)
        cell = np.searchsorted(self.cumulative, u[:, 0] * self.cumulative[-1], side="right")
        cell = np.minimum(cell, self.chance.size - 1)
        # What is left of the first number, and the second, place the point in the cell.
        left = (self.cumulative[cell] - u[:, 0] * self.cumulative[-1]) / self.chance[cell]
        row, column = np.divmod(cell, self.shape[1])
        inside = np.stack(
            [
                (row + np.clip(left, 0.0, 1.0)) / self.shape[0],
                (column + u[:, 1]) / self.shape[1],
            ],
            axis=1,
        )
        return _in_cap(self.emitter, inside)

    def density(self, wi: np.ndarray) -> np.ndarray:
        """Per solid angle, ``(n,)``; 1 for a single direction."""
        e = self.emitter
        if e.half_angle == 0:
            return np.ones(len(wi))
        solid = 2 * math.pi * _one_minus_cos(e.half_angle)
        if self.chance.size == 1:
            return np.full(len(wi), 1.0 / solid)
        local = wi @ frame(e.axis).T
        depth = (1.0 - local[:, 2]) / _one_minus_cos(e.half_angle)
        turn = np.mod(np.arctan2(local[:, 1], local[:, 0]), 2 * np.pi) / (2 * np.pi)
        row = np.clip((depth * self.shape[0]).astype(int), 0, self.shape[0] - 1)
        column = np.clip((turn * self.shape[1]).astype(int), 0, self.shape[1] - 1)
        return self.chance[row * self.shape[1] + column] * self.chance.size / solid


def _one_minus_cos(angle: float) -> float:
    return 2.0 * math.sin(0.5 * angle) ** 2


def _in_cap(e: Emitter, u: np.ndarray) -> np.ndarray:
    """Directions that fill the cap of a light evenly, ``(n, 3)``."""
    depth = u[:, 0] * _one_minus_cos(e.half_angle)
    sin = np.sqrt(np.maximum(depth * (2.0 - depth), 0.0))
    phi = 2 * np.pi * u[:, 1]
    local = np.stack([sin * np.cos(phi), sin * np.sin(phi), 1.0 - depth], axis=1)
    return local @ frame(e.axis)
