"""Measurements made from models, for tests whose truth is known."""

from __future__ import annotations

import numpy as np

from data_formats import Channel, Measurement
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.predict import predict_geometry

THETA_I_DEG = (10.0, 25.0, 40.0, 55.0, 70.0)


def directions(theta_i_deg=THETA_I_DEG, rings: int = 16, azimuths: int = 12):
    """Rings of detector directions up to 80 deg for every angle of incidence, rad."""
    theta_r = np.radians(np.linspace(0.0, 80.0, rings))
    phi_r = np.pi * np.arange(azimuths) / (azimuths - 1)
    grid = np.array(
        [(np.radians(t), 0.0, r, p) for t in theta_i_deg for r in theta_r for p in phi_r]
    )
    pole = (grid[:, 2] == 0) & (grid[:, 3] > 0)
    return tuple(grid[~pole].T)


def measurement(
    expression: str,
    parameters: dict,
    *,
    relative: float = 0.0,
    absolute: float = 0.0,
    seed: int = 0,
    angles=None,
    sigma: bool = False,
) -> Measurement:
    """A model's values with Gaussian noise, ``sqrt((relative f)^2 + absolute^2)``."""
    angles = directions() if angles is None else angles
    model = Model(expression)
    values = dict(model.defaults()) | parameters
    f = predict_geometry(model, values, from_angles(*angles))
    f = f.reshape(f.shape[0], -1)
    noise = np.random.default_rng(seed).normal(size=f.shape)
    spread = np.sqrt((relative * f) ** 2 + absolute**2)
    wavelengths = 400 + 100.0 * np.arange(f.shape[1])
    return Measurement(
        *angles,
        value=f + spread * noise,
        valid=np.ones(f.shape, dtype=bool),
        channels=tuple(Channel(f"{w:g} nm", w) for w in wavelengths),
        sigma=spread if sigma else None,
        symmetry="bilateral",
    )
