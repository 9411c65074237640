"""Luminance distributions of the CIE standard general skies (ISO 15469:2004, CIE S 011)."""

from __future__ import annotations

import math

import numpy as np

# ISO 15469:2004, table 1: a, b of the gradation and c, d, e of the indicatrix.
STANDARD = (
    (4.0, -0.70, 0.0, -1.0, 0.00),
    (4.0, -0.70, 2.0, -1.5, 0.15),
    (1.1, -0.80, 0.0, -1.0, 0.00),
    (1.1, -0.80, 2.0, -1.5, 0.15),
    (0.0, -1.00, 0.0, -1.0, 0.00),
    (0.0, -1.00, 2.0, -1.5, 0.15),
    (0.0, -1.00, 5.0, -2.5, 0.30),
    (0.0, -1.00, 10.0, -3.0, 0.45),
    (-1.0, -0.55, 2.0, -1.5, 0.15),
    (-1.0, -0.55, 5.0, -2.5, 0.30),
    (-1.0, -0.55, 10.0, -3.0, 0.45),
    (-1.0, -0.32, 10.0, -3.0, 0.45),
    (-1.0, -0.32, 16.0, -3.0, 0.30),
    (-1.0, -0.15, 16.0, -3.0, 0.30),
    (-1.0, -0.15, 24.0, -2.8, 0.15),
)

TRADITIONAL_OVERCAST = 16

# As the standard calls them.
NAMES = (
    "CIE overcast, steep gradation, azimuthal uniformity",
    "overcast, steep gradation, slight brightening towards the sun",
    "overcast, moderately graded, azimuthal uniformity",
    "overcast, moderately graded, slight brightening towards the sun",
    "uniform",
    "partly cloudy, no gradation, slight brightening towards the sun",
    "partly cloudy, no gradation, brighter circumsolar region",
    "partly cloudy, no gradation, distinct solar corona",
    "partly cloudy, with the sun obscured",
    "partly cloudy, with brighter circumsolar region",
    "white-blue, with distinct solar corona",
    "CIE clear, low luminance turbidity",
    "CIE clear, polluted atmosphere",
    "cloudless turbid, with broad solar corona",
    "white-blue turbid, with broad solar corona",
    "traditional CIE overcast, (1 + 2 cos theta) / 3",
)

_HORIZON = 1e-9


def relative_luminance(
    sky: int,
    x: np.ndarray,
    y: np.ndarray,
    z: np.ndarray,
    *,
    sun: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> np.ndarray:
    """Luminance ``(n,)`` towards unit vectors, relative to the zenith; 0 below the horizon.

    ``L / L_z = f(chi) phi(theta) / (f(theta_sun) phi(0))`` with the gradation
    ``phi = 1 + a exp(b / cos theta)`` and the indicatrix ``f = 1 + c (exp(d chi) -
    exp(d pi / 2)) + e cos^2 chi``, chi the angle to the sun (ISO 15469, equations 1 to 5).
    Type 16 is ``(1 + 2 cos theta) / 3`` (Moon and Spencer 1942, in the standard's annex).
    """
    up = np.maximum(z, _HORIZON)
    if sky == TRADITIONAL_OVERCAST:
        return np.where(z >= 0, (1.0 + 2.0 * up) / 3.0, 0.0)
    a, b, *_ = STANDARD[sky - 1]
    gradation = (1.0 + a * np.exp(b / up)) / (1.0 + a * math.exp(b))
    cos_chi = np.clip(x * sun[0] + y * sun[1] + z * sun[2], -1.0, 1.0)
    at_zenith = indicatrix(sky, np.array(max(-1.0, min(1.0, sun[2]))))
    return np.where(z >= 0, gradation * indicatrix(sky, cos_chi) / at_zenith, 0.0)


def indicatrix(sky: int, cos_chi: np.ndarray) -> np.ndarray:
    """The indicatrix f of a type 1 to 15 at the cosine of the angle chi to the sun."""
    _, _, c, d, e = STANDARD[sky - 1]
    at_right_angle = math.exp(d * math.pi / 2)
    return 1.0 + c * (np.exp(d * np.arccos(cos_chi)) - at_right_angle) + e * cos_chi**2


def corona_width(sky: int) -> float:
    """Angle, rad, across which the brightening around the sun is above its half.

    Between f at the sun and the least of f. pi for a sky that does not brighten.
    """
    if sky == TRADITIONAL_OVERCAST or STANDARD[sky - 1][2] == 0:
        return math.pi
    chi = np.linspace(0.0, np.pi / 2, 9001)
    f = indicatrix(sky, np.cos(chi))
    return float(2.0 * chi[np.argmax(f < 0.5 * (f[0] + f.min()))])
