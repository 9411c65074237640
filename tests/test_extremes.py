"""Fits at the extremes: the truth within the error bars, or words on what is open."""

from __future__ import annotations

import itertools
from pathlib import Path

import extremes
import numpy as np
import pytest
import synthetic

import data_formats
from fitting import fit
from fitting.models import LOBES

QUICK = ("ggx", "phong", "abg")
# One of every kind for CI; the others with -m full.
SLOW = ("student_t", "blinn_phong", "lafortune", "rpv", "interfaced_lambert", "disney")
FINE = extremes.fine_directions()
EXACT = 1e-6
# Seven or eight shape parameters, or a narrow peak along an axis that is to be found as
# well: eight starts do not always reach the best minimum, and the result says so.
HARD = ("sgd", "disney", "lafortune")


def lobes(names):
    marks = dict.fromkeys(QUICK, ()) | dict.fromkeys(SLOW, pytest.mark.slow)
    return [pytest.param(n, marks=marks.get(n, pytest.mark.full)) for n in names]


def fitted(measurement, expression, **settings):
    return fit(measurement, expression, cross_validate=False, energy=0.0, **settings)


@pytest.mark.parametrize("name", lobes(LOBES))
def test_every_width_is_found_or_said_to_be_open(name):
    for width, noise in itertools.product(extremes.WIDTHS, (0.0, 0.01)):
        expression, truth = extremes.truth_of(name, width)
        m = extremes.data(expression, truth, FINE, noise)
        result = fitted(m, expression, reciprocity=0.0)
        extremes.check_honest(result, truth, m)
        if not noise and name not in HARD:
            extremes.check_values(result, truth, FINE, EXACT)


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("name", lobes([*QUICK, "student_t", "disney"]))
def test_peaks_of_1e5_above_an_albedo_of_1e_6(name, noise):
    expression, truth = extremes.truth_of(name, 1e-3)
    bright = {n: v * (5 if n == "phong.ks" else 1) for n, v in truth.items()}
    if "lambert.albedo" in bright:
        bright["lambert.albedo"] = np.array([1e-6, 6e-7])
    m = extremes.data(expression, bright, FINE, noise, absolute=1e-8)
    assert m.value.max() > 1e4
    result = fitted(m, expression)
    extremes.check_honest(result, bright, m)
    extremes.check_values(result, bright, FINE, 3 * noise + EXACT)


def test_zeros_and_negatives_of_noise_are_no_bias_and_cut_off_ones_are_told():
    expression, truth = extremes.truth_of("ggx", 0.1)
    dark = {**truth, "lambert.albedo": np.array([0.004, 0.002])}
    m = extremes.data(expression, dark, FINE, 0.01, absolute=0.02)
    assert np.mean(m.value < 0) > 0.2
    result = fitted(m, expression)
    extremes.check_honest(result, dark, m)
    assert not any("exactly 0" in s for s in result.identifiability)
    cut = fitted(extremes.with_values(m, np.maximum(m.value, 0.0)), expression)
    assert any(
        "values are exactly 0 and none is negative" in s for s in cut.identifiability
    )


def _near_the_normal() -> tuple[np.ndarray, ...]:
    theta_i, phi_i, theta_r, phi_r = synthetic.directions((0.0, 3.0, 6.0, 9.0), 6, 6)
    return theta_i, phi_i, theta_r / 8, phi_r


def _in_plane() -> tuple[np.ndarray, ...]:
    rows = np.stack(extremes.fine_directions((10.0, 40.0, 70.0)))
    return tuple(rows[:, np.abs(np.sin(rows[3])) < 1e-9])


SPARSE = {
    "three rows": tuple(a[[0, 30, 31]] for a in synthetic.directions((34.3,), 8, 8)),
    "one angle of incidence": extremes.fine_directions((40.0,)),
    "the plane of incidence": _in_plane(),
    "ten degrees around the normal": _near_the_normal(),
}


@pytest.mark.parametrize("name", lobes(["ggx", "phong", "rpv", "beckmann", "hapke"]))
def test_few_or_crowded_rows_are_fitted_or_said_to_be_few(name):
    for rows, noise in itertools.product(SPARSE, (0.0, 0.01)):
        expression, truth = extremes.truth_of(name, 0.1)
        m = extremes.data(expression, truth, SPARSE[rows], noise)
        assert m.n_rows <= 128, "one bucket, compiled once"
        result = fitted(m, expression)
        extremes.check_honest(result, truth, m)
        extremes.check_values(result, truth, SPARSE[rows], 0.05 if noise else 1e-4)
        if rows == "three rows" and name in QUICK:
            few = ("nothing is left over", "no row lies on the lobe", "of one angle")
            assert any(f in s for f in few for s in result.identifiability)


def test_a_lobe_narrower_than_the_sampling_is_called_so():
    """A mirror-like lobe on rings five degrees apart, at angles that no ring has."""
    for name, width in (("ggx", 1e-3), ("phong", 1e-2), ("ggx", 1e-2)):
        expression, truth = extremes.truth_of(name, width)
        angles = synthetic.directions()
        m = extremes.data(expression, truth, angles, 0.01)
        result = fitted(m, expression)
        extremes.check_honest(result, truth, m)
        parameter = "phong.exponent" if name == "phong" else "ggx.alpha"
        (words,) = (
            s for s in result.identifiability
            if s.startswith(f"{parameter} ") and "on the lobe" in s
        )  # fmt: skip
        value = result.parameter(parameter).value[0]
        assert f"{value:.3g}: " in words
        assert "bounds its width from above" in words or "from its tail alone" in words


@pytest.mark.slow
@pytest.mark.usefixtures("compiled_to_run_long")
def test_a_million_rows():
    rng, n = np.random.default_rng(1), 10**6
    theta_i = np.radians(rng.choice(synthetic.THETA_I_DEG, n))
    theta_r = np.arccos(rng.uniform(np.cos(np.radians(80.0)), 1.0, n))
    phi_r = rng.uniform(0.0, np.pi, n)
    mirror = slice(0, n // 10)
    theta_r[mirror] = np.clip(theta_i + rng.normal(size=n) * 0.05, 0.0, 1.4)[mirror]
    phi_r[mirror] = np.pi - np.abs(rng.normal(size=n)[mirror]) * 0.05
    angles = (theta_i, np.zeros(n), theta_r, phi_r)
    for width in (2e-3, 0.1):
        expression, truth = extremes.truth_of("ggx", width)
        m = extremes.data(expression, truth, angles, 0.01)
        result = fitted(m, expression, starts=2)
        extremes.check_honest(result, truth, m)
        found = result.parameter("ggx.alpha")
        assert found.value[0] == pytest.approx(width, rel=0.01)
        assert found.standard_uncertainty[0] < 0.01 * width


def test_cayman_whose_peak_is_one_row(real_data: Path):
    """646 1/sr in one row; the next incidence, with one row on its peak as well, has 17."""
    m = data_formats.read(real_data / "cornell/cayman.astm")
    assert m.value.max() > 600
    result = fitted(m, "lambert + ggx")
    result.to_json()
    assert result.solver.converged
    alpha = result.parameter("ggx.alpha")
    assert alpha.standard_uncertainty[0] > 0.2 * alpha.value[0]
    words = [s for s in result.identifiability if s.startswith("ggx.alpha ")]
    assert any("at most 1 row of one angle of incidence" in s for s in words)
    assert any("exactly 0" in s for s in result.identifiability)
