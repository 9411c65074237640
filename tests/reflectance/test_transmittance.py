"""Transmittances: rough interfaces, plates, and what is lost."""

from __future__ import annotations

import math

import jax.numpy as jnp
import pytest
from test_nine import clear, value

from fitting.models import slab
from fitting.reflectance import Conical, Directional, Hemispherical, quantity

WHOLE = Hemispherical()


@pytest.mark.parametrize(
    ("alpha", "mu", "side", "reflected", "transmitted"),
    [(0.50364, 1.0, "front", 0.028031, 0.939637),
     (0.50364, 0.5161, "front", 0.041664, 0.843979),
     (1.0, 1.0, "front", 0.012702, 0.880638), (0.50364, 1.0, "back", 0.046056, 0.704963)],
)  # fmt: skip
def test_rough_dielectric(alpha, mu, side, reflected, transmitted):
    """Published single-scattering R and T, models.md 6.3, stated to 1e-3."""
    surface = clear("rough_dielectric", alpha=alpha, eta=1.5)
    light = Directional(math.degrees(math.acos(mu)))
    r = value(surface, light, WHOLE, side=side)
    t = value(surface, light, WHOLE, side=side, transmitted=True)
    assert r == pytest.approx(reflected, abs=5e-5)
    assert t == pytest.approx(transmitted, abs=1e-4)


@pytest.mark.parametrize("theta", [0.0, 60.0])
def test_smooth_limit_is_fresnel(theta):
    surface = clear("rough_dielectric", alpha=1e-4, eta=1.5)
    f = {0.0: 0.04, 60.0: 0.0891867128}[theta]
    light = Directional(theta)
    assert value(surface, light, WHOLE) == pytest.approx(f, abs=1e-6)
    assert value(surface, light, WHOLE, transmitted=True) == pytest.approx(1 - f, abs=2e-6)


def test_smooth_limits_of_plates():
    light = Directional(40.0)
    cosine, eta, depth = jnp.asarray([math.cos(math.radians(40.0)), 1.5, 0.3])
    for name, width in (("smooth_slab", "width"), ("thin_slab", "alpha")):
        surface = clear(name, **{width: 1e-4}, eta=1.5, optical_depth=0.3)
        r, t = (float(v) for v in slab.reflected_and_transmitted(cosine, eta, depth))
        assert value(surface, light, WHOLE) == pytest.approx(r, abs=2e-6)
        assert value(surface, light, WHOLE, transmitted=True) == pytest.approx(t, abs=2e-6)


def test_a_clear_plate_loses_nothing():
    surface = clear("smooth_slab", width=3e-3, eta=1.5, optical_depth=0.0)
    r = value(surface, Directional(8.0), WHOLE)
    t = value(surface, Directional(8.0), WHOLE, transmitted=True)
    assert r + t == pytest.approx(1.0, abs=3e-6)


def test_both_sides_by_reciprocity():
    """T(d/0) / T(0/d) of an interface: ``f / n_o^2`` is the same both ways."""
    surface = clear("rough_dielectric", alpha=0.3, eta=1.5)
    down = quantity(surface, Directional(20.0), WHOLE, transmitted=True)
    up = quantity(surface, WHOLE, Directional(20.0), side="back", transmitted=True)
    assert down.factor[0] == pytest.approx(up.factor[0] * 1.5**2, rel=3e-6)


def test_haze_is_what_leaves_the_cone():
    """The share scattered by more than 2.5 degrees (ASTM D1003)."""
    surface = clear("thin_slab", alpha=0.02, eta=1.5, optical_depth=0.0)
    light = Directional(0.0)
    aside = Hemispherical(Conical(0.0, 0.0, 2.5))
    scattered = value(surface, light, aside, transmitted=True)
    through = value(surface, light, WHOLE, transmitted=True)
    straight = value(surface, light, Conical(0.0, 0.0, 2.5), transmitted=True)
    assert scattered + straight == pytest.approx(through, abs=3e-6)
    assert 0.05 < scattered / through < 0.6


def test_lambert_transmission_and_turned_over():
    opal = clear("lambert_transmission")
    for side in ("front", "back"):
        found = quantity(opal, WHOLE, WHOLE, side=side, transmitted=True)
        assert found.factor[0] == pytest.approx(1.0, rel=1e-6)
    front = clear("rough_dielectric", alpha=0.3, eta=1.5)
    back = clear("rough_dielectric(back)", alpha=0.3, eta=1.5)
    beams = Directional(50.0), WHOLE
    for transmitted in (False, True):
        one = value(front, *beams, transmitted=transmitted)
        other = value(back, *beams, side="back", transmitted=transmitted)
        assert one == pytest.approx(other, rel=3e-6)
