"""Made-up samples: many texels, one set of directions."""

from __future__ import annotations

from pathlib import Path

import h5py
import jax
import numpy as np

from fitting import Model, from_angles

ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")


def directions(n: int = 60, seed: int = 0):
    """Half of them near the mirror's direction; at four angles of incidence, rad."""
    rng = np.random.default_rng(seed)
    theta_i = np.radians(rng.choice([0.0, 20.0, 40.0, 60.0], n))
    near = rng.random(n) < 0.5
    theta_r = np.where(near, theta_i + rng.normal(0, 0.2, n), rng.uniform(0, 1.35, n))
    phi_r = np.where(near, np.pi + rng.normal(0, 0.2, n), rng.uniform(0, 6.28, n))
    return theta_i, np.zeros(n), np.abs(theta_r).clip(0, 1.35), phi_r


def truth(texels: int, seed: int = 0, channels: int = 3) -> dict[str, np.ndarray]:
    """Parameters of ``lambert + ggx`` of every texel."""
    rng = np.random.default_rng(seed)
    size = (texels, channels)
    return {
        "lambert.albedo": rng.uniform(0.05, 0.6, size),
        "ggx.alpha": np.exp(rng.uniform(np.log(0.06), np.log(0.5), texels)),
        "ggx.f0": rng.uniform(0.03, 0.6, size),
        "ggx.f90": np.ones(size),
    }


def values_of(expression: str, parameters: dict, angles) -> np.ndarray:
    """The model's values ``(t, n, c)``, without noise."""
    model, geometry = Model(expression), from_angles(*angles)
    texels = len(next(iter(parameters.values())))
    full = {n: parameters.get(n, np.full(texels, v)) for n, v in model.defaults().items()}
    with jax.enable_x64(True):
        return np.asarray(jax.jit(jax.vmap(lambda p: model(p, geometry)))(full))


def noisy(values: np.ndarray, relative: float = 0.01, seed: int = 1) -> np.ndarray:
    """With noise, relative and a little absolute."""
    spread = np.sqrt((relative * values) ** 2 + 1e-6)
    return values + spread * np.random.default_rng(seed).normal(size=values.shape)


def write(path: Path, values: np.ndarray, angles, **more: np.ndarray) -> Path:
    """A file as `brdf texels` reads it, with angles in degrees."""
    with h5py.File(path, "w") as file:
        for name, angle in zip(ANGLES, angles, strict=True):
            file[name] = np.degrees(angle)
            file[name].attrs["units"] = "deg"
        file["value"] = values
        for name, content in more.items():
            file[name] = content
    return path
