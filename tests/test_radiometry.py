"""Radiometry against closed forms, quadrature, and Mitsuba's rough glass."""

from __future__ import annotations

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad

from fitting import radiometry
from fitting.albedo import model_albedo
from fitting.model import Model
from fitting.predict import predict
from fitting.radiometry import Cone

DEG = np.pi / 180


def lambert(theta_i, phi_i, theta_r, phi_r, albedo=(0.2, 0.9)):
    return np.broadcast_to(np.asarray(albedo) / np.pi, (theta_i.size, 2))


def test_solid_angle_of_small_and_large_cones():
    a = np.array([1e-9, 1e-3, 0.5, np.pi / 2, np.pi])
    got = radiometry.solid_angle_of_cone(a)
    np.testing.assert_allclose(got[2:], 2 * np.pi * (1 - np.cos(a[2:])), rtol=1e-14)
    # The series in a, where 1 - cos(a) has no digit left.
    np.testing.assert_allclose(
        got[:2], np.pi * a[:2] ** 2 * (1 - a[:2] ** 2 / 12), rtol=1e-13
    )
    # The Sun's mean angular radius, 959.63", is 6.80e-5 sr.
    sun = radiometry.solid_angle_of_cone(959.63 / 3600 * DEG)
    assert sun == pytest.approx(6.80e-5, rel=1e-3)


def test_projected_solid_angles_add_up():
    edges = np.linspace(0, np.pi / 2, 7)
    rings = radiometry.projected_solid_angle_of_annulus(edges[:-1], edges[1:])
    whole = radiometry.projected_solid_angle_of_hemisphere()
    assert rings.sum() == pytest.approx(whole, rel=1e-14) == np.pi
    cone = radiometry.projected_solid_angle_of_cone(0.0, edges)
    np.testing.assert_allclose(np.diff(cone), rings, rtol=1e-13)


def test_projected_cone_in_closed_forms():
    cone = radiometry.projected_solid_angle_of_cone
    t, a = np.meshgrid(np.linspace(0, 1.2, 13), np.linspace(0, 0.37, 7))
    np.testing.assert_allclose(cone(t, a), np.pi * np.sin(a) ** 2 * np.cos(t), rtol=1e-13)
    # A half space of directions tilted by t sees pi (1 + cos t) / 2 of the hemisphere.
    tilt = np.linspace(0, np.pi, 9)
    half = cone(tilt, np.pi / 2)
    np.testing.assert_allclose(half, np.pi * (1 + np.cos(tilt)) / 2, rtol=1e-14, atol=1e-15)
    # Centred on the horizon: half of a disk, a - sin(a) cos(a), 2/3 a^3 where it is small.
    a = np.array([1e-5, 0.01, 0.5, 1.5])
    exact = a - np.sin(a) * np.cos(a)
    exact[:2] = 2 / 3 * a[:2] ** 3 * (1 - a[:2] ** 2 / 5)
    np.testing.assert_allclose(cone(np.pi / 2, a), exact, rtol=1e-9)
    assert cone(2.0, 0.4) == 0


@settings(max_examples=60, deadline=None)
@given(st.floats(0, np.pi), st.floats(0, np.pi))
def test_projected_cone_and_the_rest_of_the_hemisphere(theta, a):
    inside = radiometry.projected_solid_angle_of_cone(theta, a)
    outside = radiometry.projected_solid_angle_of_cone(np.pi - theta, np.pi - a)
    assert -1e-15 <= inside <= np.pi + 1e-14
    assert inside + outside == pytest.approx(np.pi, abs=1e-13)


@pytest.mark.parametrize(("theta", "a"), [(1.2, 0.6), (1.8, 0.5), (1.0, 1.4), (2.2, 1.9)])
def test_projected_cone_across_the_horizon_by_quadrature(theta, a):
    """By scipy, in coordinates around the axis of the cone."""

    def integrand(psi, t):
        z = np.cos(t) * np.cos(theta) + np.sin(t) * np.sin(theta) * np.cos(psi)
        return 2 * max(z, 0.0) * np.sin(t)

    expected, _ = dblquad(integrand, 0, a, 0, np.pi, epsabs=1e-6, epsrel=1e-6)
    got = radiometry.projected_solid_angle_of_cone(theta, a)
    assert got == pytest.approx(expected, abs=3e-6)
    ours = radiometry.irradiance(1.0, cone=Cone(theta, 0.4, a), tolerance=1e-11)
    assert ours.converged
    assert got == pytest.approx(ours.value, rel=1e-11)


@pytest.mark.parametrize("n", [0, 1, 2, 7.5, 300])
def test_irradiance_of_a_cosine_power(n):
    found = radiometry.irradiance(lambda t, p: 3 * np.cos(t) ** n, tolerance=1e-10)
    exact = 6 * np.pi / (n + 2)
    assert found.converged
    assert abs(found.value - exact) <= max(found.error, 1e-13 * exact)
    assert found.error <= 1e-10 * exact


def test_irradiance_of_a_disk_anywhere():
    for theta, a in itertools.product((0.0, 0.3, 1.0, 1.5, 1.7), (0.00465, 0.2, 0.8)):
        exact = radiometry.irradiance_of_disk(5.0, theta, a)
        found = radiometry.irradiance(5.0, cone=Cone(theta, 2.0, a))
        assert found.value == pytest.approx(exact, rel=1e-7, abs=1e-12)


def test_irradiance_knows_azimuths_channels_and_its_own_limits():
    def sky(theta, phi):
        return np.stack([np.ones_like(phi), 1 + np.cos(phi), np.sin(theta)], axis=1)

    found = radiometry.irradiance(sky)
    np.testing.assert_allclose(found.value, [np.pi, np.pi, 2 * np.pi / 3], rtol=1e-9)
    rough = radiometry.irradiance(lambda t, p: np.cos(4e4 * t) ** 2, tolerance=1e-12)
    assert rough.converged is False
    # Nothing of this cone is above the horizon.
    assert radiometry.irradiance(1.0, cone=Cone(3.0, 0.0, 0.5)).value == 0


def test_emitter_and_point_source():
    """A Lambertian disk from near and far, and its flux, in three ways."""
    radiance, radius = 7.0, 0.05
    area, theta = np.pi * radius**2, np.array([0.0, 0.5, 1.5, 2.0])
    intensity = radiometry.radiant_intensity(radiance, area, theta)
    np.testing.assert_allclose(intensity, radiance * area * np.maximum(np.cos(theta), 0))
    distance = 30.0
    far = radiometry.irradiance_of_point_source(intensity[0], distance, 0.4)
    disk = radiometry.irradiance_of_disk(radiance, 0.4, np.arctan(radius / distance))
    assert far == pytest.approx(disk, rel=4e-6)
    assert radiometry.irradiance_of_point_source(1.0, 1.0, 2.0) == 0

    exitance = radiometry.radiant_exitance(radiance)
    assert exitance.value == pytest.approx(np.pi * radiance, rel=1e-12)
    whole = radiometry.flux(exitance.value, area)
    cone = radiometry.flux_through_cone(radiance, area, 0.0, 0.0, np.pi / 2)
    assert cone.value == pytest.approx(whole, rel=1e-12)
    part = radiometry.flux_through_cone(lambda t, p: np.cos(t), area, 0.0, 0.0, 0.3)
    assert part.value == pytest.approx(area * 2 * np.pi * (1 - np.cos(0.3) ** 3) / 3)
    tilted = radiometry.flux_through_cone(radiance, area, 1.4, 1.0, 0.3)
    closed = radiometry.flux(radiometry.irradiance_of_disk(radiance, 1.4, 0.3), area)
    assert tilted.value == pytest.approx(closed, rel=1e-8)


def test_reflected_radiance_of_lambert():
    """``albedo E / pi`` under a hemisphere, a disk and a beam."""
    whole = radiometry.reflected_radiance(lambert, 2.0, 0.5, 1.0)
    np.testing.assert_allclose(whole.value, [0.4, 1.8], rtol=1e-9)
    sun = Cone(0.8, 1.0, 0.1)
    disk = radiometry.reflected_radiance(lambert, 100.0, 0.5, 1.0, cone=sun)
    e = 100 * np.pi * np.sin(0.1) ** 2 * np.cos(0.8)
    np.testing.assert_allclose(disk.value, np.array([0.2, 0.9]) * e / np.pi, rtol=1e-9)
    beam = radiometry.reflected_radiance_of_beam(lambert, 3.0, [0.0, 1.0], 0.0, 0.5, 1.0)
    expected = np.outer(3 * np.cos([0.0, 1.0]), np.array([0.2, 0.9]) / np.pi)
    np.testing.assert_allclose(beam, expected, rtol=1e-14)


@pytest.mark.parametrize("theta_r", [0.0, 0.4, 1.1, 1.3])
def test_reflected_radiance_of_a_peak_around_the_mirror(theta_r):
    """A Phong peak of known integral: ``cos^n`` around the mirror, divided by cos_i."""
    n = 2000.0

    def peak(theta_i, phi_i, theta, phi):
        d = 2 * np.sin(0.5 * (theta_i - theta)) ** 2
        d += np.sin(theta_i) * np.sin(theta) * (1 + np.cos(phi_i - phi))
        return np.maximum(1 - d, 0) ** n / np.cos(theta_i)

    found = radiometry.reflected_radiance(peak, 1.0, theta_r, 0.7)
    assert found.converged
    assert found.value[0] == pytest.approx(2 * np.pi / (n + 1), rel=1e-6)


def test_uniform_light_on_a_model_sees_its_albedo():
    """By reciprocity; the albedo is integrated over half vectors, not over the source."""
    values = {"lambert.albedo": [0.2, 0.4], "ggx.alpha": 0.1, "ggx.f0": 0.3, "ggx.f90": 1.0}
    theta = [0.0, 0.5, 1.2]
    with jax.enable_x64(True):
        expected = model_albedo(Model("lambert + ggx"), values, np.cos(theta), nodes=64)
    for t, albedo in zip(theta, np.asarray(expected), strict=True):
        found = radiometry.reflected_radiance(
            lambda *angles: predict("lambert + ggx", values, *angles), 1.0, t, 0.3
        )
        assert found.converged
        np.testing.assert_allclose(found.value, albedo, rtol=1e-6)


def test_under_jit_and_grad():
    theta, a = 1.3, 0.5
    cone = radiometry.projected_solid_angle_of_cone
    with jax.enable_x64(True):
        for t, b in [(theta, a), (0.0, np.pi / 2), (np.pi / 2, 0.0)]:
            slopes = jax.grad(cone, argnums=(0, 1))(jnp.asarray(t), jnp.asarray(b))
            assert np.all(np.isfinite(slopes))
        slope = jax.jit(jax.grad(cone, argnums=1))(jnp.asarray(theta), jnp.asarray(a))
        step = (cone(theta, a + 1e-6) - cone(theta, a - 1e-6)) / 2e-6
        assert slope == pytest.approx(step, rel=1e-8)

        @jax.jit
        def e(n):
            return radiometry.irradiance(lambda t, p: jnp.cos(t) ** n, nodes=32).value

        n = jnp.asarray(3.0)
        assert e(n) == pytest.approx(2 * np.pi / 5, rel=1e-12)
        assert jax.grad(e)(n) == pytest.approx(-2 * np.pi / 25, rel=1e-9)
    assert cone(jnp.float32(theta), jnp.float32(a)).dtype == jnp.float32


def fresnel(c, ratio):
    """Unpolarised reflectance at the cosine c, from Snell's law; ratio is n_t / n_i."""
    s2 = (1 - c * c) / ratio**2
    ct = np.sqrt(np.maximum(1 - s2, 0))
    rs, rp = (c - ratio * ct) / (c + ratio * ct), (ratio * c - ct) / (ratio * c + ct)
    return np.where(s2 < 1, 0.5 * (rs**2 + rp**2), 1.0)


def unit(theta, phi):
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


def walter(wi, wo, alpha, eta):
    """Walter et al. 2007, eq. 21, with GGX; eta below the surface, 1 above."""
    n_i, n_o = (np.where(w[:, 2] > 0, 1.0, eta) for w in (wi, wo))
    h = -(n_i[:, None] * wi + n_o[:, None] * wo)
    h *= (np.sign(h[:, 2]) / np.linalg.norm(h, axis=1))[:, None]
    ih, oh = np.sum(wi * h, axis=1), np.sum(wo * h, axis=1)
    d = alpha**2 / (np.pi * (h[:, 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    seen = (ih * wi[:, 2] > 0) & (oh * wo[:, 2] > 0)
    g = seen.astype(float)
    for w in (wi, wo):
        g *= 2 / (1 + np.sqrt(1 + alpha**2 * (1 / w[:, 2] ** 2 - 1)))
    t = 1 - fresnel(np.abs(ih), n_o / n_i)
    jacobian = np.abs(ih * oh / (wi[:, 2] * wo[:, 2])) * n_o**2 / (n_i * ih + n_o * oh) ** 2
    return jacobian * t * g * d, n_i, n_o


def test_conventions_against_mitsuba():
    """Its rough glass in both transport modes; its value includes the cosine of ``wo``."""
    mi = pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    eta, alpha = 1.5, 0.4
    bsdf = mi.load_dict(
        {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha,
         "int_ior": eta, "ext_ior": 1.0}
    )  # fmt: skip
    rng = np.random.default_rng(0)
    # On both sides of the surface, either one lit.
    z = rng.uniform(0.1, 1.0, (2, 1000)) * np.where(rng.random(1000) < 0.5, 1, -1)
    pairs = unit(np.arccos(z * [[1], [-1]]), rng.uniform(0, 7, z.shape)).astype(np.float32)
    wi, wo = pairs = pairs.astype(np.float64)

    def theirs(mode, first, second):
        context, at = mi.BSDFContext(mode), mi.SurfaceInteraction3f()
        out = np.empty(len(first))
        for i in range(len(first)):
            at.wi = mi.Vector3f(*first[i].tolist())
            out[i] = bsdf.eval(context, at, mi.Vector3f(*second[i].tolist()))[0]
        return out / np.abs(second[:, 2])

    # From the camera, wo, to the light.
    radiance = theirs(mi.TransportMode.Radiance, wo, wi)
    importance = theirs(mi.TransportMode.Importance, wo, wi)
    if before:
        mi.set_variant(before)
    # Rounded to float32 they are no unit vectors.
    wi, wo = pairs / np.linalg.norm(pairs, axis=-1, keepdims=True)
    f, n_i, n_o = walter(wi, wo, alpha, eta)
    # Its float32 loses digits where hardly anything passes.
    lit = f > 1e-2
    assert lit.sum() > 150
    np.testing.assert_allclose(radiance[lit], f[lit], rtol=1e-4)
    convert = radiometry.bsdf_for_other_convention
    adjoint = convert(f, n_i, n_o, given="radiance", wanted="importance")
    np.testing.assert_allclose(importance[lit], adjoint[lit], rtol=1e-4)
    back = convert(adjoint, n_i, n_o, given="importance", wanted="radiance")
    np.testing.assert_allclose(back, f, rtol=1e-14)
    swapped, *_ = walter(wo, wi, alpha, eta)
    np.testing.assert_allclose(adjoint, swapped, rtol=1e-9)


def test_a_glass_interface_keeps_the_flux():
    """Nearly smooth: over wo the transmittance; uniform light inside is eta^2 as bright."""
    eta, alpha = 1.5, 0.03

    def into(theta, phi):
        """From 40 degrees above into the glass, by the angle from the lower normal."""
        wi = np.broadcast_to(unit(np.array([40 * DEG]), np.zeros(1)), (theta.size, 3))
        return walter(wi, unit(np.pi - theta, phi), alpha, eta)[0]

    transmitted = radiometry.radiant_exitance(into, tolerance=1e-6)
    smooth = 1 - fresnel(np.cos(40 * DEG), eta)
    assert transmitted.value == pytest.approx(smooth, rel=5e-3)

    def f(theta_i, phi_i, theta_r, phi_r):
        return walter(unit(theta_i, phi_i), unit(theta_r, phi_r), alpha, eta)[0]

    down = 170 * DEG
    inside = radiometry.reflected_radiance(f, 1.0, down, 0.0, tolerance=1e-5)
    outside = radiometry.basic_radiance(inside.value[0], eta)
    assert outside == pytest.approx(1 - fresnel(np.cos(10 * DEG), 1 / eta), rel=5e-3)
