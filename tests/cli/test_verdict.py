"""The verdict: what it says for results that are good, poor or strange."""

from __future__ import annotations

import msgspec
import pytest

from data_formats import read
from fitting import verdict
from fitting.sample import sample_path

change = msgspec.structs.replace


@pytest.fixture
def good(fitted):
    return fitted.comparison.results[-1]


@pytest.fixture
def judge(monkeypatch):
    def judged(result, deviation=0.02):
        monkeypatch.setattr(verdict, "typical_deviation", lambda *_: deviation)
        found = verdict.judge(result, read(sample_path()))
        return found.level, " ".join([found.headline, *found.advice])

    return judged


def with_reciprocity(result, value):
    reciprocity = change(result.data.reciprocity, median_relative_difference=value)
    return change(result, data=change(result.data, reciprocity=reciprocity))


def test_deviation_of_the_sample_is_that_of_its_noise(fitted):
    poor, better = fitted.comparison.results
    measurement = read(sample_path())
    assert verdict.typical_deviation(better, measurement) < 0.05
    assert verdict.typical_deviation(poor, measurement) > 0.1


def test_the_deviation_is_kept_in_the_result_and_used_without_the_data(fitted):
    measurement = read(sample_path())
    for result in fitted.comparison.results:
        found = verdict.typical_deviation(result, measurement)
        assert result.typical_deviation == pytest.approx(found, rel=1e-6)
        assert verdict.judge(result, None) == verdict.judge(result, measurement)


def test_a_result_that_tells_no_deviation_gets_no_verdict_without_the_data(good):
    found = verdict.judge(change(good, typical_deviation=None), None)
    assert found.level == "unknown"
    assert "the measurement is not at hand" in found.headline


@pytest.mark.parametrize(
    ("deviation", "reciprocity", "level", "says"),
    [
        (0.02, 0.05, "good", "less than the 5 %"),
        (0.005, 0.001, "good", "Good"),
        (0.05, 0.025, "fair", "2.0 times the 2.5 %"),
        (0.20, 0.02, "poor", "10 times the 2 %"),
        (0.20, 0.0, "poor", "far more"),
    ],
)
def test_the_yardstick(good, judge, deviation, reciprocity, level, says):
    found, text = judge(with_reciprocity(good, reciprocity), deviation)
    assert found == level
    assert says in text


def test_without_a_yardstick(good, judge):
    level, text = judge(change(good, data=change(good.data, reciprocity=None)))
    assert level == "good"
    assert "no yardstick" in text


def test_too_bright(good, judge):
    energy = change(good.energy, max_albedo=1.03)
    bright = change(good.data.albedo[0], albedo=1.08)
    data = change(good.data, albedo=[bright])
    _, text = judge(change(good, energy=energy, data=data))
    assert "reflects 103 %" in text
    assert "--energy hard" in text
    assert "sum to 108 %" in text


def test_lonely_start_and_blind_angles(good, judge):
    solver = change(good.solver, starts=4, starts_agreeing=1)
    validation = change(good.cross_validation, objective=1.0)
    _, text = judge(change(good, solver=solver, cross_validation=validation))
    assert "only one of 4 starts" in text
    assert "angles that the fit has not seen" in text


def test_one_angle_of_incidence(good, judge):
    one = change(good, by_angle=good.by_angle[:1], cross_validation=None)
    assert "a single angle of incidence" in judge(one)[1]


def test_parameters_that_say_nothing(good, judge):
    n = len(good.channels)
    zero = change(good.parameter("ggx.f0"), value=[0.0] * n, at_bound=[True] * n)
    loose = change(good.parameter("ggx.f90"), standard_uncertainty=[9.0] * n)
    end = change(good.parameter("ggx.alpha"), value=[1e-4], at_bound=[True])
    _, text = judge(change(good, parameters=[zero, loose, end]))
    assert "--fix ggx.f0=0" in text
    assert "ggx.f90 is not determined" in text
    assert "ggx.alpha is at the end of its range" in text


def test_what_to_try_next(good, judge):
    _, text = judge(with_reciprocity(good, 0.01), 0.3)
    assert "-m 'lambert + 2*ggx'" in text
    assert "--max-theta 60" in text


def test_what_to_try_fits_the_light_that_was_measured(good, judge):
    worst = change(good.by_angle[0], theta_i_deg=110.0, objective=1e3)
    poor = with_reciprocity(change(good, by_angle=[worst]), 1e-3)
    for model, also in (
        ("lambert_transmission", "lambert_transmission + thin_slab"),
        ("ggx(back)", "2*ggx(back)"),
        ("lambert", "lambert + ggx"),
    ):
        _, text = judge(change(poor, model=model), 0.3)
        assert f"-m '{also}'" in text
        assert "--max-theta 65" in text
