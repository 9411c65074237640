"""Data at the edges of what a fit can take, and what an honest answer to them is."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import synthetic

from data_formats import Measurement
from fitting import FitOptions, judge
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.models import lobe_class
from fitting.predict import predict_geometry
from fitting.result import FitResult
from fitting.rows import select_rows

WIDTHS = (1e-3, 1e-2, 0.1, 0.5, 1.0, 1.5)
OFFSETS = np.array([1e-3 * k for k in (0, 0.3, 1, 3, 10, 30, 100)])
# Lobes that describe a whole surface; any other is fitted beside a diffuse one.
ALONE = {
    *("lambert", "oren_nayar", "eon", "burley", "interfaced_lambert", "minnaert"),
    *("ashikhmin_shirley_diffuse", "rtls", "rpv", "hapke", "disney", "openpbr", "gltf"),
}
_TWO = np.array([1.0, 0.6])
_ALBEDO = 0.3 * _TWO


def fine_directions(theta_i_deg=synthetic.THETA_I_DEG) -> tuple[np.ndarray, ...]:
    """Rings, and around every mirror direction rows from 3e-4 to 0.1 rad away."""
    rings = np.stack(synthetic.directions(theta_i_deg, rings=8, azimuths=8), axis=1)
    scan = []
    for t in np.radians(theta_i_deg):
        scan += [(t, 0.0, t + o, np.pi) for o in {*OFFSETS, *-OFFSETS}]
        scan += [(t, 0.0, t, np.pi - o / np.sin(t)) for o in OFFSETS[1:]]
    return tuple(np.concatenate([rings, np.array(scan)]).T)


def truth_of(name: str, width: float) -> tuple[str, dict[str, np.ndarray]]:
    """A model with this lobe, and its parameters when it is about this wide."""
    lobe = lobe_class(name)()
    wide = {
        "alpha": width, "sigma": width, "shoulder": width, "theta_bar": width,
        "exponent": 2.0 / width**2 - 2.0,
        "roughness": math.sqrt(width), "specular_roughness": math.sqrt(width),
        "b": 1.0 / width**2 if name.startswith("abc") else 0.3,
        "k": 0.3 + width if name == "minnaert" else 20.0 if name == "sgd" else 0.8,
        "gamma": 1.8, "c_xy": -1.0,
    }  # fmt: skip
    if name == "gtr":  # at alpha = 1 the density is the same for every gamma
        wide["alpha"] = min(width, 0.95)
    bright = {
        "f0": 0.04, "f90": 0.9, "f1": 0.0, "ks": 0.3, "a": 0.02 / width**2,
        "b0": 0.02 / min(width, 1.0) ** 2, "f_vol": 0.1, "f_geo": 0.05, "scale": 0.8,
    }  # fmt: skip
    out: dict[str, np.ndarray] = {}
    for p in lobe.parameters():
        if p.coefficient:
            out[f"{name}.{p.name}"] = bright.get(p.name, 0.4) * _TWO
        else:
            value = wide.get(p.name, p.default)
            out[f"{name}.{p.name}"] = np.clip(value, *p.support)
    if name in ALONE:
        return name, out
    return f"lambert + {name}", {**out, "lambert.albedo": _ALBEDO}


def data(
    expression: str, truth: dict, angles, noise: float, absolute: float = 1e-4
) -> Measurement:
    """The values of a model, exact or with relative noise and a little absolute one."""
    return synthetic.measurement(
        expression, truth, angles=angles, relative=noise, seed=3,
        absolute=absolute if noise else 0.0,
    )  # fmt: skip


def check_honest(result: FitResult, truth: dict, measurement: Measurement) -> None:
    """Every parameter is right within its errors, or words tell that it may not be.

    Error bars are the intervals, which know how few rows may decide about a parameter;
    they are doubled (about four standard uncertainties where many do).
    """
    result.to_json()  # refuses numbers that are not finite
    words = " | ".join([*result.identifiability, result.solver.sentence])
    searched = result.solver.converged and "starts reach the best minimum" not in words
    warned = not searched or "source and detector are exchanged" in words
    for p in result.parameters:
        if any(p.at_bound):
            assert f"{p.name} is at a bound" in words
        for v, interval, t in zip(
            p.value,
            p.interval_95,
            np.broadcast_to(truth[p.name], len(p.value)),
            strict=True,
        ):
            reach = interval[1] - interval[0] if interval else 0.0
            right = abs(v - t) <= reach + 1e-4 * abs(t) + 1e-9
            assert right or warned or f"{p.name} " in words, (p.name, v, t, reach, words)
    rows = select_rows(measurement, result.settings.max_theta_deg)
    best = predict_geometry(Model(result.model), truth, rows.geometry)
    best = np.broadcast_to(best.reshape(rows.index.size, -1), rows.value.shape)
    truly = judge.scores(rows, best, FitOptions()).log1p
    assert not searched or result.scores.log1p <= 1.001 * truly + 1e-7, (truly, words)


def check_values(result: FitResult, truth: dict, angles, tolerance: float) -> None:
    """The fit predicts what the truth does, to a share of the brightest value."""
    g = from_angles(*angles)
    there = predict_geometry(Model(result.model), truth, g).reshape(g.cos_i.size, -1)
    here = result.evaluate(*angles).reshape(g.cos_i.size, -1)
    assert np.max(np.abs(here - there)) <= tolerance * np.max(np.abs(there))


def with_values(measurement: Measurement, value: np.ndarray) -> Measurement:
    """The same rows with other values."""
    return dataclasses.replace(measurement, value=value)
