"""Klems bases: the hemisphere in rings of theta, each in equal patches of azimuth.

Source: J. H. Klems, "A new method for predicting the solar heat gain of complex
fenestration systems", 1994; bases of WINDOW and of `bsdf_m.c` of Radiance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import MeasurementError
from data_formats.patches import Patches
from data_formats.plain_xml import Element
from data_formats.provenance import one_line

Array = NDArray[np.float64]

_MOST_PATCHES = 100_000
_BOUNDS_AND_COUNTS = {
    "LBNL/Klems Full": (
        (0, 5, 15, 25, 35, 45, 55, 65, 75, 90),
        (1, 8, 16, 20, 24, 24, 24, 16, 12),
    ),
    "LBNL/Klems Half": (
        (0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90),
        (1, 8, 12, 16, 20, 12, 4),
    ),
    "LBNL/Klems Quarter": ((0, 9, 27, 46, 66, 90), (1, 8, 12, 12, 8)),
}


@dataclass(frozen=True)
class Ring:
    """Patches between two polar angles in degrees; `theta` is that of their centres."""

    low: float
    high: float
    theta: float
    n_phi: int


Basis = tuple[Ring, ...]


def _ring(low: float, high: float, n_phi: int, theta: float | None = None) -> Ring:
    if theta is None or not low <= theta <= high:
        theta = (low + high) / 2
    return Ring(low, high, 0.0 if low == 0 and n_phi == 1 else theta, n_phi)


BASES: dict[str, Basis] = {
    name: tuple(_ring(a, b, n) for (a, b), n in zip(pairwise(bounds), counts, strict=True))
    for name, (bounds, counts) in _BOUNDS_AND_COUNTS.items()
}


def basis(element: Element, where: str) -> Basis:
    """The basis that a file defines.

    **Raises:** `MeasurementError` if its rings do not follow each other within 0 to 90
    degrees.
    """
    rings: list[Ring] = []
    for block in element.all("AngleBasisBlock"):
        texts = (
            block.at("ThetaBounds", "LowerTheta"),
            block.at("ThetaBounds", "UpperTheta"),
            block.at("nPhis"),
            block.at("Theta"),
        )
        try:
            low, high = float(texts[0]), float(texts[1])
            n_phi, theta = int(texts[2]), float(texts[3] or "nan")
        except ValueError:
            found = ", ".join(one_line(t[:20]) or "nothing" for t in texts[:3])
            raise MeasurementError(
                f"{where}, line {block.line}: LowerTheta, UpperTheta and nPhis are "
                f"{found}; expected two angles in degrees and a count"
            ) from None
        before = rings[-1].high if rings else 0.0
        if not (abs(low - before) < 1e-6 and low < high <= 90 + 1e-6 and n_phi > 0):
            raise MeasurementError(
                f"{where}, line {block.line}: a ring from {low:g} to {high:g} degrees with "
                f"{n_phi} patches; expected one from {before:g} on, within 90 degrees"
            )
        rings.append(_ring(low, min(high, 90.0), n_phi, theta))
    if not 0 < (size := patch_count(rings)) <= _MOST_PATCHES:
        raise MeasurementError(
            f"{where}, line {element.line}: the angle basis has {size} patches; expected 1 "
            f"to {_MOST_PATCHES}"
        )
    return tuple(rings)


def patch_count(rings: Sequence[Ring]) -> int:
    """Number of patches of a basis."""
    return sum(ring.n_phi for ring in rings)


def definition(name: str) -> str:
    """The XML that defines a basis of `BASES`."""
    lines = ["<AngleBasis>", f"<AngleBasisName>{name}</AngleBasisName>"]
    for ring in BASES[name]:
        lines += [
            "<AngleBasisBlock>",
            f"<Theta>{ring.theta:g}</Theta>",
            f"<nPhis>{ring.n_phi}</nPhis>",
            "<ThetaBounds>",
            f"<LowerTheta>{ring.low:g}</LowerTheta>",
            f"<UpperTheta>{ring.high:g}</UpperTheta>",
            "</ThetaBounds>",
            "</AngleBasisBlock>",
        ]
    return "\n".join([*lines, "</AngleBasis>", ""])


def pairs(incident: Basis, outgoing: Basis) -> Patches:
    """All pairs, the outgoing patch changing slowest.

    A direction of incidence has the azimuth of its patch plus 180 degrees: patch k to patch
    k is the specular direction.
    """
    theta_i, phi_i, _ = _centres(incident)
    theta_r, phi_r, area = _centres(outgoing)
    n_i, n_r = len(theta_i), len(theta_r)
    return Patches(
        theta_i=np.tile(theta_i, n_r),
        phi_i=np.tile(phi_i + np.pi, n_r),
        theta_r=np.repeat(theta_r, n_i),
        phi_r=np.repeat(phi_r, n_i),
        area=np.repeat(area, n_i),
        key=(incident, outgoing),
    )


def _centres(rings: Basis) -> tuple[Array, Array, Array]:
    """theta and phi of the patches in radians, and their projected solid angles."""
    counts = [ring.n_phi for ring in rings]
    theta = np.repeat(np.deg2rad([ring.theta for ring in rings]), counts)
    phi = np.concatenate([2 * np.pi * np.arange(n) / n for n in counts])
    low, high = (np.deg2rad([getattr(r, end) for r in rings]) for end in ("low", "high"))
    area = np.pi * (np.cos(low) ** 2 - np.cos(high) ** 2) / counts
    return theta, phi, np.repeat(area, counts)
