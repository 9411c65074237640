"""The front against another algorithm, and its words."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from fitting.tradeoff.pareto import domination, standings, step_up

# Few distinct values, so that equal costs and equal errors occur.
NUMBERS = st.sampled_from([0.1, 0.2, 0.5, 1.0, 2.0, 7.0])
POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=12)


def swept(points: list[tuple[float, float]]) -> set[tuple[float, float]]:
    """The front by a sweep from cheap to dear, keeping what improves on all before."""
    front: set[tuple[float, float]] = set()
    best = float("inf")
    for cost, error in sorted(points):
        if error < best:
            front.add((cost, error))
            best = error
    return front


@given(POINTS)
def test_front_is_that_of_a_sweep(points):
    found = standings(points)
    front = {p for p, s in zip(points, found, strict=True) if s.on_front}
    assert front == swept(points)


@given(POINTS)
def test_what_is_named_dominates_and_is_on_the_front(points):
    found = standings(points)
    for own, standing in zip(points, found, strict=True):
        assert standing.on_front == (standing.dominated_by is None)
        if standing.dominated_by is not None:
            other = points[standing.dominated_by]
            assert other != own
            assert other[0] <= own[0]
            assert other[1] <= own[1]
            assert found[standing.dominated_by].on_front


def test_what_has_no_error_has_no_place_and_dominates_nothing():
    found = standings([(1.0, 2.0), None, (2.0, 1.0)])
    assert [s.on_front for s in found] == [True, False, True]
    assert all(s.dominated_by is None for s in found)


def test_words():
    said = domination("beckmann", "ggx", (400.0, 0.010), (200.0, 0.004))
    assert said == (
        "beckmann is dominated by ggx, which costs 0.5 times as much and has 0.4 times its "
        "error"
    )
    assert "costs the same" in domination("a", "b", (1.0, 2.0), (1.0, 1.0))
    assert "the same error" in domination("a", "b", (2.0, 0.0), (1.0, 0.0))
    said = step_up("2*ggx", "ggx", (420.0, 0.001), (200.0, 0.004))
    assert said == "2*ggx costs 2.1 times as much as ggx, for 0.25 times its error"
