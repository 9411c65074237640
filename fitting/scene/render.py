"""Pictures of a material by direct light: sums over nodes, in JAX for models.

A model is linear in its coefficients, so that a picture of each basis function is all that
is computed; thirty channels cost no more than one. The nodes do not depend on the model,
and pictures are differentiable in all parameters.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike

from fitting.compiled import compiled
from fitting.geometry import Geometry, from_angles
from fitting.model import Model
from fitting.padding import bucket
from fitting.scene.nodes import Nodes

_AT_ONCE = 1 << 16

Evaluate = Callable[[Geometry], np.ndarray]


@dataclass(frozen=True)
class Image:
    """Radiance ``(p, c)`` of pixels by two independent halves of the nodes."""

    first: np.ndarray
    second: np.ndarray

    @property
    def radiance(self) -> np.ndarray:
        """Their mean."""
        return 0.5 * (self.first + self.second)

    @property
    def error(self) -> np.ndarray:
        """The standard error that their difference tells."""
        return 0.5 * np.abs(self.first - self.second)


def render(model: Model, values: Mapping[str, ArrayLike], lights: Sequence[Nodes], *,
           precision: str = "f64") -> Image:  # fmt: skip
    """The picture of a model with parameters as `Model` takes them.

    ``precision``: f32 or f64, of everything in it.
    """
    x64 = precision == "f64"
    halves: Any = 0.0
    with jax.enable_x64(x64):
        dtype = jnp.float64 if x64 else jnp.float32
        own = {k: jnp.asarray(v, dtype=dtype) for k, v in values.items()}
        for light in lights:
            padded = _padded(light, x64)
            halves = halves + np.asarray(
                radiance(model, own, *padded, 2 * light.pixels), dtype=np.float64
            )
    return _image(np.asarray(halves))


@compiled()
def radiance(
    model: Model,
    values: dict[str, Array],
    geometry: Geometry,
    index: Array,
    weight: Float[Array, "k n"],
    spectrum: Float[Array, "k c"],
    sums: int,
) -> Float[Array, "sums c"]:
    """Radiance per sum of nodes: ``sum_k sum_n f(n, c) weight[k, n] spectrum[k, c]``."""
    declared = model.parameters()
    shapes = {n: v for n, v in values.items() if not declared[n].coefficient}
    linear = {n: v for n, v in values.items() if declared[n].coefficient}
    channels = spectrum.shape[1]

    def of_shape(shape: dict[str, Array], linear: dict[str, Array], power: Array) -> Array:
        total = jnp.zeros((sums, power.shape[1]), dtype=power.dtype)
        basis = model.basis(shape, geometry)
        amplitudes = model.amplitudes(shape, linear)
        for b, a in zip(basis, amplitudes, strict=True):
            part = jax.ops.segment_sum(
                (b * weight).T, index, num_segments=sums, indices_are_sorted=True
            )
            total = total + (part @ power) * a
        return total

    if all(v.ndim == 0 for v in shapes.values()):
        return of_shape(shapes, linear, spectrum)
    wide = {n: jnp.broadcast_to(v, (channels,)) for n, v in values.items()}

    def one(each: tuple[dict[str, Array], Array]) -> Array:
        own, power = each
        shape = {n: own[n] for n in shapes}
        return of_shape(shape, {n: own[n] for n in linear}, power[:, None])[:, 0]

    return jax.lax.map(one, (wide, spectrum.T)).T


def render_values(evaluate: Evaluate, lights: Sequence[Nodes]) -> Image:
    """The picture of any function of the geometry, ``(n, c)``, by numpy."""
    halves: Any = 0.0
    for light in lights:
        spectrum = light.emitter.spectrum
        sums = np.zeros((2 * light.pixels, spectrum.shape[1]))
        for first in range(0, light.count, _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            value = evaluate(jax.tree.map(lambda a, s=some: a[s], light.geometry))
            power = light.weight[:, some].T @ spectrum
            begin = light.sum[some][0]
            # Nodes are sorted by sum: adding them up is a difference of running totals.
            own = light.sum[some]
            ends = np.searchsorted(own, np.arange(begin, own[-1] + 2))
            total = np.add.reduceat(value * power, ends[:-1], axis=0)
            total[np.diff(ends) == 0] = 0.0
            sums[begin : begin + len(total)] += total
        halves = halves + sums
    return _image(np.asarray(halves))


def _image(halves: np.ndarray) -> Image:
    return Image(*halves.reshape(2, -1, halves.shape[1]))


def _padded(light: Nodes, x64: bool):
    """The nodes on the device, as many as a round number, so that code is reused."""
    size = bucket(light.count)
    dtype = np.float64 if x64 else np.float32
    normal = _normal()

    def pad(a: np.ndarray, fill: float = 0.0) -> jax.Array:
        width = [(0, 0)] * (a.ndim - 1) + [(0, size - light.count)]
        return jnp.asarray(np.pad(a, width, constant_values=fill).astype(dtype))

    geometry = jax.tree.map(
        lambda a, z: pad(np.asarray(a), float(np.asarray(z))), light.geometry, normal
    )
    last = light.sum[-1] if light.count else 0
    index = np.pad(light.sum, (0, size - light.count), constant_values=last)
    spectrum = jnp.asarray(light.emitter.spectrum.astype(dtype))
    return geometry, jnp.asarray(index.astype(np.int32)), pad(light.weight), spectrum


@functools.cache
def _normal() -> Geometry:
    return from_angles(0.0, 0.0, 0.0, 0.0)
