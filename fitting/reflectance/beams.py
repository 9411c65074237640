"""Beams of light: a direction, a ring of directions, a cone, a hemisphere.

Polar angles are measured from the normal of the side that the beam is on, in degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fitting.expression import ModelError
from fitting.radiometry import projected_solid_angle_of_cone


@dataclass(frozen=True)
class Directional:
    """A beam along one direction: an infinitesimal cone.

    - `theta_deg`: from the normal, 0 to 90.
    - `phi_deg`: azimuth; the mirror direction of 0 is 180.
    """

    theta_deg: float
    phi_deg: float = 0.0

    def __post_init__(self) -> None:
        _check_direction(self.theta_deg, self.phi_deg)


@dataclass(frozen=True)
class Annular:
    """A thin ring of directions at one polar angle, the mean of all azimuths."""

    theta_deg: float

    def __post_init__(self) -> None:
        _check_direction(self.theta_deg, 0.0)


@dataclass(frozen=True)
class Conical:
    """A circular cone; what lies below the horizon does not count.

    - `theta_deg, phi_deg`: its axis, as of `Directional`.
    - `half_angle_deg`: above 0, to 90.
    """

    theta_deg: float
    phi_deg: float
    half_angle_deg: float

    def __post_init__(self) -> None:
        _check_direction(self.theta_deg, self.phi_deg)
        if not 0 < self.half_angle_deg <= 90:
            raise ModelError(
                f"a cone's half angle is {self.half_angle_deg:g} deg; expected above 0, "
                "to 90"
            )


@dataclass(frozen=True)
class Hemispherical:
    """A whole hemisphere, or what a gloss trap leaves of it.

    - `exclude`: a cone that does not belong to it, such as the trap around the mirror
      direction of d/8 with the specular component excluded.
    """

    exclude: Conical | None = None


Beam = Directional | Annular | Conical | Hemispherical

_KINDS = {
    Directional: "directional", Annular: "directional",
    Conical: "conical", Hemispherical: "hemispherical",
}  # fmt: skip
_BOTH = {"directional": "bidirectional", "conical": "biconical",
         "hemispherical": "bihemispherical"}  # fmt: skip


def nicodemus_name(incident: Beam, collected: Beam) -> str:
    """Which of the nine it is (Nicodemus et al. 1977, table 2)."""
    first, second = _KINDS[type(incident)], _KINDS[type(collected)]
    return _BOTH[first] if first == second else f"{first}-{second}"


def is_thin(beam: Beam) -> bool:
    """Whether it has no solid angle of its own."""
    return isinstance(beam, Directional | Annular)


def projected_solid_angle(beam: Beam) -> float:
    """``int cos(theta) dw`` in sr over a cone or hemisphere, pi for a whole one."""
    if isinstance(beam, Conical):
        return _of_cone(beam)
    if isinstance(beam, Hemispherical):
        return math.pi - (_of_cone(beam.exclude) if beam.exclude else 0.0)
    raise ModelError("a direction has no solid angle")


def describe(beam: Beam) -> str:
    """The beam in words."""
    if isinstance(beam, Directional):
        return f"{beam.theta_deg:g} deg"
    if isinstance(beam, Annular):
        return f"ring at {beam.theta_deg:g} deg"
    if isinstance(beam, Conical):
        axis = f"{beam.theta_deg:g} deg, azimuth {beam.phi_deg:g} deg"
        return f"cone of {beam.half_angle_deg:g} deg half angle around {axis}"
    return (
        f"hemisphere without a {describe(beam.exclude)}" if beam.exclude else "hemisphere"
    )


def unit_vector(theta_deg: float, phi_deg: float) -> np.ndarray:
    """The direction, z along the normal of its side; exact at 0 and 90 degrees."""
    theta, phi = math.radians(theta_deg), math.radians(phi_deg)
    sine, cosine = math.sin(theta), 0.0 if theta_deg == 90 else math.cos(theta)
    return np.array([sine * math.cos(phi), sine * math.sin(phi), cosine])


def _of_cone(cone: Conical) -> float:
    theta, half_angle = math.radians(cone.theta_deg), math.radians(cone.half_angle_deg)
    return float(projected_solid_angle_of_cone(theta, half_angle))


def _check_direction(theta_deg: float, phi_deg: float) -> None:
    if not 0 <= theta_deg <= 90:
        raise ModelError(
            f"a beam's polar angle is {theta_deg:g} deg; expected 0 to 90, from the normal "
            "of the side that it is on"
        )
    if not math.isfinite(phi_deg):
        raise ModelError(f"a beam's azimuth is {phi_deg}; expected a number of degrees")
