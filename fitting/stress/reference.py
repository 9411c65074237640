"""The papers' formulas at stored components, in 50 digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import mpmath as mp
import numpy as np

from fitting.geometry import Geometry, from_angles
from fitting.oracle import formula
from fitting.oracle.angles import INPUTS, angles
from fitting.stress.variants import Variant

DIGITS = 50
Inputs = dict[str, mp.mpf]


class Reference:
    """Basis functions of a variant by the formula of its paper.

    Everything is to be called under ``mpmath.workdps(DIGITS)``. Raises ``LookupError``
    where the lobe has no formula.
    """

    def __init__(self, variant: Variant):
        own = formula(variant.core)
        if own is None:
            raise LookupError(f"{variant} has no formula in many digits")
        self._formula: Callable = own
        self._options = variant.options
        self._turned = variant.turned

    def __call__(self, inputs: Inputs) -> tuple[mp.mpf, ...]:
        """By components and shape parameters. Raises ``ZeroDivisionError`` where the
        formula as printed is undefined."""
        components = _turned(inputs) if self._turned else inputs
        return self._formula(inputs, angles(components), self._options)

    def condition(
        self, inputs: Inputs, index: int, value: mp.mpf, enough: float = math.inf
    ) -> float:
        """Relative change of a basis function per relative change of its inputs, summed.

        With it any formula multiplies the rounding of its inputs. The sum is left
        unfinished once it is ``enough``.
        """
        step = mp.mpf(10) ** (-DIGITS // 2)
        total = 0.0
        for name, x in reversed(inputs.items()):
            if x != 0:
                moved = self({**inputs, name: x * (1 + step)})[index]
                total += float(abs((moved - value) / (step * value)))
            if total >= enough:
                break
        return total


def has_reference(variant: Variant) -> bool:
    """Whether there is a formula to hold the variant against."""
    return formula(variant.core) is not None


def relative_error(variant: Variant) -> float:
    """What the lobe declares of the error of its series and quadratures, of the values."""
    return variant.core.relative_error


def n_values(variant: Variant) -> int:
    """How many basis functions the formula gives."""
    at_one = from_angles([0.4], 0.3, [0.7], 2.0)
    shape = {p.name: np.asarray([p.default]) for p in variant.shapes}
    with mp.workdps(DIGITS):
        return len(Reference(variant)(stored_inputs(components_of(at_one), shape, 0)))


def stored_inputs(
    components: Mapping[str, np.ndarray], shape: Mapping[str, np.ndarray], k: int
) -> Inputs:
    """The inputs of one point, exactly as they are stored."""
    return {n: mp.mpf(float(v[k])) for n, v in (*components.items(), *shape.items())}


def components_of(geometry: Geometry) -> dict[str, np.ndarray]:
    """The stored components of a geometry by name."""
    return {n: np.asarray(getattr(geometry, n)) for n in INPUTS}


def _turned(c: Inputs) -> Inputs:
    """The source turned by 180 degrees about the normal, with its half vector."""
    x, y, z = c["wox"] - c["wix"], c["woy"] - c["wiy"], c["cos_i"] + c["cos_o"]
    length = mp.sqrt(x * x + y * y + z * z)
    if length < mp.mpf(10) ** -12:
        x, y, z, length = mp.mpf(0), mp.mpf(0), mp.mpf(0), mp.mpf(0)
        half = {"hx": x, "hy": y, "hz": mp.mpf(1), "cos_d": length}
    else:
        half = {"hx": x / length, "hy": y / length, "hz": z / length, "cos_d": length / 2}
    return {**c, "wix": -c["wix"], "wiy": -c["wiy"], **half}
