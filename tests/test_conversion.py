"""A fitted model as data for another one."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from fitting import fit, load_result, resample
from fitting.cli import reading


@pytest.fixture(scope="module")
def glossy():
    truth = {
        "lambert.albedo": np.array([0.1, 0.4]),
        "ggx.alpha": 0.05,
        "ggx.f0": np.array([0.04, 0.05]),
        "ggx.f90": np.array([0.9, 1.0]),
    }
    data = synthetic.measurement("lambert + ggx", truth)
    return fit(data, "lambert + ggx", cross_validate=False)


@pytest.mark.slow
def test_the_same_surface_under_another_name(glossy):
    """GGX is Student's t with gamma = 2, the width and the coefficients being the same."""
    result = fit(resample(glossy), "lambert + student_t", cross_validate=False)
    np.testing.assert_allclose(result.parameter("student_t.gamma").value, 2.0, rtol=1e-5)
    np.testing.assert_allclose(result.parameter("student_t.alpha").value, 0.05, rtol=1e-5)
    np.testing.assert_allclose(
        result.parameter("student_t.f0").value, [0.04, 0.05], rtol=1e-5
    )
    assert result.scores.log1p < 1e-6


def test_what_is_sampled(glossy):
    data = resample(glossy)
    assert data.symmetry == "bilateral"
    assert [c.name for c in data.channels] == [c.name for c in glossy.channels]
    assert np.all(data.theta_r <= np.radians(80.0) + 1e-9)
    top = data.value[:, 0].max()
    assert np.sum(data.value[:, 0] > 0.05 * top) > 20


@pytest.mark.parametrize(
    ("expression", "width"),
    [
        ("ggx", {"ggx.alpha": 2e-3}),
        ("ggx(retro)", {"ggx.alpha": 2e-3}),
        # No row sees this one.
        ("phong", {"phong.exponent": 1e6, "phong.ks": 0.3}),
        ("lafortune", {"lafortune.exponent": 300.0, "lafortune.c_xy": 0.7}),
    ],
)
def test_a_narrow_peak_is_sampled_wherever_it_is(expression, width):
    """At every angle of incidence rows on the flanks, of the mirror peak and of others."""
    angles = synthetic.directions(rings=4, azimuths=4)
    data = synthetic.measurement(expression, width, angles=angles)
    fixed = fit(data, expression, fix=width, cross_validate=False)
    again = resample(fixed)
    for theta_i in np.unique(again.theta_i.round(9)):
        value = again.value[np.isclose(again.theta_i, theta_i), 0]
        assert np.sum(value > 0.3 * value.max()) >= 8


def test_a_result_can_be_named_where_a_file_is(glossy, tmp_path):
    path = tmp_path / "paint.fit.json"
    glossy.save(path)
    data = reading.read_file(path, None)
    np.testing.assert_array_equal(data.value, resample(load_result(path)).value)
    assert reading.stem(path) == "paint.converted"
    assert "lambert + ggx" in data.provenance.format
