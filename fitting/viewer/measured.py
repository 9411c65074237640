"""The measured rows that a page holds."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np

from data_formats import Measurement
from fitting.models import Way
from fitting.rows import ways_of
from fitting.solid_angle import incidence_labels

# Some two megabytes of page.
MOST_NUMBERS = 400_000
# How far from the plane of incidence a row may be to count as lying in it.
_TOLERANCE_DEG = 0.3


def packed(measurement: Measurement, ways: tuple[Way, ...]) -> dict[str, Any]:
    """Angles ``(n, 4)`` in radians and values ``(n, c)``, NaN where not valid, as float32.

    Rows in the plane of incidence come first; of the others as many as there is room for,
    evenly spread over the file. ``incidences`` are the polar angles of the source, and
    ``azimuth`` is the one that most rows have, in degrees.
    """
    m = measurement
    seen = np.flatnonzero(m.valid.any(axis=1) & np.isin(ways_of(m), ways))
    off = np.abs(np.sin(m.theta_r[seen]) * np.sin(m.phi_r[seen] - m.phi_i[seen]))
    in_plane = off < math.sin(math.radians(_TOLERANCE_DEG))
    room = max(MOST_NUMBERS // (4 + len(m.channels)), 1)
    first = _thinned(seen[in_plane], room)
    rows = np.concatenate([first, _thinned(seen[~in_plane], room - first.size)])
    angles = np.stack([m.theta_i, m.phi_i, m.theta_r, m.phi_r], axis=1)[rows]
    values = np.where(m.valid, m.value, np.nan)[rows]
    return {
        "rows": int(rows.size),
        "of": int(seen.size),
        "angles": _base64(angles),
        "values": _base64(values),
        "incidences": _incidences(m.theta_i[seen]),
        "azimuth": _most_common(m.phi_i[seen]),
    }


def _thinned(rows: np.ndarray, most: int) -> np.ndarray:
    if rows.size <= most:
        return rows
    return (
        rows[np.linspace(0, rows.size - 1, most).round().astype(int)]
        if most > 0
        else rows[:0]
    )


def _incidences(theta_i: np.ndarray) -> list[float]:
    if not theta_i.size:
        return []
    label = incidence_labels(theta_i)
    means = [float(np.degrees(theta_i[label == k].mean())) for k in np.unique(label)]
    return sorted(round(m, 3) for m in means)


def _most_common(phi: np.ndarray) -> float:
    """In (-180, 180]."""
    turned = 180.0 - np.mod(180.0 - np.degrees(phi), 360.0)
    values, counts = np.unique(turned.round(1), return_counts=True)
    return float(values[np.argmax(counts)]) if values.size else 0.0


def _base64(numbers: np.ndarray) -> str:
    return base64.b64encode(numbers.astype("<f4").tobytes()).decode("ascii")
