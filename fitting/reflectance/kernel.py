"""Basis functions of a lobe at many pairs of directions, compiled for one size."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.compiled import compiled
from fitting.geometry import Geometry, from_components
from fitting.models import Lobe, Shape

# Rows at a time: they stay in the cache of a core, and few do not wait for many.
SIZE = 1 << 12


def basis_values(lobe: Lobe, shape: Shape, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """``(n, J, C)`` of directions ``(n, 3)``, in 1/sr, in float64.

    Shape parameters are scalars (then C is 1) or ``(C,)``.
    """
    n = len(wi)
    out = []
    with jax.enable_x64(True):
        own = {k: jnp.asarray(v, jnp.float64) for k, v in shape.items()}
        for part in parts(n):
            values = np.asarray(_basis(lobe, own, padded_directions(wi[part], wo[part])))
            out.append(np.moveaxis(values, -1, 0)[: n - part.start])
    return np.concatenate(out)


def basis_sums(
    lobe: Lobe, shape: Shape, wi: np.ndarray, wo: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """``sum_k weight_k basis (J, C)`` and its derivative by each shape parameter.

    Derivatives are taken of the sum at fixed nodes, forward, one parameter at a time.
    """
    with jax.enable_x64(True):
        own = {k: jnp.asarray(v, jnp.float64) for k, v in shape.items()}
        total, slopes = None, {}
        for part in parts(len(wi)):
            geometry = padded_directions(wi[part], wo[part])
            w = np.zeros(SIZE)
            w[: len(weight[part])] = weight[part]
            value, slope = _sums(lobe, own, geometry, jnp.asarray(w))
            total = np.asarray(value) if total is None else total + np.asarray(value)
            slopes = {n: slopes.get(n, 0.0) + np.asarray(s) for n, s in slope.items()}
    assert total is not None
    return total, slopes


def parts(n: int) -> list[slice]:
    """``n`` rows, `SIZE` at a time."""
    return [slice(k, k + SIZE) for k in range(0, max(n, 1), SIZE)]


def padded_directions(wi: np.ndarray, wo: np.ndarray, size: int = SIZE) -> Geometry:
    """The geometry of some rows, and of the normal for the rest."""
    columns = []
    for w in (wi, wo):
        full = np.zeros((size, 3))
        full[:, 2] = 1.0
        full[: len(w)] = w
        columns += list(full.T.copy())
    geometry = from_components(*columns)
    return jax.tree.map(jnp.asarray, geometry)


def basis_table(lobe: Lobe, shape: Shape, geometry: Geometry) -> Array:
    """``(J, C, n)``; C is 1 where all shape parameters are scalars."""
    if any(jnp.ndim(v) for v in shape.values()):
        channels = max(jnp.size(v) for v in shape.values())
        wide = {k: jnp.broadcast_to(v, (channels,)) for k, v in shape.items()}
        one = jax.vmap(lambda s: jnp.stack(lobe.basis(s, geometry)), out_axes=1)
        return one(wide)
    return jnp.stack(lobe.basis(shape, geometry))[:, None, :]


@compiled()
def _basis(lobe: Lobe, shape: dict, geometry: Geometry) -> Array:
    return basis_table(lobe, shape, geometry)


@compiled()
def _sums(lobe: Lobe, shape: dict, geometry: Geometry, weight: Array) -> tuple:
    def total(own: dict) -> Array:
        return basis_table(lobe, own, geometry) @ weight

    slopes = {}
    for name in shape:
        zero = {k: jnp.zeros_like(v) for k, v in shape.items()}
        # A channel's sum depends on its own value only: one direction for all of them.
        along = zero | {name: jnp.ones_like(shape[name])}
        _, slopes[name] = jax.jvp(total, (shape,), (along,))
    return total(shape), slopes
