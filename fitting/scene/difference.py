"""Differences between pictures, in the measure of a scene's tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fitting.colorimetry import colour_science, delta_e_2000, srgb_to_xyz
from fitting.scene.description import RelativeRadiance, Scene
from fitting.scene.photometry import Photometry

COLOUR, RADIANCE, ALBEDO = "colour difference", "relative radiance", "albedo"


@dataclass(frozen=True)
class Measure:
    """How two pictures are compared: `COLOUR`, `RADIANCE` or `ALBEDO`.

    ``limits`` are the tolerance's: mean and 95th percentile, or the largest albedo error.
    """

    name: str
    limits: tuple[float, ...]
    scene: Scene
    photometry: Photometry

    def between(self, image: np.ndarray, data: np.ndarray) -> np.ndarray:
        """Of radiances ``(p, c)``: per pixel ``(p, 1)``, or also per channel ``(p, c)``."""
        if self.name == COLOUR:
            return delta_e_2000(self.lab(image), self.lab(data))[:, None]
        counts = self.photometry.counts
        difference = np.abs(image - data)[:, counts]
        if self.name == ALBEDO:
            return difference
        limit = self.scene.tolerance.relative_radiance
        floor = limit.floor if isinstance(limit, RelativeRadiance) else 0.0
        least = floor * self.photometry.white[counts]
        return difference / np.maximum(np.maximum(data[:, counts], least), 1e-300)

    def statistics(
        self, differences: np.ndarray, weight: np.ndarray
    ) -> tuple[float, float]:
        """Mean and 95th percentile by weights ``(p,)``; of an albedo twice the largest."""
        if not weight.any():
            return 0.0, 0.0
        if self.name == ALBEDO:
            largest = float(differences[weight > 0].max())
            return largest, largest
        mean = float(weight @ differences.mean(axis=1))
        each = np.repeat(weight, differences.shape[1])
        order = np.argsort(differences, axis=None, kind="stable")
        reached = np.cumsum(each[order]) / each.sum()
        at = min(int(np.searchsorted(reached, 0.95)), order.size - 1)
        return mean, float(differences.ravel()[order][at])

    def lab(self, image: np.ndarray) -> np.ndarray:
        """L*a*b* ``(p, 3)`` of radiances as the scene's display shows them."""
        xyz, white = image @ self.photometry.tristimulus, self.photometry.display_white
        if self.scene.viewer.clip:
            xyz = clipped(xyz, white)
        return colour_science().XYZ_to_Lab(
            np.maximum(xyz, 0.0) / white[1], white[:2] / white.sum()
        )


def measure(scene: Scene, photometry: Photometry) -> Measure:
    """The measure that a scene's tolerance is in."""
    t = scene.tolerance
    if t.colour_difference is not None:
        limits = (t.colour_difference.mean, t.colour_difference.percentile_95)
        return Measure(COLOUR, limits, scene, photometry)
    if t.relative_radiance is not None:
        limits = (t.relative_radiance.mean, t.relative_radiance.percentile_95)
        return Measure(RADIANCE, limits, scene, photometry)
    largest = t.albedo.maximum if t.albedo is not None else 0.0
    return Measure(ALBEDO, (largest,), scene, photometry)


def to_display(xyz: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Linear RGB ``(p, 3)`` of a display with sRGB's primaries whose white is ``white``."""
    return xyz @ np.linalg.inv(_primaries(white)).T


def clipped(xyz: np.ndarray, white: np.ndarray) -> np.ndarray:
    """XYZ of a display that cannot be brighter than its white in any primary."""
    return np.minimum(to_display(xyz, white), 1.0) @ _primaries(white).T


def _primaries(white: np.ndarray) -> np.ndarray:
    """Columns are the primaries, scaled so that together they give the white."""
    chromatic = srgb_to_xyz()
    chromatic = chromatic / chromatic.sum(axis=0)
    return chromatic * np.linalg.solve(chromatic, white)
