"""Whether automatic derivatives are the derivatives.

They are held against central differences of the paper's formula in 50 digits, whose step of
1e-15 leaves some 1e-30; where there is no such formula, against Richardson's
extrapolation of differences of the lobe itself in float64.
"""

from __future__ import annotations

import dataclasses

import mpmath as mp
import numpy as np

from fitting.stress.exercise import Everything, Exercise
from fitting.stress.finding import Finding
from fitting.stress.points import Points
from fitting.stress.reference import (
    DIGITS,
    Reference,
    components_of,
    has_reference,
    relative_error,
    stored_inputs,
)

EXACT = {"f32": 1e-2, "f64": 1e-9}
DIFFERENCES = 1e-6
_STEP = mp.mpf(10) ** -15
_RICHARDSON = 1e-3
# A formula that is a quadrature itself has no differences of 1e-15.
_SMALL = 1e-7


def correct(
    exercise: Exercise, points: Points, found: Everything, *, formula: bool = True
) -> Finding | None:
    """Forward and reverse derivatives by parameters; None where there are none.

    ``found`` is everything at the ``points``, which are inside of the supports. Without
    ``formula``, or where the lobe has none, against differences.
    """
    variant = exercise.variant
    if not variant.shapes:
        return None
    exact = formula and has_reference(variant) and relative_error(variant) < _SMALL
    if exact:
        expected = _by_formula(exercise, points, found.value.shape[0])
        limit = EXACT[exercise.precision]
    elif exercise.precision == "f64":
        expected, limit = _by_differences(exercise, points), DIFFERENCES
    else:
        return None
    # What a quadrature leaves of the values is more of their derivatives.
    limit = max(limit, 100.0 * relative_error(variant))
    worst, where, by = 0.0, "", ""
    for name, truth in expected.items():
        size = _size(found, truth, points.shape[name])
        for derivative in (found.forward[name], found.reverse[name]):
            relative = np.where(np.isnan(truth), 0.0, np.abs(derivative - truth) / size)
            relative = np.where(np.isnan(relative), np.inf, relative)
            if np.max(relative) > worst:
                worst, by = float(np.max(relative)), name
                where = points.words(int(np.argmax(np.max(relative, 0))))
    against = "50 digits" if exact else "differences, for want of a formula in many digits"
    said = f"agree to {worst:.2g} with {against}"
    if worst > limit:
        said = f"the one by {by} is off by {worst:.2g}, against {against}"
    name = f"derivatives correct {exercise.precision}"
    return Finding(name, worst <= limit, worst, where, said)


def _size(found: Everything, truth: np.ndarray, value: np.ndarray) -> np.ndarray:
    """What an error is relative to.

    The derivative itself, but not less than 1e-3 of the largest of its basis function and
    of the value per size of the parameter: where terms cancel, their rounding remains.
    """
    plain = np.abs(np.where(np.isnan(truth), 0.0, truth))
    per_size = np.abs(found.value) / np.maximum(np.abs(value), 1e-3)
    most = np.max(plain, axis=1, keepdims=True)
    return np.maximum(np.maximum(plain, 1e-3 * per_size), 1e-6 * most) + 1e-290


def _by_formula(exercise: Exercise, points: Points, n_basis: int) -> dict[str, np.ndarray]:
    reference = Reference(exercise.variant)
    shape, geometry = exercise.on_device(points)
    components = components_of(geometry)
    own = {n: np.asarray(v) for n, v in shape.items()}
    n = np.size(points.theta_i)
    out = {name: np.full((n_basis, n), np.nan) for name in own}
    with mp.workdps(DIGITS):
        for k in range(n):
            inputs = stored_inputs(components, own, k)
            for name in own:
                step = _STEP * max(abs(inputs[name]), mp.mpf(1) / 1000)
                try:
                    up = reference({**inputs, name: inputs[name] + step})
                    down = reference({**inputs, name: inputs[name] - step})
                except ZeroDivisionError:
                    continue
                out[name][:, k] = [
                    float((a - b) / (2 * step)) for a, b in zip(up, down, strict=True)
                ]
    return out


def _by_differences(exercise: Exercise, points: Points) -> dict[str, np.ndarray]:
    def slope(p, size: float) -> np.ndarray:
        x = points.shape[p.name]
        step = size * np.maximum(np.abs(x), 1e-3)
        # A step shrinks where the support ends.
        step = np.minimum(step, np.minimum(p.support[1] - x, x - p.support[0]))
        moved = [
            exercise.value(
                dataclasses.replace(points, shape={**points.shape, p.name: x + s * step})
            )
            for s in (1.0, -1.0)
        ]
        return (moved[0] - moved[1]) / (2 * step)

    return {
        p.name: (4 * slope(p, 0.5 * _RICHARDSON) - slope(p, _RICHARDSON)) / 3
        for p in exercise.variant.shapes
    }
