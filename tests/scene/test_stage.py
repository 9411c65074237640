"""How far models are from the data in a scene, where the answer is known."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
import synthetic
from made_up_scenes import made

from data_formats import MeasurementError
from fitting.model import Model
from fitting.scene.stage import Stage, set_stage

LAMBERT, GLOSS = Model("lambert"), Model("lambert + ggx")
MATT: dict[str, Any] = {"lambert.albedo": np.array([0.5])}
SATIN: dict[str, Any] = {
    **MATT, "ggx.alpha": np.asarray(0.3), "ggx.f0": np.array([0.05]),
    "ggx.f90": np.array([0.7]),
}  # fmt: skip
SUN = {"kind": "disk", "theta_deg": 30.0, "phi_deg": 60.0, "diameter_deg": 20.0}
RADIANCE = {"relative_radiance": {}}
BALL = {"kind": "sphere", "pixels": 10}


def staged(
    model: str, values: dict[str, Any], noise: float = 0.0, theta: float = 75.0
) -> Stage:
    """A ball of a material that was measured every 15 degrees up to ``theta``."""
    grid = np.meshgrid(
        np.arange(0, theta + 1, 15.0), np.arange(0, theta + 6, 5.0), np.arange(0, 181, 7.5),
        indexing="ij",
    )  # fmt: skip
    theta_i, theta_r, phi = (np.radians(a.ravel()) for a in grid)
    m = synthetic.measurement(
        model, values, relative=noise, angles=(theta_i, 0 * theta_i, theta_r, phi)
    )
    return set_stage(m, made(SUN, seen=BALL, tolerance=RADIANCE), per_pixel=64)


def brighter(values: dict[str, Any], by: float) -> dict[str, Any]:
    return {n: v if "alpha" in n else v * by for n, v in values.items()}


@pytest.fixture(scope="module")
def satin() -> Stage:
    return staged("lambert + ggx", SATIN)


@pytest.fixture(scope="module")
def matt() -> Stage:
    return staged("lambert", MATT)


def test_a_model_that_is_a_tenth_brighter_is_a_tenth_off(satin):
    off = satin.error(GLOSS, brighter(SATIN, 1.1))
    assert off.raw_mean == pytest.approx(0.1, abs=0.005)
    assert off.mean == pytest.approx(off.raw_mean, abs=0.01)


def test_the_truth_is_as_far_as_the_interpolation_says(satin):
    off = satin.error(GLOSS, SATIN)
    assert off.mean < 0.01
    assert off.raw_mean <= 3.0 * off.interpolation + 1e-3
    assert off.quadrature_error < 0.01


def test_noise_is_told_and_half_of_it_is_taken_off():
    noisy = staged("lambert", MATT, noise=0.1)
    off = noisy.error(LAMBERT, MATT)
    assert off.noise > 0.0
    assert off.mean < off.raw_mean
    expected = max(off.raw_mean**2 - 0.5 * off.noise**2, 0.0) + off.interpolation**2
    assert off.mean == pytest.approx(np.sqrt(expected), rel=1e-9)


def test_what_was_not_measured_is_not_judged(matt):
    """Rows up to 60 degrees: much of a ball is seen or lit at steeper angles."""
    part = staged("lambert", MATT, theta=60.0)
    assert part.extrapolated_share > 0.2 > matt.extrapolated_share
    assert np.count_nonzero(part.weight) < 0.7 * np.count_nonzero(matt.weight)
    assert part.weight.sum() == pytest.approx(1.0)
    assert part.error(LAMBERT, MATT).mean < 0.01


def test_the_error_of_an_albedo_is_that_of_the_albedo(matt):
    scene = made(SUN, seen=BALL, tolerance={"albedo": {}})
    one = set_stage(matt.measurement, scene, reference=matt.reference, per_pixel=64)
    off = one.error(LAMBERT, {"lambert.albedo": np.array([0.53])})
    # Of light that arrives and leaves where data are near, which is not all of it.
    assert 0.02 < off.mean <= 0.0305


def test_rows_that_the_scene_does_not_look_at_count_for_little(satin):
    """Lamp and viewer are far away: all over the ball they are at the same angle."""
    assert satin.importance.shape == (satin.rows.index.size,)
    assert np.all(satin.importance >= 0)
    apart = 2 * np.degrees(np.arccos(np.clip(satin.rows.geometry.cos_d, -1, 1)))
    (lamp,) = satin.lights
    seen = 2 * np.degrees(np.arccos(np.clip(np.asarray(lamp.geometry.cos_d), -1, 1)))
    middle = np.median(seen)
    assert np.ptp(seen) < 25.0
    near, far = np.abs(apart - middle) < 10.0, np.abs(apart - middle) > 40.0
    assert satin.importance[near].mean() > 5 * satin.importance[far].mean()


def test_a_measurement_without_reflection_at_the_front_is_refused(matt):
    m = matt.measurement
    behind = dataclasses.replace(m, theta_r=np.pi - m.theta_r)
    with pytest.raises(MeasurementError):
        set_stage(behind, made(SUN, seen={"kind": "flat"}, tolerance=RADIANCE))
