"""What is in a measurement, in plain numbers; numpy only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from data_formats import Measurement
from fitting import diagnostics
from fitting.solid_angle import incidence_labels

_IN_PLANE = math.radians(1.0)


def summarise(m: Measurement, relative_index: float = 1.0) -> dict[str, Any]:
    """Everything that `brdf info` says, ready for JSON: no NaN, angles in deg.

    ``relative_index`` is that behind the sample relative to that in front.
    """
    value = m.value[m.valid]
    p = m.provenance
    return {
        "path": p.path,
        "sha256": p.sha256,
        "format": p.format,
        "instrument": p.instrument,
        "sample": p.sample,
        "date": p.date,
        "header": dict(p.header),
        "symmetry": m.symmetry,
        "rows": m.n_rows,
        "rows_transmitted": int(np.count_nonzero(m.transmitted)),
        "rows_from_back": int(np.count_nonzero(m.from_back)),
        "rows_in_plane": int(np.count_nonzero(_in_plane(m))),
        "has_uncertainty": m.sigma is not None,
        "auxiliary": sorted(m.auxiliary),
        "channels": [
            {
                "name": c.name,
                "wavelength_nm": c.wavelength_nm,
                "valid": _share(m.valid[:, k]),
                "minimum": _reduce(np.min, m, k),
                "median": _reduce(np.median, m, k),
                "maximum": _reduce(np.max, m, k),
            }
            for k, c in enumerate(m.channels)
        ],
        "values": {
            "valid": _share(m.valid),
            "minimum": float(value.min()) if value.size else None,
            "median": float(np.median(value)) if value.size else None,
            "maximum": float(value.max()) if value.size else None,
            "negative": int(np.count_nonzero(value < 0)),
            "zero": int(np.count_nonzero(value == 0)),
        },
        "incidence": _incidence(m),
        "reciprocity": _reciprocity(diagnostics.data_reciprocity(m)),
        "reciprocity_transmitted": _reciprocity(
            diagnostics.data_transmitted_reciprocity(m, relative_index)
        ),
        "relative_index": relative_index,
        "notes": [
            {"code": n.code, "sentence": n.sentence, "count": n.count} for n in m.notes
        ],
    }


def _reciprocity(found: tuple[float, int] | None) -> dict[str, float] | None:
    if found is None:
        return None
    return {"median_relative_difference": found[0], "pairs": found[1]}


def _incidence(m: Measurement) -> list[dict[str, Any]]:
    """Geometry and coverage for every polar angle of incidence, and on either side."""
    label = incidence_labels(m.theta_i) if m.n_rows else np.zeros(0, dtype=int)
    albedo = diagnostics.data_albedo(m)
    through = m.transmitted
    azimuth = np.degrees(np.mod(m.phi_r - m.phi_i, 2 * np.pi))
    mirror = np.degrees(_separation(m, m.phi_i + np.pi))
    retro = np.degrees(_separation(m, m.phi_i))
    out: list[dict[str, Any]] = []
    for key in np.unique(2 * label + through):
        rows = np.flatnonzero(2 * label + through == key)
        theta_r = np.degrees(m.theta_r[rows])
        mean = float(m.theta_i[label == key // 2].mean())
        measured = rows[m.valid[rows].any(axis=1)]
        found = next((a for a in albedo if abs(a.theta_i - mean) < 1e-4), None)
        total, covered = _part(found, transmitted=bool(key % 2))
        out.append(
            {
                "theta_i_deg": math.degrees(mean),
                "transmitted": bool(key % 2),
                "rows": int(rows.size),
                "valid": _share(m.valid[rows]),
                "theta_r_deg": [float(theta_r.min()), float(theta_r.max())],
                "largest_step_deg": _largest_step(theta_r),
                "azimuth_deg": _arc(azimuth[rows]),
                "nearest_to_mirror_deg": _least(mirror[measured]),
                "nearest_to_retro_deg": _least(retro[measured]),
                "albedo": total,
                "covered": covered,
            }
        )
    return out


def _part(
    found: diagnostics.Albedo | None, *, transmitted: bool
) -> tuple[float | None, float | None]:
    """What is reflected or transmitted, and the share of the hemisphere that covers it."""
    if found is None or (transmitted and found.transmitted is None):
        return None, None
    if transmitted:
        return found.transmitted, found.transmitted_covered
    return found.albedo - (found.transmitted or 0.0), found.covered


def _in_plane(m: Measurement) -> np.ndarray:
    off = np.abs(np.sin(m.phi_r - m.phi_i)) * np.sin(m.theta_r)
    return (off < math.sin(_IN_PLANE)) | (np.sin(m.theta_i) < 1e-9)


def _separation(m: Measurement, phi: np.ndarray) -> np.ndarray:
    """Angle between the detector and the direction of polar angle theta_i at ``phi``.

    Of transmitted light the detector is mirrored at the surface: straight on is 0 from the
    mirror direction.
    """
    cosine = np.cos(m.theta_i) * np.cos(m.theta_r)
    cosine = np.where(m.transmitted, -cosine, cosine)
    cosine = cosine + np.sin(m.theta_i) * np.sin(m.theta_r) * np.cos(m.phi_r - phi)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _largest_step(theta_deg: np.ndarray) -> float | None:
    steps = np.diff(np.unique(np.round(theta_deg, 2)))
    return float(steps.max()) if steps.size else None


def _arc(azimuth_deg: np.ndarray) -> list[float]:
    """Both ends of the shortest arc that holds all azimuths, beginning in (-180, 180]."""
    sorted_deg = np.unique(np.round(np.mod(azimuth_deg, 360.0), 3))
    gaps = np.diff(np.append(sorted_deg, sorted_deg[0] + 360.0))
    widest = int(np.argmax(gaps))
    first = float(sorted_deg[(widest + 1) % sorted_deg.size])
    first -= 360.0 if first > 180.0 else 0.0
    return [first, first + 360.0 - float(gaps[widest])]


def _least(values: np.ndarray) -> float | None:
    return float(values.min()) if values.size else None


def _share(valid: np.ndarray) -> float:
    return float(valid.mean()) if valid.size else 0.0


def _reduce(how: Any, m: Measurement, channel: int) -> float | None:
    good = m.value[m.valid[:, channel], channel]
    return float(how(good)) if good.size else None
