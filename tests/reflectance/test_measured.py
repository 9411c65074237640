"""Sums over rows, against the model that the rows were made from."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic import directions, measurement

from data_formats import MeasurementError
from fitting.reflectance import (
    Conical,
    Directional,
    Hemispherical,
    named,
    quantity,
    surface_of,
)
from fitting.reflectance.measured import measured

VALUES = {"lambert.albedo": [0.2, 0.6], "ggx.alpha": 0.3, "ggx.f0": [0.05, 0.05],
          "ggx.f90": [1.0, 1.0]}  # fmt: skip
TRUE = surface_of("lambert + ggx", VALUES)
WHOLE = Hemispherical()


@pytest.fixture(scope="module")
def rows():
    angles = directions((8.0, 25.0, 40.0, 55.0, 70.0), rings=33, azimuths=37)
    return measurement("lambert + ggx", VALUES, angles=angles, relative=1e-9, sigma=True)


@pytest.mark.parametrize("name", ["8/d", "d/8", "8/d SCE", "d/8 SCE", "white-sky", "45/0"])
def test_sums_agree_with_the_model(rows, name):
    g = named(name)
    found = measured(rows, g.incident, g.collected)
    exact = quantity(TRUE, g.incident, g.collected)
    assert (found.name, found.unit) == (exact.name, exact.unit)
    for k in range(2):
        assert found.standard_uncertainty is not None
        sd = found.standard_uncertainty[k]
        assert abs(found.value[k] - exact.value[k]) < 2.0 * sd
        assert sd < 0.15 * exact.value[k]
    if "/d" in name or "d/" in name:
        assert found.covered is not None
        assert 0.95 < min(found.covered) < 0.99
        assert found.extrapolated is not None
        missing = (
            (1 - found.covered[1]) * found.factor[1] * found.value[1] / found.factor[1]
        )
        assert found.extrapolated[1] == pytest.approx(missing, rel=0.5)


def test_uncovered_directions_are_uncertain(rows):
    """What nobody measured is filled with the nearest ring, and uncertain by all of it."""
    near = rows.select(rows.theta_r < np.radians(60.0))
    found = measured(near, Directional(8.0), WHOLE)
    exact = quantity(TRUE, Directional(8.0), WHOLE)
    assert found.covered is not None
    assert found.extrapolated is not None
    assert found.standard_uncertainty is not None
    assert found.covered[0] == pytest.approx(np.sin(np.radians(58.75)) ** 2, abs=0.01)
    assert found.standard_uncertainty[0] >= found.extrapolated[0] / np.sqrt(3)
    assert abs(found.value[0] - exact.value[0]) < 2 * found.standard_uncertainty[0]
    assert any("extrapolated" in note for note in found.notes)


def test_sigma_is_propagated(rows):
    noisy = dataclasses.replace(rows, sigma=0.05 * np.abs(rows.value))
    quiet = measured(rows, Directional(8.0), WHOLE)
    found = measured(noisy, Directional(8.0), WHOLE)
    rng = np.random.default_rng(0)
    draws = [
        measured(dataclasses.replace(noisy, value=rows.value + noisy.sigma * rng.normal(
            size=rows.value.shape)), Directional(8.0), WHOLE).value
        for _ in range(40)
    ]  # fmt: skip
    assert found.standard_uncertainty is not None
    assert quiet.standard_uncertainty is not None
    one, other = np.array(found.standard_uncertainty), np.array(quiet.standard_uncertainty)
    added = one**2 - other**2
    # The draws move the extrapolated part as well.
    np.testing.assert_allclose(np.sqrt(added), np.std(draws, axis=0), rtol=0.4)


def test_between_angles_of_incidence(rows):
    found = measured(rows, Directional(32.0), WHOLE)
    assert any("linear between the angles" in n for n in found.notes)
    exact = quantity(TRUE, Directional(32.0), WHOLE)
    np.testing.assert_allclose(found.value, exact.value, rtol=0.03)
    back = measured(rows, Directional(0.0), Directional(40.0, 180.0))
    assert any("reciprocity" in n for n in back.notes)


@pytest.mark.parametrize(
    ("incident", "collected", "options", "says"),
    [
        (Directional(85.0), WHOLE, {}, "nearest to 85 deg is 70.0 deg"),
        (Directional(8.0), WHOLE, {"transmitted": True}, "no rows of transmitted light"),
        (Directional(8.0), WHOLE, {"side": "back"}, "no rows of reflected light"),
        (Directional(8.0), Conical(0.0, 0.0, 5.0), {}, "too far apart for sums over cones"),
        (Directional(8.0), Directional(89.0, 90.0), {}, "no row is within 7.5 deg"),
    ],
)
def test_refusals(rows, incident, collected, options, says):
    with pytest.raises(MeasurementError, match=says):
        measured(rows, incident, collected, **options)


def test_a_plane_of_incidence_is_no_hemisphere(rows):
    flat = rows.select((rows.phi_r < 0.01) | (rows.phi_r > 3.13))
    with pytest.raises(MeasurementError, match="fit a model"):
        measured(flat, Directional(8.0), WHOLE)
