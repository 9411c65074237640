"""Rows with room behind them: files of similar length share compiled code and arrays."""

from __future__ import annotations

import math

import jax
import numpy as np
from numpy.typing import ArrayLike

from fitting import geometry

_BUCKETS = (128, 256, 512, 1024, 1536, 2048, 3072, 4096)
CHUNK = 4096
_ON_GPU = 1 << 19
# What JAX asks of an array to work on it where it lies.
_ALIGNMENT = 64


def bucket(n: int) -> int:
    """A padded size, so that files of similar length share compiled code."""
    for size in _BUCKETS:
        if n <= size:
            return size
    chunks = math.ceil(n / CHUNK)
    step = 1 << max(0, chunks.bit_length() - 3)
    return math.ceil(chunks / step) * step * CHUNK


def rows_at_once(size: int) -> int:
    """Of padded rows, those of a block: what stays in a processor's cache.

    On a GPU up to half a million, since it is idle between blocks.
    """
    block = min(size, CHUNK)
    if jax.default_backend() != "cpu":
        while size % (2 * block) == 0 and 2 * block <= _ON_GPU:
            block *= 2
    return block


def room(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros, float64, which `jax.device_put` takes on a CPU without a copy."""
    size = 8 * math.prod(shape)
    raw = np.zeros(size + _ALIGNMENT, dtype=np.uint8)
    begin = -raw.ctypes.data % _ALIGNMENT
    return raw[begin : begin + size].view(np.float64).reshape(shape)


def padded(a: np.ndarray, size: int, fill: float = 0.0) -> np.ndarray:
    """An array ``(..., n)`` with room behind it, ``(..., size)``."""
    out = room((*a.shape[:-1], size))
    out[..., : a.shape[-1]] = a
    out[..., a.shape[-1] :] = fill
    return out


def padded_geometry(
    theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
) -> geometry.Geometry:
    """Geometry of angles ``(n,)``, rad, and of pairs along the normal after them.

    There every lobe is finite.
    """
    angles = [np.asarray(a, dtype=np.float64) for a in (theta_i, phi_i, theta_r, phi_r)]
    size = bucket(angles[0].size)
    wide = [np.pad(a, (0, size - a.size)) for a in angles]
    return jax.tree.map(lambda a: padded(a, size), geometry.from_angles(*wide))
