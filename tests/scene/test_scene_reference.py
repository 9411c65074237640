"""The measurement between its samples, where the truth between them is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import synthetic

from data_formats import Measurement
from fitting.geometry import Geometry, from_angles
from fitting.model import Model
from fitting.predict import predict_geometry
from fitting.rows import select_rows
from fitting.scene.chart import from_half_angles, half_angles
from fitting.scene.reference import Reference, interpolate

MODEL = "lambert + ggx"
SATIN: dict[str, Any] = {
    "lambert.albedo": np.array([0.4, 0.1]), "ggx.alpha": 0.2,
    "ggx.f0": np.array([0.05, 0.05]), "ggx.f90": np.array([0.6, 0.6]),
}  # fmt: skip


def goniometer(relative: float, absolute: float) -> Measurement:
    """Six incidences 15 degrees apart, detectors 5 degrees apart."""
    grid = np.meshgrid(
        np.arange(0, 76, 15.0), np.arange(0, 81, 5.0), np.arange(0, 181, 7.5), indexing="ij"
    )
    theta_i, theta_r, phi = (np.radians(a.ravel()) for a in grid)
    angles = (theta_i, 0 * theta_i, theta_r, phi)
    return synthetic.measurement(
        MODEL, SATIN, relative=relative, absolute=absolute, angles=angles
    )


def between(count: int = 1500) -> Geometry:
    """Directions all over, up to 70 degrees, half of them near the mirror."""
    rng = np.random.default_rng(3)
    theta_i, theta_r = np.radians(rng.uniform(0, 70, (2, count)))
    phi = rng.uniform(0, 2 * np.pi, count)
    near = rng.random(count) < 0.5
    theta_r = np.where(
        near, np.clip(theta_i + 0.1 * rng.normal(size=count), 0, 1.2), theta_r
    )
    phi = np.where(near, np.pi + 0.1 * rng.normal(size=count), phi)
    return from_angles(theta_i, 0.4, theta_r, 0.4 + phi)


def of(m: Measurement) -> Reference:
    return interpolate(select_rows(m, 89.0), isotropic=True)


@pytest.fixture(scope="module")
def clean() -> Reference:
    return of(goniometer(0.0, 0.0))


@pytest.fixture(scope="module")
def noisy() -> Reference:
    return of(goniometer(0.03, 1e-3))


def truth(g: Geometry) -> np.ndarray:
    return predict_geometry(Model(MODEL), SATIN, g)


def test_half_angles_are_a_round_trip():
    g = between()
    again = from_half_angles(half_angles(g))
    for name in ("wix", "wiy", "cos_i", "wox", "woy", "cos_o"):
        np.testing.assert_allclose(getattr(again, name), getattr(g, name), atol=1e-12)


def test_without_noise_values_between_the_samples_are_right(clean: Reference):
    g = between()
    assert np.mean(clean.supported(g)) > 0.95
    known = clean.supported(g)
    off = np.abs(clean.value(g) / truth(g) - 1)[known]
    assert np.median(off) < 3e-3
    # Worst on the ridge of the gloss, half way between incidences 15 degrees apart.
    assert np.percentile(off, 95) < 0.06


def test_noise_is_smoothed_and_told(clean: Reference, noisy: Reference):
    """The noise that is left over is what the reference says of itself, within a half."""
    g = between()
    known = noisy.supported(g)
    off = (noisy.value(g) / clean.value(g) - 1)[known]
    told = (noisy.value(g, noisy=True) / noisy.value(g) - 1)[known]
    size, told_size = (np.sqrt(np.mean(np.clip(a, -0.3, 0.3) ** 2)) for a in (off, told))
    assert size < 0.03
    assert size / 1.5 < told_size < 1.5 * size
    # Unbiased: a hundred errors average to nothing.
    assert abs(np.mean(off)) < 5e-3


def test_exchanged_directions_have_one_value(noisy: Reference):
    g = between()
    np.testing.assert_allclose(noisy.value(g), noisy.value(g.swapped), rtol=1e-9)


def test_nothing_is_known_beyond_the_data_and_nothing_grows_there(clean: Reference):
    steep = from_angles(np.radians([80.0, 88.0, 80.0]), 0.0, np.radians([80.0, 20.0, 86.0]),
                        np.radians([180.0, 180.0, 90.0]))  # fmt: skip
    assert not clean.supported(steep).any()
    value = clean.value(steep)
    assert np.all(np.isfinite(value))
    assert np.all(np.abs(value) < 10 * truth(steep).max())


def test_a_single_incidence_and_a_band_of_zeros_are_no_obstacles():
    m = goniometer(0.01, 1e-4)
    keep = np.abs(m.theta_i - np.radians(30)) < 1e-6
    value = m.value[keep].copy()
    value[:, 1] = 0.0
    one = synthetic.measurement(
        MODEL,
        SATIN,
        angles=tuple(a[keep] for a in (m.theta_i, m.phi_i, m.theta_r, m.phi_r)),
    )
    reference = of(
        Measurement(
            one.theta_i, one.phi_i, one.theta_r, one.phi_r, value=value, valid=one.valid,
            channels=one.channels, symmetry="bilateral",
        )
    )  # fmt: skip
    here = from_angles(np.radians([30.0]), 0.0, np.radians([20.0]), np.radians([170.0]))
    assert reference.supported(here).all()
    np.testing.assert_allclose(reference.value(here)[0, 0], truth(here)[0, 0], rtol=0.1)
    assert reference.value(here)[0, 1] == pytest.approx(0.0, abs=1e-6)
    elsewhere = from_angles(
        np.radians([60.0]), 0.0, np.radians([60.0]), np.radians([180.0])
    )
    assert not reference.supported(elsewhere).any()
