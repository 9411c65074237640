"""Whether rows show the width of a lobe, and how wide the data themselves look."""

from __future__ import annotations

import dataclasses

import extremes
import jax
import numpy as np
import pytest
import synthetic

from fitting import FitOptions, fit, problem, sampling, starts
from fitting.model import Model
from fitting.rows import select_rows


def prepared(expression, truth, angles):
    m = synthetic.measurement(expression, truth, angles=angles)
    return problem.prepare(select_rows(m, 85.0), Model(expression), FitOptions())


def said(expression, angles, **shape):
    model = Model(expression)
    truth = {n: np.asarray(v) for n, v in model.defaults().items()}
    truth |= {n.replace("__", "."): np.asarray(v) for n, v in shape.items()}
    with jax.enable_x64(True):
        return sampling.sentences(prepared(expression, truth, angles), truth)


def narrow(p):
    return starts.narrow_candidates(p, sampling.brightness(p), starts.candidates(p))


def test_rows_within_the_lobe_at_one_angle_of_incidence_show_its_width():
    fine = extremes.fine_directions()
    for alpha in (1e-3, 1e-2, 0.1, 1.0):
        assert said("lambert + ggx", fine, ggx__alpha=alpha) == []


def test_one_row_at_each_of_many_angles_does_not():
    t = np.radians(np.arange(5.0, 80.0, 5.0))
    zero = np.zeros(t.size)
    mirror = (t, zero, t, zero + np.pi)
    away = (t, zero, t + np.radians(4.0), zero + np.pi)
    both = tuple(np.concatenate(pair) for pair in zip(mirror, away, strict=True))
    (words,) = said("ggx", both, ggx__alpha=0.005)
    assert "at most 1 row of one angle of incidence lies on the lobe (15 in all" in words
    assert "the next is 6.98 of its widths from the top" in words
    (words,) = said("ggx", away, ggx__alpha=0.005)
    assert "no row lies on the lobe, the nearest is 6.98 of its widths" in words
    (words,) = said("phong", away, phong__exponent=2.0 / 0.005**2)
    assert words.startswith(
        "phong.exponent 8e+04: no row lies on the lobe, the nearest is 14"
    )


def test_across_the_plane_of_incidence_rows_in_it_show_nothing():
    fine = np.stack(extremes.fine_directions())
    plane = tuple(fine[:, np.abs(np.sin(fine[3])) < 1e-9])
    shape = {"ggx__alpha_x": 0.02, "ggx__alpha_y": 0.03, "ggx__angle": 0.0}
    (words,) = said("ggx(aniso)", plane, **shape)
    assert words.startswith("ggx.alpha_y 0.03: ")
    assert said("ggx(aniso)", tuple(fine), **shape) == []


def test_a_retro_lobe_peaks_at_the_source():
    theta_i, phi_i, theta_r, phi_r = extremes.fine_directions()
    turned = (theta_i, phi_i, theta_r, phi_r - np.pi)
    assert said("ggx(retro)", turned, ggx__alpha=1e-3) == []
    mirror = tuple(a[theta_r > 0.1] for a in (theta_i, phi_i, theta_r, phi_r))
    assert len(said("ggx(retro)", mirror, ggx__alpha=1e-3)) == 1


def test_broad_and_absent_lobes_need_no_words():
    fine = extremes.fine_directions((40.0,))
    assert said("lambert", fine) == []
    assert said("oren_nayar", fine, oren_nayar__sigma=1e-3) == []
    none = {"ggx__f0": np.zeros(1), "ggx__f90": np.zeros(1), "ggx__alpha": 1e-4}
    assert said("lambert + ggx", fine, **none) == []


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [
        ("ggx", "alpha", 1e-3),
        ("student_t", "alpha", 1e-3),
        ("phong", "exponent", 2e6),
        ("blinn_phong", "exponent", 2e6),
    ],
)
def test_peaks_narrower_than_the_usual_starts_get_starts_of_their_own(
    name, parameter, value
):
    expression, truth = extremes.truth_of(name, 1e-3)
    with jax.enable_x64(True):
        p = prepared(expression, truth, extremes.fine_directions())
        column = p.unknowns.free_shape.index(f"{name}.{parameter}")
        more = narrow(p)
        found = [float(p.unknowns.shape(u)[f"{name}.{parameter}"]) for u in more]
        usual = prepared(*extremes.truth_of(name, 0.1), extremes.fine_directions())
        assert not narrow(usual).size
    assert np.ptp(more[:, column]) > 0
    assert min(abs(np.log(f / value)) for f in found) < np.log(4.0)


def test_the_thinned_scan_keeps_a_peak_of_few_rows():
    rng = np.random.default_rng(0)
    n = 20_000
    theta_i = np.full(n, 0.7)
    theta_r = np.arccos(rng.uniform(0.2, 1.0, n))
    theta_r[:5] = 0.7 + np.array([0.0, 1e-3, -1e-3, 3e-3, 0.01])
    phi_r = rng.uniform(0.0, 3.0, n)
    phi_r[:5] = np.pi
    expression, truth = extremes.truth_of("ggx", 2e-3)
    with jax.enable_x64(True):
        p = prepared(expression, truth, (theta_i, np.zeros(n), theta_r, phi_r))
        thin = starts.thinned(p, sampling.brightness(p))
        assert float(thin.target.max()) == float(p.target.max())
        whole = float((np.asarray(p.weight) ** 2).sum())
        assert float((np.asarray(thin.weight) ** 2).sum()) == pytest.approx(whole, rel=0.1)


def test_a_channel_without_a_valid_value_does_not_stop_the_others():
    truth = {"lambert.albedo": np.array([0.2, 0.3]), "ggx.alpha": 0.2}
    data = synthetic.measurement("lambert + ggx", truth)
    valid = data.valid.copy()
    valid[:, 1] = False
    data = dataclasses.replace(data, valid=valid)
    result = fit(data, "lambert + ggx", per_channel_shape=True, cross_validate=False)
    np.testing.assert_allclose(result.parameter("ggx.alpha").value[0], 0.2, rtol=1e-6)
    assert any("no valid value" in s for s in result.identifiability)


def test_a_lobe_that_shines_back_is_looked_for_where_the_source_is():
    """A retro Phong lobe of which no row is near the mirror direction."""
    angles = synthetic.directions(rings=24, azimuths=24)
    truth = {"phong.exponent": 300.0, "phong.ks": 0.3}
    data = synthetic.measurement("phong(retro)", truth, angles=angles)
    result = fit(data, "phong(retro)", cross_validate=False)
    np.testing.assert_allclose(result.parameter("phong.exponent").value, 300.0, rtol=1e-6)
    assert not any("lie on the lobe" in s for s in result.identifiability)
