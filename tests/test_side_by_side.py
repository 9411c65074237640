"""Fits side by side: the same results in the same order, and one error."""

from __future__ import annotations

import threading

import pytest
import synthetic

from fitting import FitOptions, compare
from fitting.batch import threads
from fitting.side_by_side import side_by_side


@pytest.fixture
def two(monkeypatch):
    """Two threads, whatever the machine has."""
    monkeypatch.setattr("fitting.side_by_side.allowed", lambda: 2)


def test_jobs_do_run_side_by_side(two):
    met = threading.Barrier(2, timeout=20)
    assert side_by_side([lambda: met.wait() >= 0] * 2, 10) == [True, True]


def test_many_values_take_turns(two):
    names = side_by_side([lambda: threading.current_thread().name] * 2, 10**9)
    assert names == [threading.current_thread().name] * 2


def test_results_come_in_order_and_the_first_error_is_raised(two):
    late = threading.Event()

    def first() -> int:
        assert late.wait(20)
        return 1

    def second() -> int:
        late.set()
        return 2

    assert side_by_side([first, second], 10) == [1, 2]

    def wrong(word: str) -> int:
        raise ValueError(word)

    with pytest.raises(ValueError, match="one"):
        side_by_side([lambda: wrong("one"), lambda: wrong("two")], 10)


def test_a_limited_process_is_obeyed(monkeypatch):
    monkeypatch.setattr(threads, "cores", lambda: 8)
    for told, expected in (("3", 3), ("1", 1), ("99", 8), ("", 8), ("many", 8), ("0", 8)):
        monkeypatch.setenv("OMP_NUM_THREADS", told)
        assert threads.allowed() == expected


def test_a_comparison_does_not_depend_on_it(monkeypatch):
    truth = {"lambert.albedo": [0.3, 0.2], "ggx.alpha": 0.2}
    truth |= {"ggx.f0": [0.05, 0.06], "ggx.f90": [1.0, 1.0]}
    data = synthetic.measurement("lambert + ggx", truth, relative=0.02)
    found = []
    for allowed in (1, 2):
        monkeypatch.setattr("fitting.side_by_side.allowed", lambda n=allowed: n)
        both = compare(data, ["lambert", "lambert + ggx"], FitOptions(objective="l2"))
        found.append([result.to_json() for result in both.results])
    assert found[0] == found[1]
