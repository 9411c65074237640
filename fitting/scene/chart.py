"""Coordinates of pairs of directions in which lobes stand still.

A surface's gloss is at the same half vector whatever the incidence, and changes slowly
with the angle between light and half vector (Rusinkiewicz 1998, A new change of variables
for efficient BRDF representation). Measured values are interpolated there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fitting.geometry import Geometry, from_components

# Round lobes are interpolated better with less, those of Phong's kind with more.
SQUEEZED = 1.0 / 3.0


@dataclass(frozen=True)
class HalfAngles:
    """``theta_h, phi_h`` of the half vector, and of the light seen from it: ``theta_d`` and
    ``phi_d``, its azimuth against the direction away from the normal; rad, ``(n,)``."""

    theta_h: np.ndarray
    phi_h: np.ndarray
    theta_d: np.ndarray
    phi_d: np.ndarray


def half_angles(g: Geometry) -> HalfAngles:
    """Angles of pairs of directions, from components."""
    hx, hy, hz = (np.asarray(a) for a in (g.hx, g.hy, g.hz))
    sin_h = np.hypot(hx, hy)
    with np.errstate(invalid="ignore", divide="ignore"):
        ux = np.where(sin_h > 0, hx / sin_h, 1.0)
        uy = np.where(sin_h > 0, hy / sin_h, 0.0)
    wix, wiy, cos_i = (np.asarray(a) for a in (g.wix, g.wiy, g.cos_i))
    along = (ux * wix + uy * wiy) * hz - sin_h * cos_i
    across = ux * wiy - uy * wix
    return HalfAngles(
        np.arctan2(sin_h, hz),
        np.arctan2(uy, ux),
        np.arctan2(np.hypot(along, across), np.asarray(g.cos_d)),
        np.arctan2(across, along),
    )


def from_half_angles(a: HalfAngles) -> Geometry:
    """The pairs of directions with these angles."""
    sin_h, hz = np.sin(a.theta_h), np.cos(a.theta_h)
    ux, uy = np.cos(a.phi_h), np.sin(a.phi_h)
    along = np.sin(a.theta_d) * np.cos(a.phi_d)
    across = np.sin(a.theta_d) * np.sin(a.phi_d)
    dx, dy, dz = (
        ux * hz * along - uy * across,
        uy * hz * along + ux * across,
        -sin_h * along,
    )
    cos_d = np.cos(a.theta_d)
    x, y, z = cos_d * sin_h * ux, cos_d * sin_h * uy, cos_d * hz
    return from_components(x + dx, y + dy, z + dz, x - dx, y - dy, z - dz)


@dataclass(frozen=True)
class Chart:
    """Points in space for pairs of directions, near where the values are alike.

    Distances are in units of ``step_h`` and ``step_d`` (rad), the distance of neighbouring
    samples in the half vector and in ``theta_d``. Exchanged directions are one point
    (reciprocity). Of an isotropic surface pairs that differ by a turn of the sample or by
    reflection at the plane of incidence are one point of three dimensions: ``theta_h`` is
    a radius, ``phi_d`` an angle, which is squeezed since it matters little but for shadows
    and off-specular lobes. Else there are four: the half vector, and the light around it.
    """

    step_h: float
    step_d: float
    isotropic: bool
    squeeze: float = SQUEEZED

    def points(self, a: HalfAngles) -> np.ndarray:
        """``(n, 3)`` or ``(n, 4)``."""
        r, s = a.theta_h / self.step_h, a.theta_d / self.step_d
        if self.isotropic:
            folded = np.arctan2(np.abs(np.sin(a.phi_d)), np.abs(np.cos(a.phi_d)))
            turn = self.squeeze * folded
            return np.stack([r * np.cos(turn), r * np.sin(turn), s], axis=-1)
        # The light's azimuth in the surface; twice, as exchanging adds half a turn.
        turn = 2.0 * (a.phi_d + a.phi_h)
        return np.stack(
            [r * np.cos(a.phi_h), r * np.sin(a.phi_h), s * np.cos(turn), s * np.sin(turn)],
            axis=-1,
        )
