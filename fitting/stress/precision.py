"""Rounding errors of a lobe against 50 digits, at the extremes and in between.

The reference takes the stored components as exact. An error is counted in units in the last
place (ulp). Where the formula itself multiplies a relative error of its inputs by a
condition number, no implementation can do better than that number of ulps. Points with a
condition number above 16 are therefore told apart; they lie at Gaussian skirts (twice the
exponent), at large exponents, across the tangent of an elongated lobe, and at nearly
opposite grazing directions.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import mpmath as mp
import numpy as np

from fitting.stress import points as at
from fitting.stress.exercise import Exercise
from fitting.stress.points import BLOCK, Points
from fitting.stress.reference import (
    DIGITS,
    Reference,
    components_of,
    relative_error,
    stored_inputs,
)
from fitting.stress.variants import Variant

CONDITION = 16.0
# Lobes may call zero what is next to the smallest normal number: its power of 0.9 at most.
_ROOM = 0.8
# Where rounding the inputs changes the value by more, it is not determined by them.
_UNDETERMINED = 0.01
# Below this error a condition number would change nothing, and costs time.
_UNSUSPICIOUS = 4.0
ULPS = 64.0
# Terms that cancel have a few ulp of their own each; the most is 4.9, of a kernel of rtls.
PER_CONDITION = 5.0
# Where directions are rounded to exactly opposite ones, their half vector is lost.
_HALF_VECTOR_KNOWN = 0.01
# The papers' formulas have a pole with a finite limit where a direction is horizontal.
NEAREST_TO_HORIZON = 1e-11
_WORTH_PROCESSES = 1500
_SMALL = 20

Progress = Callable[[int], None]


@dataclass(frozen=True)
class Precision:
    """Rounding errors of one variant in one precision, in ulp.

    ``maximum``, ``percentile`` (99.9 %) and ``worst`` are of the well-conditioned points,
    ``condition`` is the condition number at the worst of them. ``ill`` of the ``points``
    have a condition number above 16 and an error above 4 ulp: the largest is
    ``ill_maximum``, and ``per_condition`` the largest error divided by the condition
    number, where the error is above 16 ulp and the number leaves a digit. ``undefined``
    points are without a verdict: the printed formula divides by zero, the value is next to
    underflow, or rounding made the directions opposite.
    """

    precision: str
    points: int
    maximum: float
    percentile: float
    worst: str
    condition: float
    ill: int
    ill_maximum: float
    per_condition: float
    undefined: int
    allowed: float

    @property
    def passed(self) -> bool:
        """At most 64 ulp, or 5 times the condition number, beyond what is ``allowed``: the
        error that the lobe declares of its own series and quadratures."""
        tame = self.maximum <= ULPS + self.allowed
        return tame and self.per_condition <= PER_CONDITION

    def __str__(self) -> str:
        said = (
            f"{self.precision}: at most {self.maximum:.1f} ulp and 99.9 % below "
            f"{self.percentile:.1f} ulp at {self.points - self.ill - self.undefined} "
            f"well-conditioned points; worst at {self.worst} (condition number "
            f"{self.condition:.2g})"
        )
        if self.ill:
            said += (
                f"; {self.ill} ill-conditioned, up to {self.ill_maximum:.3g} ulp, "
                f"{self.per_condition:.2f} per condition number"
            )
        return said


def measure(
    exercise: Exercise,
    count: int,
    *,
    workers: int = 1,
    progress: Progress | None = None,
    enough: Callable[[], bool] | None = None,
) -> Precision:
    """Errors over stratified points; ``progress`` is told how many more are done.

    Once ``enough`` says so, the points that are left are left out. With several
    ``workers`` and thousands of points the formula is evaluated in processes of their own.
    Raises ``LookupError`` where the lobe has no formula.
    """
    variant = exercise.variant
    reference = Reference(variant)
    points = at.stratified(variant, count, salt=" precision").below(NEAREST_TO_HORIZON)
    batches = _batches(exercise, points, BLOCK if enough is None else _SMALL)
    tell = progress or (lambda _: None)
    errors, conditions = [], []
    for error, condition in _compared(batches, workers if count >= _WORTH_PROCESSES else 1):
        errors.append(error)
        conditions.append(condition)
        tell(error.shape[1])
        if enough is not None and enough():
            break
    error, condition = np.concatenate(errors, 1), np.concatenate(conditions, 1)
    return _summary(exercise, reference, points, error, condition)


@dataclass(frozen=True)
class _Batch:
    variant: Variant
    components: dict[str, np.ndarray]
    shape: dict[str, np.ndarray]
    got: np.ndarray
    least: np.ndarray


def _batches(exercise: Exercise, points: Points, size: int) -> list[_Batch]:
    shape, geometry = exercise.on_device(points)
    components = components_of(geometry)
    own = {n: np.asarray(v) for n, v in shape.items()}
    got = exercise.value(points)
    n = got.shape[1]
    least = _least(exercise, points, components)
    out = []
    for first in range(0, n, size):
        part = slice(first, first + size)
        out.append(
            _Batch(
                exercise.variant,
                {k: v[part] for k, v in components.items()},
                {k: v[part] for k, v in own.items()},
                got[:, part],
                least[part],
            )
        )
    return out


def _least(exercise: Exercise, points: Points, components: dict) -> np.ndarray:
    """Below which values an exponential may have underflowed on the way.

    The smallest normal number with room, times what an exponential is multiplied by: the
    height of the peak and one over both cosines.
    """
    zero = np.zeros_like(points.theta_i)
    straight = np.where(points.theta_o > at.HORIZON, np.pi, 0.0)
    back = np.where(points.theta_i > at.HORIZON, np.pi, 0.0)
    normal = Points(back, zero, straight, zero, points.shape)
    peak = np.max(np.abs(exercise.value(normal)), 0)
    cosines = components["cos_i"].astype(float) * components["cos_o"].astype(float)
    cosines = np.abs(cosines)
    times = np.maximum(1.0, np.nan_to_num(peak.astype(float)) / np.maximum(cosines, 1e-30))
    return float(np.finfo(exercise.dtype).tiny) ** _ROOM * times


def _compared(
    batches: list[_Batch], workers: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    if workers <= 1:
        yield from map(_compare, batches)
        return
    # Threads of XLA do not survive a fork.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _ignore_interrupts)
    try:
        yield from pool.map(_compare, batches)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _compare(batch: _Batch) -> tuple[np.ndarray, np.ndarray]:
    """Errors in ulp ``(b, n)``, NaN where there is no verdict; condition numbers, NaN
    where they were not needed."""
    reference = Reference(batch.variant)
    error = np.full(batch.got.shape, np.nan)
    condition = np.full(batch.got.shape, np.nan)
    dtype = batch.got.dtype.type
    with mp.workdps(DIGITS):
        for k in np.flatnonzero(_has_half_vector(batch.components)):
            inputs = stored_inputs(batch.components, batch.shape, int(k))
            try:
                exact = reference(inputs)
            except ZeroDivisionError:
                continue
            for j, value in enumerate(exact):
                size = abs(float(value))
                got = float(batch.got[j, k])
                if size < batch.least[k]:
                    continue
                ulp = float(np.spacing(dtype(size)))
                error[j, k] = abs(float((mp.mpf(got) - value) / ulp))
                if not error[j, k] <= _UNSUSPICIOUS:
                    # Of a small error only the side matters, which is seen early.
                    enough = CONDITION if error[j, k] <= CONDITION else math.inf
                    condition[j, k] = reference.condition(inputs, j, value, enough)
    return np.where(np.isnan(error) & ~np.isfinite(batch.got), np.inf, error), condition


def _has_half_vector(components: dict[str, np.ndarray]) -> np.ndarray:
    """Where the stored directions still have the half vector that is stored with them."""
    c = {n: v.astype(np.float64) for n, v in components.items()}
    x, y, z = c["wix"] + c["wox"], c["wiy"] + c["woy"], c["cos_i"] + c["cos_o"]
    off = np.abs(0.5 * np.sqrt(x * x + y * y + z * z) - c["cos_d"])
    return off <= _HALF_VECTOR_KNOWN * c["cos_d"]


def _summary(
    exercise: Exercise,
    reference: Reference,
    points: Points,
    error: np.ndarray,
    condition: np.ndarray,
) -> Precision:
    ill = condition >= CONDITION
    sure = condition * float(np.finfo(exercise.dtype).eps) < _UNDETERMINED
    known = ~np.isnan(error)
    tame = np.where(known & ~ill, error, -1.0)
    j, k = np.unravel_index(int(np.argmax(tame)), tame.shape)
    judged = tame[tame >= 0]
    allowed = relative_error(exercise.variant) / float(np.finfo(exercise.dtype).eps)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.maximum(error - allowed, 0.0) / condition
    at_worst = float(condition[j, k])
    if judged.size and not np.isfinite(at_worst):
        shape, geometry = exercise.on_device(points)
        own = {n: np.asarray(v) for n, v in shape.items()}
        with mp.workdps(DIGITS):
            inputs = stored_inputs(components_of(geometry), own, int(k))
            at_worst = reference.condition(inputs, int(j), reference(inputs)[int(j)])
    return Precision(
        precision="f32" if exercise.dtype == np.float32 else "f64",
        points=error.shape[1],
        maximum=float(tame[j, k]) if judged.size else 0.0,
        percentile=(
            float(np.percentile(judged, 99.9, method="higher")) if judged.size else 0.0
        ),
        worst=points.words(int(k)) if judged.size else "",
        condition=at_worst,
        ill=int(np.count_nonzero(np.any(ill, 0))),
        ill_maximum=float(np.max(error[ill], initial=0.0)),
        per_condition=float(np.max(share[ill & sure & (error > CONDITION)], initial=0.0)),
        undefined=int(np.count_nonzero(~np.any(known, 0))),
        allowed=allowed,
    )
