"""What is seen: a plane of points, cut into pixels, each with a normal and a view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fitting.scene.description import Flat, Scene, Sphere
from fitting.scene.emitters import towards
from fitting.scene.histogram import Pairs, pairs

_LEAST_COVERED = 0.02
_COVER = 16
# Directions of a flat sample's viewer: about as many as a coarse picture has pixels.
_POLAR, _AROUND = 16, 24


@dataclass(frozen=True)
class Picture:
    """Pixels ``(p,)`` of a plane of points ``(x, y)``.

    Of a sphere the plane is the camera's, the sphere's disk having radius 1; of a flat
    sample it is ``(cos theta, phi)`` of the viewer. Pixels are rectangles ``low, high
    (p, 2)``; ``share (p,)`` of each is covered by the sample. ``weight (p,)`` is how much
    a pixel counts in a mean, sum 1. ``shape`` is that of the whole raster and ``place
    (p,)`` the pixel's index in it, row by row, for drawing. Of a sphere ``camera`` holds
    the directions right, up and to the viewer; of given ``pairs`` every pixel is one.
    """

    low: np.ndarray
    high: np.ndarray
    share: np.ndarray
    weight: np.ndarray
    shape: tuple[int, int]
    place: np.ndarray
    camera: np.ndarray | None = None
    pairs: Pairs | None = None

    @property
    def size(self) -> int:
        """Number of pixels."""
        return self.low.shape[0]

    @property
    def area(self) -> np.ndarray:
        """Covered area of every pixel ``(p,)``; 1 for single directions."""
        whole = np.prod(self.high - self.low, axis=1)
        return np.where(whole > 0, whole * self.share, 1.0)

    def points(self, pixel: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Points ``(n, 2)`` at the shares ``u (n, 2)`` of pixels ``(n,)``."""
        return self.low[pixel] + u * (self.high - self.low)[pixel]

    def normals_and_views(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normals and views ``(n, 3)``, in the world, and whether the sample is there."""
        if self.camera is not None:
            r2 = np.sum(x**2, axis=1)
            z = np.sqrt(np.maximum(1.0 - r2, 0.0))
            normal = np.column_stack([x, z]) @ self.camera
            return normal, np.broadcast_to(self.camera[2], normal.shape), r2 < 1.0
        sin = np.sqrt(np.maximum(1.0 - x[:, 0] ** 2, 0.0))
        view = np.stack([sin * np.cos(x[:, 1]), sin * np.sin(x[:, 1]), x[:, 0]], axis=1)
        normal = np.broadcast_to(np.array([0.0, 0.0, 1.0]), view.shape)
        return normal, view, np.ones(len(x), dtype=bool)

    def pixel_of(self, x: np.ndarray) -> np.ndarray:
        """The pixel of each point ``(n, 2)``, or -1."""
        rows, columns = self.shape
        raster = np.full(rows * columns, -1)
        raster[self.place] = np.arange(self.size)
        if self.camera is not None:
            column = np.floor((x[:, 0] + 1.0) * 0.5 * columns)
            row = np.floor((1.0 - x[:, 1]) * 0.5 * rows)
        else:
            start, end = self.low.min(axis=0), self.high.max(axis=0)
            turned = start[1] + np.mod(x[:, 1] - start[1], 2 * math.pi)
            row = np.floor((x[:, 0] - start[0]) / (end[0] - start[0]) * rows)
            column = np.floor((turned - start[1]) / (end[1] - start[1]) * columns)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        index = np.where(inside, row * columns + column, 0).astype(int)
        return np.where(inside, raster[index], -1)


def picture(scene: Scene) -> Picture:
    """The pixels of a scene."""
    if isinstance(scene.seen, Sphere):
        return _of_sphere(scene.seen)
    if isinstance(scene.seen, Flat):
        return _of_flat(scene.seen)
    rows = pairs(scene.seen)
    return of_directions(rows.theta_r, rows.phi_r, rows.weight, rows)


def of_directions(
    theta: np.ndarray, phi: np.ndarray, weight: np.ndarray, given: Pairs | None = None
) -> Picture:
    """A flat sample seen from single directions, rad: pixels without area."""
    x = np.stack([np.cos(theta), phi], axis=1)
    n = len(x)
    return Picture(x, x, np.ones(n), weight, (1, n), np.arange(n), pairs=given)


def tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions ``(n, 3)`` of the sample's x and y at points with these normals.

    East and north of a sphere whose poles are up and down, and the world's own of a flat
    sample.
    """
    level = np.hypot(normal[:, 0], normal[:, 1])
    flat = level < 1e-9
    with np.errstate(invalid="ignore", divide="ignore"):
        x = np.where(flat, 0.0, -normal[:, 1] / level)
        y = np.where(flat, 1.0, normal[:, 0] / level)
    first = np.stack([np.where(flat, 1.0, x), np.where(flat, 0.0, y), 0.0 * x], axis=1)
    return first, np.cross(normal, first)


def _of_sphere(seen: Sphere) -> Picture:
    n = seen.pixels
    view = towards(seen.camera_theta_deg, 0.0)
    right = np.array([0.0, 1.0, 0.0])
    axes = np.stack([right, np.cross(view, right), view])
    edge = np.linspace(-1.0, 1.0, n + 1)
    column, row = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n)))
    low = np.stack([edge[column], -edge[row + 1]], axis=1)
    high = np.stack([edge[column + 1], -edge[row]], axis=1)
    u = (np.arange(_COVER) + 0.5) / _COVER
    x = low[:, 0, None] + (high - low)[:, 0, None] * u
    y = low[:, 1, None] + (high - low)[:, 1, None] * u
    share = np.mean(x[:, :, None] ** 2 + y[:, None, :] ** 2 < 1.0, axis=(1, 2))
    kept = share > _LEAST_COVERED
    share = share[kept]
    return Picture(
        low[kept], high[kept], share, share / share.sum(), (n, n),
        np.flatnonzero(kept), camera=axes,
    )  # fmt: skip


def _of_flat(seen: Flat) -> Picture:
    cosine = np.cos(np.radians(seen.theta_deg))[::-1]
    phi = np.radians(seen.phi_deg)
    polar = _POLAR if cosine[1] > cosine[0] else 1
    around = _AROUND if phi[1] > phi[0] else 1
    c = np.linspace(cosine[0], cosine[1], polar + 1)
    p = np.linspace(phi[0], phi[1], around + 1)
    row, column = (a.ravel() for a in np.indices((polar, around)))
    low = np.stack([c[row], p[column]], axis=1)
    high = np.stack([c[row + 1], p[column + 1]], axis=1)
    n = polar * around
    weight = np.full(n, 1.0 / n)
    return Picture(low, high, np.ones(n), weight, (polar, around), np.arange(n))
