"""What a parameter is, and the smooth map between its support and the real line."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

AnyArray = TypeVar("AnyArray", Array, np.ndarray, float)
Scale = Literal["log", "linear", "periodic"]
# Of the real line: a share of 5e-4 of the support is left, and 12 %.
_FLAT, _INSIDE = 7.6, 2.0


@dataclass(frozen=True)
class Parameter:
    """A parameter of a lobe, declared once.

    A *coefficient* multiplies a basis function, is linear, and has one value per channel;
    it is an ``amplitude`` if the lobe's albedo grows with it. A *shape* parameter enters
    nonlinearly and is shared by all channels unless asked otherwise. A *given* one is a
    shape parameter that is known, one value per channel, and never fitted. ``support`` is
    the closed interval of meaningful values; ``start`` the interval from which starting
    values are taken. ``scale`` tells how a shape parameter is spread over its support:
    ``log``, ``linear``, or ``periodic`` (then ``support`` is one period and there is no
    bound).
    """

    name: str
    default: float
    support: tuple[float, float]
    unit: str
    meaning: str
    coefficient: bool = False
    given: bool = False
    amplitude: bool = True
    scale: Scale = "linear"
    start: tuple[float, float] = (math.nan, math.nan)

    def bounded(self, lower: float, upper: float) -> Parameter:
        """The same parameter on a narrower support."""
        low, high = max(lower, self.support[0]), min(upper, self.support[1])
        start = self.start
        if not self.coefficient:
            start = (min(max(start[0], low), high), min(max(start[1], low), high))
        default = min(max(self.default, low), high)
        return dataclasses.replace(self, support=(low, high), start=start, default=default)


def shape(
    name: str,
    default: float,
    support: tuple[float, float],
    meaning: str,
    *,
    unit: str = "1",
    scale: Scale = "log",
    start: tuple[float, float] | None = None,
) -> Parameter:
    """Declare a shape parameter."""
    return Parameter(
        name, default, support, unit, meaning, scale=scale, start=start or support
    )


def coefficient(
    name: str,
    default: float,
    meaning: str,
    *,
    support: tuple[float, float] = (0.0, math.inf),
    unit: str = "1",
    amplitude: bool = True,
) -> Parameter:
    """Declare a coefficient: linear, one value per channel."""
    return Parameter(
        name, default, support, unit, meaning, coefficient=True, amplitude=amplitude
    )


def given(
    name: str, default: float, support: tuple[float, float], meaning: str, *, unit: str
) -> Parameter:
    """Declare a quantity that is known of every channel, such as its wavelength."""
    return Parameter(name, default, support, unit, meaning, given=True, start=support)


def to_value(scale: Scale, u: AnyArray, lower: AnyArray, upper: AnyArray) -> AnyArray:
    """Value in the support for a point ``u`` of the real line; numpy or JAX.

    ``linear``: ``lower + (upper - lower) sigmoid(u)``; ``log``: the same in the logarithm;
    ``periodic``: ``u`` itself.
    """
    if scale == "periodic":
        return u
    traced = isinstance(u, Array)
    lib: Any = jnp if traced else np
    share: Any = jax.nn.sigmoid(u) if traced else 1.0 / (1.0 + np.exp(-u))
    if scale == "log":
        return lower * lib.exp(lib.log(upper / lower) * share)
    return lower + (upper - lower) * share


def slope_of_value(scale: Scale, u: float, lower: float, upper: float) -> float:
    """Derivative of `to_value` in ``u``."""
    if scale == "periodic":
        return 1.0
    share = 1.0 / (1.0 + math.exp(-u))
    width = upper - lower
    if scale == "log":
        width = math.log(upper / lower) * float(to_value(scale, u, lower, upper))
    return width * share * (1.0 - share)


def to_real_line(scale: Scale, value: float, lower: float, upper: float) -> float:
    """Inverse of `to_value`; a value at a bound is moved 1e-6 of the support inside."""
    if scale == "periodic":
        return value
    if scale == "log":
        share = math.log(value / lower) / math.log(upper / lower)
    else:
        share = (value - lower) / (upper - lower)
    share = min(max(share, 1e-6), 1 - 1e-6)
    return math.log(share / (1 - share))


def is_flat(scales: Sequence[Scale], u: Any) -> Any:
    """Which points ``(..., k)`` are at a bound, where the map onto the support is flat.

    A long step can carry a parameter there, and nothing leads back although the minimum
    may lie inside.
    """
    periodic = np.array([s == "periodic" for s in scales], dtype=bool)
    return (abs(u) > _FLAT) & ~periodic


def from_inside(u: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """The points, those which are flat moved to where they can go on."""
    return np.where(flat, np.sign(u) * _INSIDE, u)
