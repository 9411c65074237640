"""Numbers for people."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting import quantities as q


@pytest.mark.parametrize(
    ("value", "uncertainty", "text"),
    [
        (0.123456, 0.00123, "0.1235 ± 0.0012"),
        (0.123456, 0.0996, "0.12 ± 0.10"),
        (12.3456, 1.5, "12.3 ± 1.5"),
        (1234.5, 123.0, "1230 ± 120"),
        (0.0, 0.02, "0.000 ± 0.020"),
        (-0.5, 0.25, "-0.50 ± 0.25"),
        (1.2345e-8, 2.1e-10, "(1.235 ± 0.021)e-08"),
        (0.5, None, "0.5"),
        (0.5, 0.0, "0.5"),
    ],
)
def test_value_and_uncertainty(value, uncertainty, text):
    assert q.with_uncertainty(value, uncertainty) == text


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6))
def test_rounding_moves_by_less_than_half_the_second_digit(value, uncertainty):
    text = q.with_uncertainty(value, uncertainty)
    inner, _, exponent = text.partition(")e")
    scale = 10.0 ** int(exponent) if exponent else 1.0
    shown, _, spread = inner.lstrip("(").partition(" ± ")
    assert abs(float(shown) * scale - value) <= 0.06 * uncertainty + 1e-12 * abs(value)
    assert float(spread) * scale == pytest.approx(uncertainty, rel=0.06)


def test_other_numbers():
    assert q.percent(0.0123) == "1.2 %"
    assert q.percent(1.03) == "103 %"
    assert q.valid_share(0.9996) == "99.96 %"
    assert q.valid_share(1.0) == "100 %"
    assert q.degrees(-0.01) == "0"
    assert q.number(None) == "-"
    assert q.count(1, "row") == "1 row"
    assert q.shown_channels(7) == list(range(7))
    assert q.shown_channels(31) == [0, 5, 10, 15, 20, 25, 30]
    assert q.shown_channels(31, everything=True) == list(range(31))
    assert len(q.shown_channels(400)) <= 14
