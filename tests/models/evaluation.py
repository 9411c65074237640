"""Lobes at random directions, and their albedos, by name and plain numbers."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from fitting.albedo import albedo_basis
from fitting.geometry import Geometry, from_angles
from fitting.models import lobe_class


def values(**shape: float) -> dict[str, jax.Array]:
    return {n: jnp.asarray(v) for n, v in shape.items()}


def directions(count: int = 300, *, below_deg: float = 89.0) -> Geometry:
    rng = np.random.default_rng(0)
    ti, to = rng.uniform(0, np.radians(below_deg), (2, count))
    pi, po = rng.uniform(0, 2 * np.pi, (2, count))
    return jax.tree.map(jnp.asarray, from_angles(ti, pi, to, po))


def of(name: str, geometry: Geometry, options=None, **shape: float) -> list[np.ndarray]:
    lobe = lobe_class(name)(**(options or {}))
    return [np.asarray(b) for b in lobe.basis(values(**shape), geometry)]


def albedos(name: str, mu, nodes: int, options=None, **shape: float) -> list[np.ndarray]:
    lobe = lobe_class(name)(**(options or {}))
    compiled = jax.jit(lambda s: albedo_basis(lobe, s, mu, nodes=nodes))
    return [np.asarray(e) for e in compiled(values(**shape))]
