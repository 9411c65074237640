"""Reciprocity of models and data, albedo of data, weights, colour."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import skewed_lobe
import synthetic

from data_formats import Channel, Measurement
from fitting import ModelError, colour, diagnostics, fit, objectives
from fitting.albedo import model_albedo
from fitting.model import Model
from fitting.rows import select_rows
from fitting.solid_angle import incidence_labels, solid_angle_weights, solid_angles


@pytest.fixture
def skewed(monkeypatch):
    skewed_lobe.install(monkeypatch)


def test_the_penalty_pulls_a_lobe_that_is_not_reciprocal(skewed):
    """Data with a skew of 0.4: kept without the penalty, pulled out by it."""
    truth = {"skewed.skew": 0.4, "skewed.albedo": np.array([0.5, 0.3])}
    m = synthetic.measurement("skewed", truth, relative=0.01)
    free, soft, strong = (
        fit(m, "skewed", reciprocity=w, cross_validate=False) for w in (0.0, 1.0, 1e3)
    )
    skew = [r.parameter("skewed.skew").value[0] for r in (free, soft, strong)]
    assert skew[0] == pytest.approx(0.4, rel=0.05)
    assert skew[0] > skew[1] > skew[2]
    assert skew[2] < 0.02
    violation = [r.reciprocity.max_relative_difference for r in (free, soft, strong)]
    assert violation[0] > 0.3
    assert violation[0] > violation[1] > violation[2]
    assert not free.reciprocity.by_construction
    assert strong.reciprocity.weight == 1e3


def test_hard_energy_is_refused_for_a_lobe_without_a_bound(skewed):
    m = synthetic.measurement("lambert", {"lambert.albedo": np.array([0.5])})
    with pytest.raises(ModelError, match="skewed has no bound"):
        fit(m, "skewed", energy="hard")


@pytest.mark.parametrize("full_circle", [False, True])
def test_albedo_of_dense_data_is_that_of_the_model(full_circle):
    values = {
        "lambert.albedo": np.array([0.4]),
        "ggx.alpha": 0.4,
        "ggx.f0": np.array([0.3]),
    }
    azimuths = np.linspace(0, np.pi, 61)
    if full_circle:
        azimuths = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    theta_r = np.radians(np.arange(0.25, 90, 0.5))
    grid = np.array([(0.8, 0.3, t, 0.3 + p) for t in theta_r for p in azimuths]).T
    m = synthetic.measurement("lambert + ggx", values, angles=tuple(grid))
    ((theta, albedo, covered, *_),) = diagnostics.data_albedo(m)
    model = Model("lambert + ggx")
    with jax.enable_x64(True):
        exact = model_albedo(model, model.defaults() | values, [np.cos(0.8)], nodes=64)
    assert theta == pytest.approx(0.8)
    assert covered == pytest.approx(1.0, abs=2e-3)
    assert albedo == pytest.approx(float(exact[0, 0]), rel=2e-3)


def test_a_partly_measured_ring_stands_for_its_part_only():
    theta = np.repeat(np.radians([10.0, 30.0, 50.0, 70.0]), 19)
    delta = np.tile(np.radians(np.arange(0, 181, 10.0)), 4)
    keep = (theta < 1.0) | (delta > 2.0)
    whole, part = solid_angles(theta, delta), solid_angles(theta[keep], delta[keep])
    assert whole is not None
    assert part is not None
    assert whole.sum() == pytest.approx(2 * np.pi * (1 - np.cos(np.radians(80))), rel=1e-6)
    top = theta > 1.0
    measured = part[theta[keep] > 1.0].sum() / whole[top].sum()
    assert measured == pytest.approx(np.mean(delta[top] > 2.0), abs=0.06)


def test_a_fine_scan_in_the_plane_does_not_stand_for_whole_rings():
    theta = np.repeat(np.radians(np.arange(2.5, 90, 5.0)), 19)
    delta = np.tile(np.radians(np.arange(0, 181, 10.0)), 18)
    fine = np.radians([26.0, 27, 28, 29, 31, 32, 33, 34])
    both = np.concatenate([theta, fine]), np.concatenate([delta, np.full(8, np.pi)])
    coarse, more = solid_angles(theta, delta), solid_angles(*both)
    assert coarse is not None
    assert more is not None
    np.testing.assert_allclose(more[: theta.size], coarse, rtol=1e-9)
    assert np.all(more[theta.size :] == 0)
    half = np.full(both[0].size, 0.5)
    w = solid_angle_weights(half, 0 * half, *both)
    assert w[-8:].max() < 1.0 < w[:-8].max() < 2.0


def test_labels_forgive_jitter_and_keep_fine_steps():
    rng = np.random.default_rng(0)
    theta = np.radians(np.repeat([0.0, 10, 20, 30], 200))
    for jitter in (0.0, 1e-5, 5e-5, 3e-4):
        label = incidence_labels(theta + np.abs(rng.normal(size=theta.size)) * jitter)
        np.testing.assert_array_equal(label, np.repeat([0, 1, 2, 3], 200))
    assert incidence_labels(np.radians(np.arange(0, 5, 0.1))).max() == 49
    assert incidence_labels(rng.uniform(0, 1.5, 3000)).max() < 90


def test_an_uneven_complete_ring_is_complete():
    degrees = [0, 1, 2, 3, 5, 10, 20, 40, 80, 120, 160, 170, 175, 177, 178, 179, 180.0]
    theta = np.repeat(np.radians([10.0, 30, 50, 70, 85]), len(degrees))
    angle = solid_angles(theta, np.tile(np.radians(degrees), 5))
    assert angle is not None
    assert angle.sum() == pytest.approx(2 * np.pi, rel=0.02)


def test_weights_have_mean_one_and_do_not_depend_on_density():
    """Twice as many azimuths on a ring: half the weight each."""
    coarse = [(0.5, 0.0, t, p) for t in (0.2, 0.6, 1.0) for p in np.arange(0, 3.1, 0.4)]
    fine = [(0.5, 0.0, 1.4, p) for p in np.arange(0, 3.1, 0.2)]
    w = solid_angle_weights(*np.array(coarse + fine).T)
    assert w.mean() == pytest.approx(1.0)
    again = solid_angle_weights(*np.array(coarse + fine + fine).T)
    ratio = again[len(coarse) + 3] / again[5] / (w[len(coarse) + 3] / w[5])
    assert ratio == pytest.approx(0.5)


def test_reciprocity_of_data():
    angles = synthetic.directions(theta_i_deg=(0.0, 16.0, 32.0, 48.0, 64.0), azimuths=19)
    values = {"lambert.albedo": np.array([0.5]), "ggx.alpha": 0.5}
    good = synthetic.measurement("lambert + ggx", values, angles=angles)
    median, pairs = diagnostics.data_reciprocity(good)
    assert pairs > 100
    assert median < 1e-9
    bad = dataclasses.replace(good, value=good.value * (1 + good.theta_i[:, None]))
    assert diagnostics.data_reciprocity(bad)[0] > 0.1
    one = good.select(good.theta_i == good.theta_i[-1])
    assert diagnostics.data_reciprocity(one) is None


def test_data_of_both_halves_count_as_their_mean():
    """Whichever half comes first; azimuths that differ by a rounding are the same."""
    angles = synthetic.directions(theta_i_deg=(0.0, 16.0, 32.0, 48.0, 64.0), azimuths=19)
    values = {"lambert.albedo": np.array([0.5]), "ggx.alpha": 0.5}
    good = synthetic.measurement("lambert + ggx", values, angles=angles)
    skew = 1.0 + 0.2 * good.theta_i[:, None]

    def both(first: int) -> Measurement:
        parts = {1: good.value * skew, -1: good.value * (2.0 - skew)}
        turned = [s * good.phi_r * (1.0 + 1e-15) for s in (first, -first)]
        return dataclasses.replace(
            good,
            theta_i=np.tile(good.theta_i, 2),
            phi_i=np.tile(good.phi_i, 2),
            theta_r=np.tile(good.theta_r, 2),
            phi_r=np.concatenate(turned),
            value=np.concatenate([parts[first], parts[-first]]),
            valid=np.tile(good.valid, (2, 1)),
        )

    for first in (1, -1):
        median, pairs = diagnostics.data_reciprocity(both(first))
        assert pairs == diagnostics.data_reciprocity(good)[1]
        assert median < 1e-9


@pytest.mark.parametrize("name", list(objectives.OBJECTIVES))
def test_transformations_are_odd_and_their_slopes_are_their_derivatives(name):
    v = np.concatenate([[0.0], np.logspace(-6, 5, 45)])
    np.testing.assert_allclose(
        objectives.transform(name, -v), -objectives.transform(name, v), rtol=1e-14
    )
    with jax.enable_x64(True):
        points = jnp.asarray(np.concatenate([-v, v]))
        exact = jax.vmap(jax.grad(lambda x: objectives.transform(name, x)))(points)
        given = objectives.slope(name, points)
    # At 0 the derivative of sign(v) log1p(|v|) is 1, which autodiff misses.
    away = np.asarray(points) != 0
    np.testing.assert_allclose(np.asarray(given)[away], np.asarray(exact)[away], rtol=1e-9)
    assert np.all(np.isfinite(given))
    assert objectives.slope(name, np.zeros(1))[0] > 0


def test_colour_difference_of_known_spectra():
    """White against 10 % darker white, and against itself; known L* in closed form."""
    wavelengths = 400 + 10.0 * np.arange(31)
    angles = synthetic.directions(theta_i_deg=(20.0, 40.0), rings=4, azimuths=4)
    m = synthetic.measurement("lambert", {"lambert.albedo": np.ones(31)}, angles=angles)
    channels = tuple(Channel(f"{w:g} nm", float(w)) for w in wavelengths)
    m = dataclasses.replace(m, channels=channels)
    rows = select_rows(m, 85.0)
    same = colour.colour_difference(wavelengths, rows, rows.value)
    assert same.maximum == pytest.approx(0.0, abs=1e-9)
    darker = colour.colour_difference(wavelengths, rows, 0.9 * rows.value)
    lightness = 116 * 0.9 ** (1 / 3) - 16
    mean = 0.5 * (lightness + 100)
    weight = 1 + 0.015 * (mean - 50) ** 2 / np.sqrt(20 + (mean - 50) ** 2)
    assert darker.mean == pytest.approx((100 - lightness) / weight, rel=1e-3)
    assert darker.illuminant == "D65"
    shuffled = np.random.default_rng(0).permutation(31)
    other = dataclasses.replace(
        rows, value=rows.value[:, shuffled], valid=rows.valid[:, shuffled]
    )
    again = colour.colour_difference(wavelengths[shuffled], other, 0.9 * other.value)
    assert again.mean == pytest.approx(darker.mean, rel=1e-12)
    assert colour.colour_difference(wavelengths + 1000, rows, rows.value) is None
