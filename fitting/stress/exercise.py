"""A variant compiled once: its values and derivatives at any points, in a precision."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.geometry import Geometry, from_components
from fitting.stress.points import Points
from fitting.stress.variants import Variant

CHUNK = 512
DIRECTIONS = ("wix", "wiy", "cos_i", "wox", "woy", "cos_o")


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Everything:
    """Values ``(b, n)``, and derivatives by name of parameter or component."""

    value: np.ndarray
    forward: dict[str, np.ndarray]
    reverse: dict[str, np.ndarray]
    by_direction: dict[str, np.ndarray]

    def chosen(self, index: slice) -> Everything:
        """At some of the points."""
        return jax.tree.map(lambda a: a[..., index], self)


class Exercise:
    """Evaluates a variant point by point in float32 or float64.

    ``chunk`` points are evaluated at a time, and in the end as many as are asked for.
    """

    def __init__(self, variant: Variant, precision: str, *, chunk: int = CHUNK):
        self.variant = variant
        self.precision = precision
        self._chunk = chunk
        self.dtype = np.dtype({"f32": np.float32, "f64": np.float64}[precision])
        self._names = [p.name for p in variant.shapes]

    def value(self, points: Points, geometry: Geometry | None = None) -> np.ndarray:
        """Basis functions ``(b, n)``; at another geometry than that of the points."""
        (out,) = self._chunked(lambda *a: (self._value(*a),), points, geometry)
        return out

    def everything(
        self, points: Points, enough: Callable[[], bool] | None = None
    ) -> Everything:
        """Values with forward and reverse derivatives by parameters and by directions.

        Once ``enough`` says so, the points that are left are left out.
        """
        found = self._chunked(self._everything, points, None, enough)
        value, forward, reverse, fields = found
        done = points.chosen(slice(value.shape[-1]))
        return Everything(value, forward, reverse, self._by_direction(done, fields))

    @property
    def plain(self):
        """Basis functions stacked, as the lobe computes them without being compiled."""
        lobe = self.variant.lobe
        return lambda shape, geometry: jnp.stack(lobe.basis(shape, geometry))

    @functools.cached_property
    def mapped(self):
        """The same compiled, over points that each have their own shape."""
        return jax.jit(jax.vmap(self.plain, out_axes=1))

    def _value(self, shape, geometry):
        return self.mapped(shape, geometry)

    @functools.cached_property
    def _everything(self):
        basis = self.plain

        def at_a_point(shape, geometry):
            value, pull = jax.vjp(basis, shape, geometry)
            forward = jax.jacfwd(basis)(shape, geometry) if shape else {}
            one_each = jnp.eye(value.shape[0], dtype=value.dtype)
            reverse, fields = jax.vmap(pull)(one_each)
            return value, forward, reverse, fields

        return jax.jit(jax.vmap(at_a_point, out_axes=-1))

    def _by_direction(self, points: Points, fields: Geometry) -> dict[str, np.ndarray]:
        """Derivatives by the two vectors, through the half vector that they form."""

        def one_basis(xyz, cotangent):
            return _pull(*xyz, cotangent)

        with jax.enable_x64(self.dtype == np.float64):
            g = jax.tree.map(lambda a: jnp.asarray(a, self.dtype), points.geometry)
            xyz = tuple(getattr(g, n) for n in DIRECTIONS)
            pulled = [
                one_basis(xyz, jax.tree.map(lambda a, j=j: jnp.asarray(a[j]), fields))
                for j in range(np.shape(fields.cos_i)[0])
            ]
        return {
            n: np.stack([np.asarray(p[k]) for p in pulled])
            for k, n in enumerate(DIRECTIONS)
        }

    def on_device(self, points: Points, geometry: Geometry | None = None):
        """Shape and geometry in this precision, as arrays of JAX."""
        with jax.enable_x64(self.dtype == np.float64):
            shape = {n: jnp.asarray(self.rounded(n, points.shape[n])) for n in self._names}
            g = points.geometry if geometry is None else geometry
            return shape, jax.tree.map(lambda a: jnp.asarray(a, self.dtype), g)

    def rounded(self, name: str, value: np.ndarray) -> np.ndarray:
        """Values in this precision, still inside of their support."""
        (p,) = (p for p in self.variant.shapes if p.name == name)
        low, high = (self.dtype.type(b) for b in p.support)
        return np.clip(np.asarray(value, self.dtype), low, high)

    def _chunked(self, function, points: Points, geometry: Geometry | None, enough=None):
        shape, g = self.on_device(points, geometry)
        n = np.size(points.theta_i)
        parts = []
        with jax.enable_x64(self.dtype == np.float64):
            for first in range(0, n, self._chunk):
                index = np.minimum(np.arange(first, first + self._chunk), n - 1)

                def take(a, index=index):
                    return jnp.asarray(np.asarray(a)[index])

                out = function(jax.tree.map(take, shape), jax.tree.map(take, g))
                parts.append(jax.tree.map(np.asarray, out))
                if enough is not None and enough():
                    break
        return jax.tree.map(lambda *a: np.concatenate(a, axis=-1)[..., :n], *parts)


@jax.jit
def _pull(wix, wiy, cos_i, wox, woy, cos_o, cotangent):
    _, back = jax.vjp(from_components, wix, wiy, cos_i, wox, woy, cos_o)
    return back(cotangent)
