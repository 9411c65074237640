"""The noise of the data, by each account, against the noise that was put in."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from data_formats import read
from fitting import FitOptions, judge
from fitting.predict import predict
from fitting.rows import select_rows
from fitting.sample import MODEL, PARAMETERS, sample_path
from fitting.tradeoff.noise_floor import noise_floors

PAINT = {"lambert.albedo": np.array([0.2, 0.4]), "ggx.alpha": 0.4,
         "ggx.f0": np.array([0.05, 0.05]), "ggx.f90": np.array([1.0, 1.0])}  # fmt: skip


def test_reciprocity_of_the_sample_tells_the_error_of_the_truth():
    """What the floor claims: the error that the true surface has on these data."""
    m = read(sample_path())
    rows = select_rows(m, 85.0)
    values = {
        n: v if n.endswith("alpha") else np.broadcast_to(np.asarray(v), m.n_channels)
        for n, v in PARAMETERS.items()
    }
    k = rows.index
    truth = predict(MODEL, values, m.theta_i[k], m.phi_i[k], m.theta_r[k], m.phi_r[k])
    options = FitOptions()
    by_angle = judge.by_angle(rows, truth, "log1p", options)
    typical = np.exp(np.mean(np.log([a.objective for a in by_angle])))
    (floor,) = noise_floors(m, rows, "log1p", options)
    assert floor.source == "reciprocity"
    assert floor.typical == pytest.approx(typical, rel=0.15)
    assert floor.error == pytest.approx(judge.scores(rows, truth, options).log1p, rel=0.15)
    # The sample is made with 1 %, and a little that does not scale.
    assert 0.009 < floor.relative < 0.02


def test_repeats_tell_the_relative_noise():
    once = synthetic.directions(rings=8, azimuths=7)
    twice = tuple(np.tile(a, 3) for a in once)
    m = synthetic.measurement("lambert + ggx", PAINT, relative=0.03, angles=twice)
    floors = noise_floors(m, select_rows(m, 85.0), "log1p", FitOptions())
    repeats = next(f for f in floors if f.source == "repeats")
    assert repeats.relative == pytest.approx(0.03, rel=0.08)
    assert f"{2 * once[0].size} repeated directions" in repeats.sentence


def test_stated_sigma_is_one_sigma():
    m = synthetic.measurement("lambert", {}, relative=0.02, absolute=1e-3, sigma=True)
    floors = noise_floors(m, select_rows(m, 85.0), "chi2", FitOptions())
    stated = next(f for f in floors if f.source == "sigma")
    assert stated.error == pytest.approx(1.0, rel=1e-12)
    assert stated.typical == pytest.approx(1.0, rel=1e-12)


def test_nothing_is_said_where_the_data_say_nothing():
    angles = synthetic.directions(theta_i_deg=(30.0,), rings=6, azimuths=5)
    m = synthetic.measurement("lambert", {}, relative=0.02, angles=angles)
    assert noise_floors(m, select_rows(m, 85.0), "log1p", FitOptions()) == []
