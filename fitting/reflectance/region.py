"""Parts of a hemisphere, bounded by circles, and where rays of a chart meet them.

In both charts a circle is a quadratic along a ray: ``A t^2 + B t + C >= 0`` inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fitting.reflectance.beams import Beam, Conical, Hemispherical, unit_vector

Role = Literal["inside", "outside", "cut"]


@dataclass(frozen=True)
class Cap:
    """Directions within ``half_angle`` (rad) of an axis, each one or one per owner.

    Its boundary ends a region (``inside``, ``outside``) or only a panel (``cut``).
    """

    axis: np.ndarray
    half_angle: float | np.ndarray
    role: Role = "inside"

    @property
    def cosine(self) -> np.ndarray:
        # np.cos(np.pi / 2) is not 0, and the horizon is there exactly.
        cosine = np.cos(self.half_angle)
        return np.where(np.abs(cosine) < 1e-15, 0.0, cosine)

    @property
    def versine(self) -> np.ndarray:
        """``1 - cos``, with all digits for narrow ones."""
        return 2.0 * np.sin(0.5 * np.asarray(self.half_angle)) ** 2


HORIZON = Cap(np.array([0.0, 0.0, 1.0]), 0.5 * math.pi)


def caps_of(beam: Beam) -> tuple[Cap, ...]:
    """The circles that bound a cone or a hemisphere, above the horizon."""
    if isinstance(beam, Conical):
        return HORIZON, cap_of(beam, "inside")
    if isinstance(beam, Hemispherical) and beam.exclude is not None:
        return HORIZON, cap_of(beam.exclude, "outside")
    return (HORIZON,)


def cap_of(cone: Conical, role: Role) -> Cap:
    axis = unit_vector(cone.theta_deg, cone.phi_deg)
    return Cap(axis, math.radians(cone.half_angle_deg), role)


def crossings(first: Cap, second: Cap) -> np.ndarray:
    """The two directions where two circles meet, ``(2, N, 3)``; NaN where they do not."""
    a, b = np.atleast_2d(first.axis), np.atleast_2d(second.axis)
    ca, cb = (np.atleast_1d(cap.cosine)[:, None] for cap in (first, second))
    normal = np.cross(a, b)
    s2 = np.sum(normal * normal, axis=1, keepdims=True)
    s2 = np.where(s2 < 1e-24, np.nan, s2)
    c = np.sum(a * b, axis=1, keepdims=True)
    x = ((ca - c * cb) * a + (cb - c * ca) * b) / s2
    with np.errstate(invalid="ignore"):
        step = np.sqrt((1.0 - np.sum(x * x, axis=1, keepdims=True)) / s2) * normal
    return np.stack([x + step, x - step])


def roots(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``(-b -/+ sqrt(b^2 - 4 a c)) / 2 a`` without cancellation.

    Where there are none, both are at the extremum: a tangent, but for rounding.
    """
    disc = np.maximum(b * b - 4.0 * a * c, 0.0)
    q = -0.5 * (b + np.where(b >= 0, 1.0, -1.0) * np.sqrt(disc))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        far, near = q / a, c / q
    return np.where(b >= 0, far, near), np.where(b >= 0, near, far)
