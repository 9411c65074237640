"""What is in a measurement, in plain numbers; numpy only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from data_formats import Measurement
from fitting import diagnostics
from fitting.solid_angle import incidence_labels

_IN_PLANE = math.radians(1.0)


def summarise(m: Measurement) -> dict[str, Any]:
    """Everything that `brdf info` says, ready for JSON: no NaN, angles in deg."""
    value = m.value[m.valid]
    reciprocity = diagnostics.data_reciprocity(m)
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
        "rows_transmitted": int(np.count_nonzero(m.theta_r > 0.5 * math.pi)),
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
        "reciprocity": None
        if reciprocity is None
        else {"median_relative_difference": reciprocity[0], "pairs": reciprocity[1]},
        "notes": [
            {"code": n.code, "sentence": n.sentence, "count": n.count} for n in m.notes
        ],
    }


def _incidence(m: Measurement) -> list[dict[str, Any]]:
    """Geometry and coverage for every polar angle of incidence."""
    label = incidence_labels(m.theta_i) if m.n_rows else np.zeros(0, dtype=int)
    albedo = {round(t, 6): (a, c) for t, a, c in diagnostics.data_albedo(m)}
    azimuth = np.degrees(np.mod(m.phi_r - m.phi_i, 2 * np.pi))
    mirror = np.degrees(_separation(m, m.phi_i + np.pi))
    retro = np.degrees(_separation(m, m.phi_i))
    out: list[dict[str, Any]] = []
    for k in np.unique(label):
        rows = np.flatnonzero(label == k)
        theta_r = np.degrees(m.theta_r[rows])
        mean = float(m.theta_i[rows].mean())
        measured = rows[m.valid[rows].any(axis=1)]
        total, covered = _nearest(albedo, mean)
        out.append(
            {
                "theta_i_deg": math.degrees(mean),
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


def _nearest(
    albedo: dict[float, tuple[float, float]], theta: float
) -> tuple[float | None, float | None]:
    for key, found in albedo.items():
        if abs(key - theta) < 1e-4:
            return found
    return None, None


def _in_plane(m: Measurement) -> np.ndarray:
    off = np.abs(np.sin(m.phi_r - m.phi_i)) * np.sin(m.theta_r)
    return (off < math.sin(_IN_PLANE)) | (np.sin(m.theta_i) < 1e-9)


def _separation(m: Measurement, phi: np.ndarray) -> np.ndarray:
    """Angle between the detector and the direction of polar angle theta_i at ``phi``."""
    cosine = np.cos(m.theta_i) * np.cos(m.theta_r)
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
