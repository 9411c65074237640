"""Times of repeated calls: a median and how far the repeats spread."""

from __future__ import annotations

import time
from collections.abc import Callable

import msgspec
import numpy as np

_LEAST_REPEATS = 3


class Spread(msgspec.Struct, frozen=True):
    """A repeated measurement: median, lower and upper quartile, least, how many.

    Other load on the machine only ever makes it longer: the least is what it disturbs
    least, the quartiles tell how much it does.
    """

    median: float
    low: float
    high: float
    least: float
    repeats: int

    def scaled(self, factor: float) -> Spread:
        """The same in another unit."""
        return Spread(
            self.median * factor,
            self.low * factor,
            self.high * factor,
            self.least * factor,
            self.repeats,
        )


def spread(values: list[float]) -> Spread:
    """Median and quartiles (linear between order statistics) of one value or more."""
    low, median, high = np.percentile(values, [25.0, 50.0, 75.0])
    return Spread(float(median), float(low), float(high), float(min(values)), len(values))


def timed(
    run: Callable[[], object],
    repeats: int,
    *,
    calls: int = 1,
    budget_seconds: float = np.inf,
    warm: bool = True,
) -> Spread:
    """Seconds of a call of ``run``, which has to wait for what it computes.

    It runs once before, unless it is ``warm`` already. Every repeat is the mean of
    ``calls`` calls, for what is shorter than the clock's resolution. After three repeats no
    other begins that would not fit into the budget, and none at all after the budget.
    """
    if not warm:
        run()
    found: list[float] = []
    begin = time.perf_counter()
    for k in range(max(repeats, 1)):
        spent = time.perf_counter() - begin
        enough = k >= min(_LEAST_REPEATS, repeats) and spent * (k + 1) / k > budget_seconds
        if enough or (k > 0 and spent > budget_seconds):
            break
        start = time.perf_counter()
        for _ in range(calls):
            run()
        found.append((time.perf_counter() - start) / calls)
    return spread(found)
