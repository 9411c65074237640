"""How far a fit breaks energy conservation and reciprocity, on grids of its own."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fitting.albedo import LEAVING, Side, lit_sides, model_albedo
from fitting.compiled import compiled
from fitting.geometry import Geometry
from fitting.model import Model
from fitting.models.lobe import THROUGH
from fitting.predict import predict_geometry
from fitting.problem import reciprocity_pairs
from fitting.reduced import Problem
from fitting.summary import Found

_DENSE_NODES = 32
_THETA_DEG = np.concatenate([np.arange(0.0, 80.0, 4.0), np.arange(80.0, 90.0, 0.5)])


class WorstAlbedo(NamedTuple):
    """Largest directional albedo, where it is, and the part of it that is transmitted."""

    albedo: float
    theta_deg: float
    channel: int
    side: Side
    transmitted: float


def worst_albedo(model: Model, found: list[Found]) -> WorstAlbedo:
    """Over polar angles up to 89.5 deg from both sides; call with x64 enabled."""
    cosines = _cosines()
    azimuths = np.radians([0.0, 45.0, 90.0, 135.0] if model.anisotropic else [0.0])
    worst = WorstAlbedo(-math.inf, 0.0, 0, "front", 0.0)
    for side in lit_sides(model):
        channel = 0
        for f in found:
            for azimuth in azimuths:
                both = _dense_albedo(model, f.values(), cosines, azimuth, side)
                e, through = (np.asarray(b).reshape(_THETA_DEG.size, -1) for b in both)
                k, c = np.unravel_index(int(np.argmax(e)), e.shape)
                here = WorstAlbedo(
                    float(e[k, c]), float(_THETA_DEG[k]), channel + int(c), side,
                    float(through[k, c]),
                )  # fmt: skip
                worst = max(worst, here, key=lambda w: w.albedo)
            channel += f.solution.x.shape[0]
    return worst


def begin(problem: Problem, values: dict[str, np.ndarray]) -> None:
    """Compile in the background what both need; of values, the shapes count."""
    for side in lit_sides(problem.model):
        _dense_albedo.begin(problem.model, values, _cosines(), np.float64(0.0), side)


def _cosines() -> jax.Array:
    return jax.device_put(np.cos(np.radians(_THETA_DEG)))


@compiled()
def _dense_albedo(
    model: Model,
    values: dict[str, Any],
    cosines: jax.Array,
    azimuth: jax.Array,
    side: Side,
) -> tuple[jax.Array, jax.Array]:
    """Of all light from one side, and of what goes through."""

    def along(ways):
        return model_albedo(
            model, values, cosines, azimuth=azimuth, nodes=_DENSE_NODES, ways=ways
        )

    through = [w for w in LEAVING[side] if w in THROUGH and w in model.ways]
    reflected = [w for w in LEAVING[side] if w not in THROUGH and w in model.ways]
    parts = [along([w]) for w in reflected + through]
    total = sum(parts[1:], parts[0])
    return total, parts[-1] if through else jnp.zeros_like(total)


def worst_reciprocity(model: Model, values: dict[str, np.ndarray]) -> float:
    """Largest relative difference of ``f / n_o^2`` when source and detector exchange."""
    pairs = reciprocity_pairs(model.ways)
    index = np.asarray(model.relative_index(values))

    def over_index(geometry: Geometry) -> np.ndarray:
        value = predict_geometry(model, values, geometry)
        behind = np.asarray((geometry.cos_i > 0) & (geometry.cos_o < 0))
        if value.ndim > 1:
            behind = behind[:, None]
        return value / np.where(behind, index, 1.0) ** 2

    there, back = over_index(pairs), over_index(pairs.swapped)
    size = np.maximum(0.5 * (np.abs(there) + np.abs(back)), 1e-300)
    return float(np.max(np.abs(there - back) / size))
