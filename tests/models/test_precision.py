"""Rounding errors of every lobe against 50 digits, at the extremes and in between.

At most 64 ulp, or 5 times the condition number; see `fitting.stress.precision`.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import mpmath as mp
import pytest
from cases import COMBINED, DEFAULTS, FEW, QUICK, VARIANTS, each

from fitting.stress import Variant, precision, table
from fitting.stress.exercise import Exercise
from fitting.stress.reference import has_reference, relative_error

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
STATED = table.rows(
    README.partition("<!-- stress -->")[2].partition("<!-- /")[0].split("\n")
)

# The table has about so many points of every variant.
SOME = 2000

precisions = pytest.mark.parametrize("name", ["f32", "f64"])


def check(variant: Variant, name: str, count: int, seconds: float) -> None:
    """At most so many points; of a costly formula as many as the time allows."""
    if not has_reference(variant):
        pytest.skip("no formula in many digits")
    found = precision.measure(Exercise(variant, name), count, enough=after(seconds))
    print(f"{variant} {found}")
    assert found.points >= 20
    assert found.passed, f"{variant} {found}"
    if not relative_error(variant) and variant in VARIANTS and count <= SOME:
        # These points are some of the table's. Other processors round a little differently.
        most = STATED[table.lobe_of(variant)].maximum[name]
        assert found.maximum <= 1.1 * most + 0.5, f"the README states {most}: {found}"


def after(seconds: float) -> Callable[[], bool]:
    end = time.process_time() + seconds
    return lambda: time.process_time() > end


@precisions
@each(FEW)
def test_error_in_ulp(variant: Variant, name: str):
    check(variant, name, 120, 0.5)


@pytest.mark.slow
@precisions
@each(QUICK)
def test_error_in_ulp_at_many_points(variant: Variant, name: str):
    check(variant, name, SOME, 0.7)


@pytest.mark.full
@precisions
@each(VARIANTS + COMBINED)
def test_error_in_ulp_at_very_many_points(variant: Variant, name: str):
    check(variant, name, 20_000, float("inf"))


def test_every_lobe_of_ours_has_a_formula_in_many_digits():
    assert [v.name for v in DEFAULTS if not has_reference(v)] == []


def test_the_table_of_the_readme_names_what_there_is():
    """It is made by ``python -m fitting.stress.table``."""
    count = {n: s.variants for n, s in STATED.items()}
    assert count == Counter(table.lobe_of(v) for v in VARIANTS)


def test_the_digits_are_not_set_for_others():
    before = mp.mp.dps
    precision.measure(Exercise(DEFAULTS[0], "f64"), 2)
    assert mp.mp.dps == before
