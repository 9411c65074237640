"""Values of a model at angles, in float64, from plain numbers."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping

import jax
import numpy as np
from numpy.typing import ArrayLike

from fitting.compiled import compiled
from fitting.geometry import Geometry, from_angles
from fitting.model import Model
from fitting.padding import bucket


def _model(expression: str) -> Model:
    # A file with a lobe may have changed since.
    return Model(expression) if ".py" in expression else _cached(expression)


@functools.lru_cache(maxsize=64)
def _cached(expression: str) -> Model:
    return Model(expression)


@compiled()
def _evaluate(model: Model, values: dict, geometry: Geometry) -> jax.Array:
    return model(values, geometry)


def begin(model: Model, values: Mapping[str, np.ndarray], rows: int) -> None:
    """Compile in the background what `predict_geometry` needs for so many rows.

    Of ``values`` only the shapes count; call with x64 enabled.
    """
    one = jax.ShapeDtypeStruct((bucket(rows),), np.float64)
    like = {k: jax.ShapeDtypeStruct(v.shape, np.float64) for k, v in values.items()}
    fields = (f.name for f in dataclasses.fields(Geometry) if f.name != "polar")
    _evaluate.begin(model, like, Geometry(**dict.fromkeys(fields, one)))  # pyright: ignore


def predict(
    expression: str,
    values: Mapping[str, ArrayLike],
    theta_i: ArrayLike,
    phi_i: ArrayLike,
    theta_r: ArrayLike,
    phi_r: ArrayLike,
) -> np.ndarray:
    """BRDF ``(n, c)``, 1/sr, at angles in radians."""
    geometry = from_angles(theta_i, phi_i, theta_r, phi_r)
    return predict_geometry(_model(expression), values, geometry)


def predict_geometry(
    model: Model, values: Mapping[str, ArrayLike], geometry: Geometry
) -> np.ndarray:
    """BRDF ``(n, c)`` of a geometry. Rows are padded so that compiled code is reused."""
    shape = np.shape(geometry.cos_i)
    n = int(np.prod(shape))
    size = bucket(n)

    def pad(a) -> np.ndarray:
        flat = np.asarray(a, dtype=np.float64).reshape(-1)
        return np.concatenate([flat, np.repeat(flat[:1], size - n)])

    if n == 0:
        return np.zeros((0, _channels(values)))
    with jax.enable_x64(True):
        padded = jax.tree.map(pad, geometry)
        own = {k: np.asarray(v, dtype=np.float64) for k, v in values.items()}
        out = np.asarray(_evaluate(model, own, padded))[:n]
    return out.reshape((*shape, *out.shape[1:]))


def _channels(values: Mapping[str, ArrayLike]) -> int:
    return max((np.size(v) for v in values.values() if np.ndim(v)), default=1)
