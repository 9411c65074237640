"""Geometries by the names that instruments and standards give them."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fitting.expression import ModelError
from fitting.reflectance.beams import (
    Annular,
    Beam,
    Conical,
    Directional,
    Hemispherical,
)

TRAP_DEG = 8.0


@dataclass(frozen=True)
class Geometry:
    """A named geometry: its beams, and in words what it is."""

    name: str
    incident: Beam
    collected: Beam
    transmitted: bool
    says: str


KNOWN = (
    "45/0", "0/45", "45a/0", "0/45a", "d/8", "8/d", "d/8 SCE", "8/d SCE", "d/0", "0/d",
    "white-sky", "black-sky", "T 0/d", "T d/0", "T d/d", "T 0/0",
)  # fmt: skip

_ALIASES = {"di/8": "d/8", "de/8": "d/8 sce", "8/di": "8/d", "8/de": "8/d sce",
            "d/d": "white-sky", "45x/0": "45/0", "0/45x": "0/45", "wsa": "white-sky",
            "bsa": "black-sky"}  # fmt: skip
_BEAM = re.compile(r"(?P<angle>\d+(?:\.\d+)?)(?P<ring>a?)")


def named(
    name: str,
    *,
    theta_deg: float | None = None,
    trap_deg: float = TRAP_DEG,
    transmitted: bool = False,
) -> Geometry:
    """The beams of a named geometry, incident first (CIE 15; ISO 7724-2; CIE 130).

    ``45/0``, ``0/45``: two directions in one plane, 45x:0; ``45a/0``: the mean of all
    azimuths, which is the same for isotropic models. ``d/8``, ``8/d``: a hemisphere and a
    direction at 8 degrees, any other number alike; the specular component is included
    (SCI, ``di:8``) unless ``SCE`` (``de:8``) is added: then a gloss trap, a cone of
    ``trap_deg`` half angle around the mirror direction, is no part of the hemisphere.
    ``white-sky`` is d/d and ``black-sky`` theta/d with ``theta_deg`` (Schaepman-Strub et
    al. 2006). A ``T`` before, or ``transmitted``, collects behind the sample. Colons do as
    well as slashes. Raises `ModelError` for other names.
    """
    plain = re.sub(r"\s+", " ", name.strip().lower()).replace(":", "/")
    through = transmitted
    for mark in ("t ", "transmittance "):
        if plain.startswith(mark):
            plain, through = plain.removeprefix(mark), True
    if plain.endswith(" transmittance"):
        plain, through = plain.removesuffix(" transmittance"), True
    plain = _ALIASES.get(plain, plain)
    excluded = plain.endswith(" sce")
    plain = plain.removesuffix(" sce").removesuffix(" sci")
    plain = _ALIASES.get(plain, plain)
    if excluded and not ("d" in plain and "/" in plain):
        raise ModelError(
            f"geometry {name!r}: only a direction with a hemisphere (8/d, d/8) has a "
            "specular component to exclude"
        )
    whole = Hemispherical()
    mark = "T " if through else ""
    if plain == "white-sky":
        return Geometry(
            f"{mark}white-sky", whole, whole, through, "uniform light, all of it collected"
        )
    if plain == "black-sky":
        angle = 0.0 if theta_deg is None else theta_deg
        beam = Directional(angle)
        says = f"light from {angle:g} deg, all of it collected"
        return Geometry(f"{mark}black-sky {angle:g} deg", beam, whole, through, says)
    first, slash, second = plain.partition("/")
    if not slash or first == second == "d":
        raise _unknown(name)
    if "d" not in (first, second):
        beams = _directions(name, first, second, through)
        says = "two directions; the factor is pi f"
        return Geometry(f"{mark}{plain}", *beams, through, says)
    angle = _angle(name, second if first == "d" else first, theta_deg)
    sphere = whole
    if excluded:
        # Behind the sample light goes straight on: the same azimuth as the mirror's.
        sphere = Hemispherical(Conical(angle, 180.0, trap_deg))
    beam = Directional(angle)
    incident, collected = (sphere, beam) if first == "d" else (beam, sphere)
    said = "specular component "
    said += f"excluded by a trap of {trap_deg:g} deg half angle" if excluded else "included"
    label = f"{mark}{first}/{second}" + (" SCE" if excluded else " SCI")
    return Geometry(label, incident, collected, through, said)


def _directions(name: str, first: str, second: str, through: bool) -> tuple[Beam, Beam]:
    one, two = (_BEAM.fullmatch(s) for s in (first, second))
    if one is None or two is None or (one["ring"] and two["ring"]):
        raise _unknown(name)
    beams: list[Beam] = []
    for part, azimuth in ((one, 0.0), (two, 180.0)):
        angle = float(part["angle"])
        beams.append(Annular(angle) if part["ring"] else Directional(angle, azimuth))
    return beams[0], beams[1]


def _angle(name: str, text: str, theta_deg: float | None) -> float:
    if text in ("theta", "t") and theta_deg is not None:
        return theta_deg
    found = _BEAM.fullmatch(text)
    if found is None or found["ring"]:
        raise _unknown(name)
    return float(found["angle"])


def _unknown(name: str) -> ModelError:
    return ModelError(
        f"there is no geometry {name!r}; known: {', '.join(KNOWN)}, other angles alike"
    )
