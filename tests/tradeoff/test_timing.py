"""Medians, quartiles, and when repeating stops."""

from __future__ import annotations

import time

import numpy as np
import pytest

from fitting.tradeoff.timing import spread, timed


def test_quartiles_are_numpys():
    values = list(np.random.default_rng(1).exponential(size=9))
    found = spread(values)
    ordered = sorted(values)
    # Of nine values: the third, fifth and seventh.
    assert (found.low, found.median, found.high) == (ordered[2], ordered[4], ordered[6])
    assert found.least == ordered[0]
    assert found.repeats == 9
    assert found.scaled(1e9).median == pytest.approx(1e9 * found.median)


def test_a_repeat_is_the_mean_of_its_calls():
    found = timed(lambda: time.sleep(0.002), 3, calls=5)
    assert found.repeats == 3
    # Sleeping takes at least as long as asked for.
    assert 0.002 <= found.least < 0.1


def test_warm_up_counts_for_nothing():
    calls: list[int] = []

    def run():
        calls.append(1)
        if len(calls) == 1:
            time.sleep(0.2)

    assert timed(run, 3, warm=False).high < 0.1
    assert len(calls) == 4


@pytest.mark.parametrize(("budget", "repeats"), [(0.0, 1), (np.inf, 6)])
def test_budget(budget, repeats):
    assert timed(lambda: time.sleep(0.001), 6, budget_seconds=budget).repeats == repeats
