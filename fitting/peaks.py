"""Where lobes peak, as numbers: one small program per lobe instead of many operations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax
import numpy as np
from jaxtyping import Array
from numpy.typing import ArrayLike

from fitting.compiled import compiled
from fitting.models.lobe import Lobe, Peak


def peak(lobe: Lobe, shape: Mapping[str, ArrayLike]) -> Peak:
    """The peak of one shape; call with x64 enabled."""
    return jax.device_get(_peak(lobe, _arrays(shape)))


def peaks(
    lobe: Lobe, shape: Mapping[str, ArrayLike], name: str, values: np.ndarray
) -> Peak:
    """The peaks ``(k,)`` for values ``(k,)`` of one parameter; call with x64 enabled."""
    return jax.device_get(_peaks(lobe, _arrays(shape), name, jax.device_put(values)))


def _arrays(shape: Mapping[str, ArrayLike]) -> dict[str, Any]:
    return {n: np.asarray(v, dtype=np.float64) for n, v in shape.items()}


@compiled()
def _peak(lobe: Lobe, shape: dict[str, Array]) -> Peak:
    return lobe.peak(shape)


@compiled()
def _peaks(lobe: Lobe, shape: dict[str, Array], name: str, values: Array) -> Peak:
    return jax.vmap(lambda v: lobe.peak({**shape, name: v}))(values)
