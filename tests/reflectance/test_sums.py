"""Sums with a gloss trap, and with the solid angles that a file states."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic import measurement

import data_formats
from data_formats import Measurement
from data_formats.measurement import PROJECTED_SOLID_ANGLE
from fitting.diagnostics import data_albedo
from fitting.reflectance import Directional, Hemispherical, named, quantity, surface_of
from fitting.reflectance.measured import measured

WHOLE = Hemispherical()
GLOSSY = {"lambert.albedo": [0.3], "ggx.alpha": 0.4, "ggx.f0": [0.3], "ggx.f90": [1.0]}


def lambert(theta_i_deg: tuple[float, ...]) -> Measurement:
    """A Lambertian of 0.4 on rings of 10 deg, one row at the pole."""
    grid = [
        (i, 0.0, t, p)
        for i in theta_i_deg
        for t in range(0, 90, 10)
        for p in range(0, 360, 10 if t else 360)
    ]
    angles = tuple(np.radians(np.array(grid)).T)
    return measurement("lambert", {"lambert.albedo": np.array([0.4])}, angles=angles)


def patches(theta_i_deg: float, *, bounds: int = 30, around: int = 36) -> Measurement:
    """Patches of equal projected solid angle, from two azimuths of the source."""
    squares = (np.arange(bounds) + 0.5) / bounds
    grid = [
        (np.radians(theta_i_deg), source, np.arcsin(np.sqrt(s)), source + p)
        for source in (0.0, 1.0)
        for s in squares
        for p in 2.0 * np.pi * np.arange(around) / around
    ]
    angles = tuple(np.array(grid).T)
    m = measurement("lambert + ggx", GLOSSY, angles=angles)
    own = np.full(m.n_rows, np.pi / (bounds * around))
    return dataclasses.replace(
        m, symmetry="isotropic", auxiliary={PROJECTED_SOLID_ANGLE: own}
    )


@pytest.mark.parametrize("theta_i", [0, 8])
@pytest.mark.parametrize("trap", [None, 3.0, 8.0, 30.0, 60.0])
def test_a_lambertian_has_its_albedo_with_any_trap(theta_i, trap):
    name = f"{theta_i}/d" + ("" if trap is None else " SCE")
    g = named(name, trap_deg=trap or 8.0)
    found = measured(lambert((theta_i,)), g.incident, g.collected)
    assert found.factor[0] == pytest.approx(0.4, abs=1e-4)
    assert found.covered is not None
    assert found.extrapolated is not None
    assert 0.9 < found.covered[0] <= 1.0
    share = found.extrapolated[0] / found.value[0]
    assert share == pytest.approx(1.0 - found.covered[0], abs=1e-4)


def test_a_trap_is_where_the_mirror_is_of_the_rows_that_are_used():
    """Rows of 0 and 16 deg, each with its own trap, stand for light from 8 deg."""
    g = named("8/d SCE", trap_deg=20.0)
    found = measured(lambert((0.0, 16.0)), g.incident, g.collected)
    assert found.factor[0] == pytest.approx(0.4, abs=1e-4)


@pytest.mark.parametrize("trap", [None, 15.0, 30.0])
def test_stated_solid_angles_agree_with_the_model(trap):
    m = patches(20.0)
    g = named("20/d" if trap is None else "20/d SCE", trap_deg=trap or 8.0)
    found = measured(m, g.incident, g.collected)
    exact = quantity(surface_of("lambert + ggx", GLOSSY), g.incident, g.collected)
    assert found.value[0] == pytest.approx(
        exact.value[0], rel=3e-3 if trap is None else 0.03
    )
    assert any("states the projected solid angle" in n for n in found.notes)
    if trap is None:
        assert found.value[0] == pytest.approx(data_albedo(m)[0].albedo, rel=1e-12)
        assert found.covered == pytest.approx([1.0], abs=1e-12)
        assert found.standard_uncertainty is None


def test_patches_that_lack_are_extrapolated():
    m = patches(20.0)
    near = m.select(m.theta_r < np.radians(60.0))
    found = measured(near, Directional(20.0), WHOLE)
    assert found.covered is not None
    assert found.extrapolated is not None
    assert found.covered[0] == pytest.approx(22 / 30, abs=1e-9)
    stated = data_albedo(near)[0].albedo
    assert found.value[0] - found.extrapolated[0] == pytest.approx(stated, rel=1e-12)
    assert found.value[0] == pytest.approx(stated * 30 / 22, rel=1e-12)


@pytest.mark.parametrize(
    ("file", "theta_i", "transmitted", "value"),
    [("2011-SA1.XML", 0.0, False, 0.4654), ("SingleClear.xml", 0.0, True, 0.8974),
     ("SingleClear.xml", 20.0, True, 0.8965)],
)  # fmt: skip
def test_klems_patches_of_a_file(real_data, file, theta_i, transmitted, value):
    m = data_formats.read(real_data / "radiance" / file)
    found = measured(m, Directional(theta_i), WHOLE, transmitted=transmitted)
    assert value in [round(v, 4) for v in found.value]
    assert found.covered == pytest.approx([1.0] * m.n_channels, abs=1e-9)
    assert found.standard_uncertainty is None
