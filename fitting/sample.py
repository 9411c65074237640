"""The bundled sample: a synthetic painted surface on the rings of a goniometer.

It is computed, not measured, and its file says so. The truth is in `PARAMETERS`, so that a
fit can be compared with what went in.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

from data_formats import Channel, Measurement, Provenance

NAME = "two_lobe_paint.astm"
MODEL = "lambert + 2*ggx"
WAVELENGTHS_NM = (400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0)
PARAMETERS: dict[str, float | tuple[float, ...]] = {
    "lambert.albedo": (0.05, 0.06, 0.09, 0.16, 0.38, 0.52, 0.56),
    "ggx1.alpha": 0.08,
    "ggx1.f0": (0.026, 0.026, 0.025, 0.025, 0.025, 0.024, 0.024),
    "ggx1.f90": 0.6,
    "ggx2.alpha": 0.35,
    "ggx2.f0": (0.018, 0.018, 0.019, 0.020, 0.024, 0.026, 0.027),
    "ggx2.f90": 0.35,
}

_THETA_I_DEG = (10.0, 30.0, 50.0, 65.0)
_RELATIVE_NOISE = 0.01
_ABSOLUTE_NOISE = 3e-4
_SEED = 20240229
_RETRO_HOLE_DEG = 6.0
_DIGITS = 5


def sample_path() -> Path:
    """Where the bundled file is installed."""
    return Path(str(files("fitting") / "samples" / NAME))


def make_sample() -> Measurement:
    """The sample computed anew: the model at the directions, plus noise of a fixed seed.

    Multiplicative noise of 1 % and additive noise of 3e-4 per sr; rows closer than 6 deg
    to the source are missing, where the detector would shade it.
    """
    from fitting.predict import predict

    theta_i, phi_i, theta_r, phi_r = _directions()
    values = {
        name: np.broadcast_to(v, len(WAVELENGTHS_NM)) if not name.endswith("alpha") else v
        for name, v in PARAMETERS.items()
    }
    truth = predict(MODEL, values, theta_i, phi_i, theta_r, phi_r)
    random = np.random.default_rng(_SEED)
    noisy = truth * (1 + _RELATIVE_NOISE * random.standard_normal(truth.shape))
    noisy = noisy + _ABSOLUTE_NOISE * random.standard_normal(truth.shape)
    value = np.array([[float(f"{v:.{_DIGITS}g}") for v in row] for row in noisy])
    return Measurement(
        theta_i=theta_i,
        phi_i=phi_i,
        theta_r=theta_r,
        phi_r=phi_r,
        value=value,
        valid=np.ones(value.shape, dtype=bool),
        channels=tuple(Channel.at(w) for w in WAVELENGTHS_NM),
        symmetry="bilateral",
        provenance=Provenance(
            instrument="none: synthetic data, computed by fitting.sample",
            sample="Synthetic two-lobe paint",
            header={
                "COMMENT": f"Synthetic: {MODEL}, 1 % multiplicative and 3e-4 per sr "
                f"additive noise, seed {_SEED}; not a measurement",
            },
        ),
    )


def _directions() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Whole rings of constant theta_r, denser around the mirror direction, in rad."""
    rows: list[tuple[float, float, float, float]] = []
    azimuths = (*np.arange(0.0, 150.0, 15.0), 150.0, 160.0, 170.0, 175.0, 180.0)
    for theta_i in _THETA_I_DEG:
        rings = {10.0 * k for k in range(9)} | {theta_i + d for d in (-4.0, 0.0, 4.0)}
        for theta_r in sorted(rings):
            for phi in azimuths if theta_r > 0 else (0.0,):
                if _separation_deg(theta_i, theta_r, phi) >= _RETRO_HOLE_DEG:
                    rows.append((theta_i, 0.0, theta_r, phi))
    # Seven decimals, as goniometers write them.
    angles = np.round(np.radians(np.asarray(rows)), 7).T
    return angles[0], angles[1], angles[2], angles[3]


def _separation_deg(theta_i: float, theta_r: float, phi: float) -> float:
    a, b, d = np.radians([theta_i, theta_r, phi])
    cosine = np.cos(a) * np.cos(b) + np.sin(a) * np.sin(b) * np.cos(d)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
