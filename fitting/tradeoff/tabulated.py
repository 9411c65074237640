"""A model as a table over half and difference angles, interpolated."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.geometry import Geometry, from_components
from fitting.model import Model
from fitting.predict import predict_geometry
from fitting.result import FitResult
from fitting.tradeoff.trade import NotPossible

# The cosine of 87 degrees.
_LOWEST = 0.05


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class BrdfTable:
    """Values ``(h, d, p, c)`` over theta_h, theta_d and phi_d, 1/sr.

    Rusinkiewicz 1998; ``theta_h = pi/2 (k / (h - 1))^2`` crowds the nodes at the normal, as
    MERL's tables do (Matusik et al. 2003), the others are even from 0 to pi/2. That is
    enough for isotropic, reciprocal models with mirror symmetry.
    """

    values: Float[Array, "h d p c"]

    @property
    def bytes(self) -> int:
        """Memory of the values."""
        return int(self.values.size * self.values.dtype.itemsize)

    def __call__(self, geometry: Geometry) -> Float[Array, "n c"]:
        """Linear in all three between the eight nodes around each direction pair."""
        h, d, p, _ = self.values.shape
        theta_h, theta_d, phi_d = half_and_difference(geometry)
        at = (
            (h - 1) * jnp.sqrt(theta_h * (2.0 / np.pi)),
            (d - 1) * theta_d * (2.0 / np.pi),
            (p - 1) * phi_d * (2.0 / np.pi),
        )
        below: list[Array] = []
        share: list[Array] = []
        for a, size in zip(at, (h, d, p), strict=True):
            k = jnp.clip(a.astype(jnp.int32), 0, size - 2)
            below.append(k)
            share.append(jnp.clip(a - k, 0.0, 1.0))
        # Between nodes the angle theta_h itself is the coordinate, not its root.
        edge = [(below[0] + s) ** 2 for s in (0, 1)]
        share[0] = jnp.clip((at[0] ** 2 - edge[0]) / (edge[1] - edge[0]), 0.0, 1.0)
        total = jnp.zeros((1, 1), self.values.dtype)
        for corner in np.ndindex(2, 2, 2):
            weight = jnp.ones_like(theta_h)
            for s, bit in zip(share, corner, strict=True):
                weight = weight * (s if bit else 1.0 - s)
            i, j, k = (b + bit for b, bit in zip(below, corner, strict=True))
            total = total + weight[:, None] * self.values[i, j, k]
        return jnp.where(geometry.reflects[:, None], total, 0.0)


def table_of(result: FitResult, sizes: tuple[int, int, int]) -> BrdfTable:
    """A fitted model at the nodes of a table, in float32.

    Directions lower than 87 degrees from the normal are lifted to there, so that nodes
    below the horizon do not darken what is interpolated next to them. Raises `NotPossible`
    for a model that such a table cannot hold.
    """
    model = Model(result.model)
    if model.anisotropic or not model.reciprocal or model.ways != ("front",):
        raise NotPossible(
            f"a table over half and difference angles holds isotropic, reciprocal "
            f"reflection from the front, which {result.model} is not"
        )
    h, d, p = sizes
    theta_h = 0.5 * np.pi * (np.arange(h) / (h - 1)) ** 2
    grid = np.meshgrid(
        theta_h,
        np.linspace(0.0, 0.5 * np.pi, d),
        np.linspace(0.0, 0.5 * np.pi, p),
        indexing="ij",
    )
    values = predict_geometry(model, result.values, _nodes(*(g.ravel() for g in grid)))
    values = values.reshape(h, d, p, -1)
    return BrdfTable(jnp.asarray(values, jnp.float32))


def _nodes(theta_h: np.ndarray, theta_d: np.ndarray, phi_d: np.ndarray) -> Geometry:
    """Direction pairs of the nodes, lifted where they are too low."""
    x, y = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d)
    z = np.cos(theta_d)
    c, s = np.cos(theta_h), np.sin(theta_h)

    def turned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, ...]:
        """From the frame of the half vector to that of the surface, around y."""
        up = np.clip(c * z - s * x, _LOWEST, 1.0)
        along = c * x + s * z
        length = np.sqrt(along * along + y * y)
        flat = np.sqrt((1.0 - up) * (1.0 + up)) / np.where(length > 0, length, 1.0)
        return along * flat, y * flat, up

    return from_components(*turned(x, y), *turned(-x, -y))


def half_and_difference(g: Geometry) -> tuple[Array, Array, Array]:
    """``theta_h, theta_d`` and ``phi_d``, the latter folded to [0, pi/2]."""
    flat = jnp.sqrt(g.hx * g.hx + g.hy * g.hy)
    some = flat > 0
    safe = jnp.where(some, flat, 1.0)
    cx, sx = jnp.where(some, g.hx / safe, 1.0), jnp.where(some, g.hy / safe, 0.0)
    # The source in the frame whose z is the half vector and whose y is level.
    along = g.hz * (cx * g.wix + sx * g.wiy) - flat * g.cos_i
    across = cx * g.wiy - sx * g.wix
    theta_d = jnp.arctan2(jnp.sqrt(along * along + across * across), g.cos_d)
    return (
        jnp.arctan2(flat, g.hz),
        theta_d,
        jnp.arctan2(jnp.abs(across), jnp.abs(along)),
    )
