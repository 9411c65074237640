"""What is claimed of the solver's speed, with room for the machine; see `solver_speed.py`.

python -m pytest tests/benchmarks -m slow -n 0 -s
"""

from __future__ import annotations

import shutil
from collections.abc import Callable

import jax
import pytest
from solver_speed import Dense, made, ours, passes, problem_of, timed

pytestmark = pytest.mark.slow

Line = Callable[[str], None]
SAME_COST = 1e-6


@pytest.mark.parametrize(
    ("rows", "channels", "times"), [(10_000, 3, 10), (10_000, 31, 300)]
)
def test_fit_is_many_times_faster_than_scipy(line: Line, rows, channels, times):
    with jax.enable_x64(True):
        data = made(rows, channels)
        problem, dense = problem_of(data), Dense(data)
        ours(problem)
        dense.compile()
        own, end = timed(lambda: ours(problem), 7)
        theirs, cost = timed(dense.scipy, 1)
    line(f"{rows} x {channels}: scipy takes {theirs / own:.0f} times ours, {own:.4f} s")
    assert bool(end.converged)
    assert cost == pytest.approx(float(end.cost), rel=SAME_COST)
    assert theirs >= times * own


@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler: cc")
@pytest.mark.parametrize(("rows", "channels"), [(300_000, 3), (50_000, 31)])
def test_a_pass_takes_a_few_times_as_long_as_one_by_hand(line: Line, rows, channels):
    with jax.enable_x64(True):
        mine, theirs = passes(problem_of(made(rows, channels)), 9)
    line(f"a pass over {rows} x {channels}: {mine / theirs:.1f} times the C kernel's")
    # 1.4 to 1.7.
    assert mine <= 3.0 * theirs
