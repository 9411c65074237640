"""What lies in the plane of incidence: measured rows, and the directions of a curve.

Angles of the detector are signed and from the normal of its own side: positive where the
mirror direction, or the straight way through, is; negative on the side of the source.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from fitting.models import Way
from fitting.plots.style import GREY, LINES, MARKERS, marker_size, raster, tint
from fitting.plots.subject import Subject
from fitting.solid_angle import from_normal, incidence_labels

# How far from the plane a row may be.
TOLERANCE_DEG = 0.3
MOST = 6
_DASHES = ("-", (0, (4, 1.5)))
_FARTHEST = math.radians(89.5)
_SAME_AZIMUTH = math.radians(2.0)
# Where nothing was measured, and beyond what was.
_WITHOUT_DATA_DEG = (10.0, 30.0, 50.0, 70.0)


@dataclass(frozen=True)
class Cut:
    """One direction of incidence, on one way of light, and the rows in its plane.

    ``rows`` are indices into the data, ``angle`` their signed angles, rad; ``azimuth`` is
    the number of the source's azimuth among those shown, None for isotropic data.
    """

    way: Way
    theta_i: float
    phi_i: float
    rows: np.ndarray
    angle: np.ndarray
    azimuth: int | None = None

    @property
    def label(self) -> str:
        """What the legend says: the angle from the normal of the side that is lit."""
        theta = math.degrees(float(from_normal(np.asarray(self.theta_i))))
        return rf"$\theta_i$ = {theta:.1f}°".replace(".0°", "°")

    @property
    def azimuth_label(self) -> str:
        """The same of the azimuth, where it matters."""
        return rf"$\varphi_i$ = {math.degrees(self.phi_i):.0f}°"

    def directions(self, signed: np.ndarray) -> tuple[np.ndarray, ...]:
        """The four angles of detectors at signed angles, rad."""
        theta_r = np.abs(signed)
        if self.way in ("down", "back"):
            theta_r = math.pi - theta_r
        phi_r = self.phi_i + np.where(signed >= 0, math.pi, 0.0)
        one = np.ones_like(theta_r)
        return self.theta_i * one, self.phi_i * one, theta_r, phi_r

    def peak(self, subject: Subject) -> float:
        """Signed angle of the mirror direction, or of the refracted way through, rad."""
        return peak_angle(subject, self.way, self.theta_i)

    def grid(self, subject: Subject) -> np.ndarray:
        """Signed angles of a smooth curve, closer where lobes peak, rad."""
        own = float(from_normal(np.asarray(self.theta_i)))
        fine = np.radians(np.geomspace(0.003, 20.0, 70))
        near = np.concatenate([-fine, [0.0], fine])
        wide = np.linspace(-_FARTHEST, _FARTHEST, 359)
        around = [p + near for p in {self.peak(subject), own, -own}]
        every = np.unique(np.concatenate([wide, *around]))
        return every[np.abs(every) <= _FARTHEST]


def peak_angle(subject: Subject, way: Way, theta_i: float) -> float:
    """Angle from the normal at which a lobe of this way peaks, rad."""
    own = float(from_normal(np.asarray(theta_i)))
    if way in ("front", "back"):
        return own
    values = {k: np.atleast_1d(v)[0] for k, v in subject.result.values.items()}
    index = float(np.asarray(subject.model.relative_index(values)))
    sine = math.sin(own) / (index if way == "down" else 1.0 / index)
    return math.asin(sine) if sine < 1.0 else own


def signed_angle(theta_r: np.ndarray, delta: np.ndarray) -> np.ndarray:
    """Signed angles of detectors in the plane, with ``delta = phi_r - phi_i``, rad."""
    theta = from_normal(theta_r)
    return np.where(np.cos(delta) <= 1e-12, theta, -theta)


def cuts(subject: Subject, way: Way, most: int = MOST) -> list[Cut]:
    """Directions of incidence with rows in their plane, in order: all of a few, or some.

    Of anisotropic data up to three polar angles in two azimuths. Without data angles that
    the result knows.
    """
    if subject.measurement is None:
        return _without_data(subject, way, most)
    m = subject.measurement
    delta = m.phi_r - m.phi_i
    off = np.abs(np.sin(m.theta_r) * np.sin(delta))
    here = (subject.way == way) & (off < math.sin(math.radians(TOLERANCE_DEG)))
    here &= m.valid[:, subject.chosen].any(axis=1)
    rows = np.flatnonzero(here)
    if not rows.size:
        return _without_data(subject, way, most)
    anisotropic = m.symmetry == "anisotropic"
    azimuths = _two_azimuths(m.phi_i[rows]) if anisotropic else (None,)
    few = max(most // len(azimuths), 1)
    chosen = _spread(m.theta_i, rows, few)
    found: list[Cut] = []
    for group in chosen:
        for number, azimuth in enumerate(azimuths):
            own = group
            if azimuth is not None:
                upright = np.sin(m.theta_i[group]) < 1e-3
                turned = _apart(m.phi_i[group], azimuth) < _SAME_AZIMUTH
                own = group[turned | upright]
            if not own.size:
                continue
            phi_i = float(np.median(m.phi_i[own])) if azimuth is None else azimuth
            angle = signed_angle(m.theta_r[own], delta[own])
            order = np.argsort(angle, kind="stable")
            theta_i = float(np.mean(m.theta_i[own]))
            number_or_none = None if azimuth is None else number
            found.append(Cut(way, theta_i, phi_i, own[order], angle[order], number_or_none))
    return found


def left_out(subject: Subject, way: Way, shown: list[Cut]) -> str:
    """What is not drawn of the angles of incidence, for the footnote; or nothing."""
    if subject.measurement is None:
        return ""
    here = np.flatnonzero((subject.way == way) & subject.measurement.valid.any(axis=1))
    if not here.size:
        return ""
    every = len(np.unique(incidence_labels(subject.measurement.theta_i[here])))
    drawn = len({round(cut.theta_i, 4) for cut in shown if cut.rows.size})
    if not drawn:
        return "no row lies in the plane of incidence"
    return f"{drawn} of {every} angles of incidence" if drawn < every else ""


def _without_data(subject: Subject, way: Way, most: int) -> list[Cut]:
    back = way in ("back", "up")
    known = [math.radians(a.theta_i_deg) for a in subject.result.by_angle]
    known = [t for t in known if (t > 0.5 * math.pi) == back][:: -1 if back else 1]
    if not known:
        known = [math.radians(180.0 - t if back else t) for t in _WITHOUT_DATA_DEG]
    if len(known) > most:
        at = np.linspace(0, len(known) - 1, most).round().astype(int)
        known = [known[k] for k in at]
    none = np.zeros(0, dtype=int)
    return [Cut(way, t, 0.0, none, np.zeros(0)) for t in known]


def _spread(theta_i: np.ndarray, rows: np.ndarray, most: int) -> list[np.ndarray]:
    """Rows of some angles of incidence, evenly spread over those with a proper scan."""
    label = incidence_labels(from_normal(theta_i[rows]))
    groups = [rows[label == k] for k in np.unique(label)]
    longest = max(g.size for g in groups)
    groups = [g for g in groups if 4 * g.size >= longest]
    if len(groups) <= most:
        return groups
    at = np.linspace(0, len(groups) - 1, most).round().astype(int)
    return [groups[k] for k in at]


def _two_azimuths(phi_i: np.ndarray) -> tuple[float, ...]:
    """The azimuth of most rows, and the one that is nearest to perpendicular to it."""
    rounded = np.round(np.mod(phi_i, 2 * math.pi), 4)
    values, count = np.unique(rounded, return_counts=True)
    first = float(values[np.argmax(count)])
    across = np.abs(np.abs(np.cos(values - first)) - 0.0)
    second = float(values[np.argmin(across - 1e-6 * count / count.max())])
    return (first,) if _apart(np.array(second), first) < _SAME_AZIMUTH else (first, second)


def _apart(phi: np.ndarray, other: float) -> np.ndarray:
    return np.abs(np.arctan2(np.sin(phi - other), np.cos(phi - other)))


class Palette:
    """The same colour and marker for the same angle of incidence in all panels."""

    def __init__(self) -> None:
        self._labels: list[str] = []
        self._azimuths: dict[int, str] = {}

    def number(self, cut: Cut) -> int:
        """The number of the colour of a cut."""
        if cut.label not in self._labels:
            self._labels.append(cut.label)
        if cut.azimuth is not None:
            self._azimuths.setdefault(cut.azimuth, cut.azimuth_label)
        return self._labels.index(cut.label) % len(LINES)

    def line(self, cut: Cut) -> dict[str, Any]:
        """Colour and dashes of its curve."""
        return {
            "color": LINES[self.number(cut)],
            "linestyle": _DASHES[(cut.azimuth or 0) % len(_DASHES)],
        }

    def points(self, cut: Cut, total: int) -> dict[str, Any]:
        """Marker, colour and size of its points, as one of ``total`` in the panel."""
        k = self.number(cut)
        face = tint(LINES[k], 0.9 if cut.azimuth else 0.45)
        return {
            "linestyle": "none", "marker": MARKERS[k], "markersize": marker_size(total),
            "color": LINES[k], "markerfacecolor": face,
            "markeredgewidth": 0.6, "rasterized": raster(total),
        }  # fmt: skip

    def handles(self, *, points: bool, azimuths: bool = True) -> list[Line2D]:
        """Legend entries."""
        out: list[Line2D] = []
        for k, label in enumerate(self._labels):
            k = k % len(LINES)
            marker = MARKERS[k] if points else ""
            face = tint(LINES[k])
            out.append(
                Line2D(
                    [], [], color=LINES[k], marker=marker, markerfacecolor=face, label=label
                )
            )
        for number, label in sorted(self._azimuths.items()) if azimuths else ():
            out.append(Line2D([], [], color=GREY, ls=_DASHES[number % 2], label=label))
        return out
