"""What is made small: residuals between model and data, by name.

Every objective is ``r = w (phi(f kappa) - phi(y kappa))`` with a transformation ``phi``,
a factor ``kappa`` per row (the cosine of the detector or 1, over a scale), and a weight.
All transformations are odd and smooth through zero, so that negative measured values,
which dark-current subtraction produces, count for what they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

ObjectiveName = Literal["log1p", "asinh", "cbrt", "l2cos", "chi2", "l2"]

AnyArray = TypeVar("AnyArray", Array, np.ndarray)

_CBRT_ROUNDING = 1e-3
# Of the robust residual, in median absolute deviations: 1.345 standard deviations.
ROBUST_WIDTH = 1.345 * 1.4826


@dataclass(frozen=True)
class Objective:
    """An objective: its transformation and what it takes from the data."""

    name: str
    meaning: str
    cosine: bool
    solid_angle: bool
    scaled: bool = False
    uses_sigma: bool = False

    @property
    def linear(self) -> bool:
        """Whether the residual is linear in the model's value."""
        return self.name in ("l2", "l2cos", "chi2")


OBJECTIVES: dict[str, Objective] = {
    o.name: o
    for o in (
        Objective("log1p", "log(1 + f cos) - log(1 + y cos)", True, True),
        Objective("asinh", "asinh(f cos / s) - asinh(y cos / s)", True, True, scaled=True),
        Objective("cbrt", "cbrt(f cos) - cbrt(y cos)", True, True, scaled=True),
        Objective("l2cos", "(f - y) cos", True, True),
        Objective("chi2", "(f - y) / sigma", False, False, uses_sigma=True),
        Objective("l2", "f - y, unweighted", False, False),
    )
}


def transform(name: str, v: AnyArray) -> AnyArray:
    """``phi(v)``: identity, ``sign(v) log1p(|v|)``, ``asinh(v)``, or a rounded cube root.

    The cube root is ``v / (v^2 + e^2)^(1/3)`` with e = 1e-3 (in units of the data's
    median), because the derivative of the true one is infinite at zero.
    """
    lib = _library(v)
    if name == "log1p":
        return lib.sign(v) * lib.log1p(lib.abs(v))
    if name == "asinh":
        return lib.arcsinh(v)
    if name == "cbrt":
        return v * (v * v + _CBRT_ROUNDING**2) ** (-1.0 / 3.0)
    return v


def slope(name: str, v: AnyArray) -> AnyArray:
    """``d phi / d v``, finite everywhere."""
    lib = _library(v)
    if name == "log1p":
        return 1.0 / (1.0 + lib.abs(v))
    if name == "asinh":
        return 1.0 / lib.sqrt(1.0 + v * v)
    if name == "cbrt":
        e2 = _CBRT_ROUNDING**2
        return (v * v / 3.0 + e2) * (v * v + e2) ** (-4.0 / 3.0)
    return lib.ones_like(v)


def _library(v: AnyArray) -> Any:
    return np if isinstance(v, np.ndarray) else jnp


def pseudo_huber(r: Array, width: Array) -> tuple[Array, Array]:
    """Robust residual ``r sqrt(2 / (1 + sqrt(1 + (r/d)^2)))`` and its slope in ``r``.

    Its square is ``2 d^2 (sqrt(1 + (r/d)^2) - 1)``: quadratic inside ``d``, linear
    outside. An infinite width leaves the residual as it is.
    """
    root = jnp.sqrt(1.0 + (r / width) ** 2)
    robust = r * jnp.sqrt(2.0 / (1.0 + root))
    return robust, jnp.sqrt((1.0 + root) / 2.0) / root
