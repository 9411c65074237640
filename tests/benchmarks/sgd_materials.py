"""Materials whose reflectance is known everywhere: published fits to the MERL database.

The SGD fits of Bagher, Soler and Holzschuch 2012, read from a table of their numbers and
measured as a goniometer would.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np

from data_formats import Channel, Measurement
from fitting.geometry import Geometry, from_angles

# Metals, paints, plastics, fabrics.
MATERIALS = (
    "alum-bronze", "blue-metallic-paint", "gold-metallic-paint", "red-metallic-paint",
    "white-paint", "nylon", "teflon", "red-fabric", "green-latex", "yellow-matte-plastic",
    "pvc", "brass", "black-oxidized-steel",
)  # fmt: skip
NAMES = ("rho_d", "rho_s", "alpha", "p", "F0", "F1", "K_ap", "lambda", "c", "k", "theta0")
# Beyond it some of the fits rise without bounds.
CLIP = np.radians(80.0)
BANDS = tuple(Channel(name, None) for name in "RGB")

Function = Callable[[Geometry], np.ndarray]


def material(folder: Path, name: str) -> Function:
    """BRDF ``(n, 3)`` of a material at any geometry in front of it."""
    with (folder / "published_fits" / "sgd.csv").open(newline="") as file:
        row = next(r for r in csv.DictReader(file) if r["material"] == name)
    v = {n: np.array([float(row[f"{n}_{c}"]) for c in "rgb"]) for n in NAMES}

    def function(g: Geometry) -> np.ndarray:
        cos_d = np.asarray(g.cos_d)[:, None]
        tan2 = ((g.hx**2 + g.hy**2) / np.maximum(g.hz, 1e-9) ** 2)[:, None]
        ax = v["alpha"] + tan2 / v["alpha"]
        d = v["K_ap"] * np.exp(-ax) / (np.pi * ax ** v["p"]) * (1 + tan2) ** 2
        f = v["F0"] - v["F1"] * cos_d + (1 - v["F0"]) * (1 - cos_d) ** 5
        for cosine in (g.cos_i, g.cos_o):
            z = np.maximum(np.asarray(cosine), np.cos(CLIP))[:, None]
            beyond = np.maximum(np.arccos(np.minimum(z, 1.0)) - v["theta0"], 0.0)
            with np.errstate(over="ignore"):
                grown = np.exp(v["c"] * beyond ** v["k"])
            d = d * np.clip(1 + v["lambda"] * (1 - grown), 0.0, 1.0) / z
        return (v["rho_d"] + v["rho_s"] * f * d) / np.pi

    return function


def measured(
    function: Function,
    *,
    relative: float = 0.03,
    absolute: float = 1e-3,
    seed: int = 0,
    channels: tuple[Channel, ...] = BANDS,
) -> Measurement:
    """Six incidences by 18 polar angles by 37 azimuths, steps of 5 deg, with noise."""
    grid = np.meshgrid(
        np.arange(0, 76, 15.0), np.arange(0, 86, 5.0), np.arange(0, 181, 5.0), indexing="ij"
    )
    theta_i, theta_r, phi = (np.radians(a.ravel()) for a in grid)
    angles = (theta_i, np.zeros_like(theta_i), theta_r, phi)
    f = function(from_angles(*angles))
    rng = np.random.default_rng(seed)
    f = f * (1 + relative * rng.standard_normal(f.shape))
    f = f + absolute * rng.standard_normal(f.shape)
    return Measurement(
        *angles, value=f, valid=np.ones(f.shape, dtype=bool), channels=channels,
        symmetry="bilateral",
    )  # fmt: skip
