"""Lobes of land surfaces and planets: numbers that others published, and exact limits."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import synthetic

from fitting import fit
from fitting.albedo import albedo_basis
from fitting.geometry import from_angles
from fitting.models import lobe_class

HAPKE = {"w": 0.5, "b": 0.3, "c": 0.5, "h": 0.06, "b0": 0.8, "theta_bar": 0.3}
RPV = {"k": 0.8, "g": -0.1, "rho_c": 0.3}


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


def at(name: str, ti, tr, phi, **shape: float) -> np.ndarray:
    """Basis functions ``(b, n)`` times pi, the reflectance factors."""
    geometry = jax.tree.map(jnp.asarray, from_angles(ti, 0.4, tr, 0.4 + np.asarray(phi)))
    own = {n: jnp.asarray(float(v)) for n, v in shape.items()}
    return np.pi * np.stack(lobe_class(name)().basis(own, geometry))


def some_pairs(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(8)
    return (*rng.uniform(0, 1.5, (2, count)), rng.uniform(0, 2 * np.pi, count))


@functools.cache
def compiled(name: str, nodes: int):
    lobe = lobe_class(name)()
    return jax.jit(lambda s, mu: jnp.stack(albedo_basis(lobe, s, mu, nodes=nodes)))


def albedos(name: str, mu, *, nodes: int = 64, **shape: float) -> np.ndarray:
    own = {n: jnp.asarray(float(v)) for n, v in shape.items()}
    return np.asarray(compiled(name, nodes)(own, jnp.asarray(mu)))


def test_kernels_at_a_published_geometry():
    found = at("rtls", [0.18430089], [1.46592582], [3.53273170])
    np.testing.assert_allclose(found[:, 0], [1, 0.1359144040, -6.0301291230], atol=6e-11)


def test_kernels_are_zero_at_the_normal():
    np.testing.assert_array_equal(at("rtls", [0.0], [0.0], [0.0])[1:], 0.0)


def test_kernels_by_their_printed_formulas():
    """Tangents, secants and arccos as in Lucht et al. 2000."""
    ti, to, phi = some_pairs(300)
    cos_xi = np.cos(ti) * np.cos(to) + np.sin(ti) * np.sin(to) * np.cos(phi)
    xi = np.arccos(np.clip(cos_xi, -1, 1))
    vol = ((np.pi / 2 - xi) * cos_xi + np.sin(xi)) / (np.cos(ti) + np.cos(to)) - np.pi / 4
    x, y = np.tan(ti), np.tan(to)
    d2 = x**2 + y**2 - 2 * x * y * np.cos(phi)
    both = 1 / np.cos(ti) + 1 / np.cos(to)
    cos_t = np.minimum(1, 2 * np.sqrt(d2 + (x * y * np.sin(phi)) ** 2) / both)
    t = np.arccos(cos_t)
    overlap = (t - np.sin(t) * cos_t) * both / np.pi
    geo = overlap - both + 0.5 * (1 + cos_xi) / (np.cos(ti) * np.cos(to))
    found = at("rtls", ti, to, phi)
    np.testing.assert_allclose(found[1], vol, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found[2], geo, rtol=1e-9, atol=1e-11)


def test_white_sky_integrals_of_the_land_products():
    """0.189184 and -1.377622 are the published ones, themselves of a numerical integral."""
    x, w = np.polynomial.legendre.leggauss(48)
    mu = (0.5 * (x + 1)) ** 2
    weight = 2 * w * mu * np.sqrt(mu)
    white = albedos("rtls", mu) @ weight
    np.testing.assert_allclose(white, [1, 0.189184, -1.377622], atol=5e-5)


def test_black_sky_integrals_of_the_kernels():
    found = albedos("rtls", np.cos(np.radians([0.0, 30.0, 60.0])), nodes=256)
    np.testing.assert_allclose(found[1], [-0.021079, 0.031952, 0.270482], atol=1e-6)
    np.testing.assert_allclose(found[2], [-1.288853, -1.325633, -1.425309], atol=4e-6)


def test_kernels_may_be_negative():
    assert not lobe_class("rtls").NONNEGATIVE
    assert lobe_class("rpv").NONNEGATIVE
    assert lobe_class("hapke").NONNEGATIVE


def test_rpv_without_its_effects_is_lambert():
    np.testing.assert_allclose(at("rpv", *some_pairs(50), k=1, g=0, rho_c=1), 1, rtol=1e-14)


@pytest.mark.parametrize("g", [-0.9, -0.3, 0.0, 0.4, 0.9])
def test_rpv_by_its_printed_formula(g: float):
    ti, to, phi = some_pairs(300)
    ci, co, x, y = np.cos(ti), np.cos(to), np.tan(ti), np.tan(to)
    cos_xi = ci * co + np.sin(ti) * np.sin(to) * np.cos(phi)
    distance = np.sqrt(x**2 + y**2 - 2 * x * y * np.cos(phi))
    expected = (ci * co * (ci + co)) ** (0.7 - 1)
    expected *= (1 - g**2) / (1 + g**2 + 2 * g * cos_xi) ** 1.5
    expected *= 1 + (1 - 0.2) / (1 + distance)
    found = at("rpv", ti, to, phi, k=0.7, g=g, rho_c=0.2)[0]
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_rpv_at_its_hot_spot_and_off_it():
    theta = np.array([0.0, 0.5, 1.2])
    hot, cold = (
        at("rpv", theta, theta, np.zeros(3), **{**RPV, "rho_c": c})[0] for c in (0.3, 1.0)
    )
    np.testing.assert_allclose(hot / cold, 1.7, rtol=1e-12)


def test_rpv_without_a_hot_spot_is_minnaert():
    """With g = 0 the bowl alone: its albedo at k = 1 is 1; below it grows at grazing."""
    mu = np.array([0.1, 0.5, 1.0])
    found = albedos("rpv", mu, nodes=128, k=0.5, g=0, rho_c=1)[0]
    x, w = np.polynomial.legendre.leggauss(200)
    m, weight = (0.5 * (x + 1)) ** 4, 2 * w * (0.5 * (x + 1)) ** 3
    for one, value in zip(mu, found, strict=True):
        exact = np.sum(2 * m * weight * (one * m * (one + m)) ** -0.5)
        np.testing.assert_allclose(value, exact, rtol=2e-5)


@pytest.mark.parametrize(
    ("theta_deg", "phi", "reff"),
    [(30.0, 0.0, 0.24746648), (80.0, 0.0, 0.19555340), (89.0, np.pi, 0.15426355)],
)
def test_hapke_reference_values(theta_deg: float, phi: float, reff: float):
    """Reference of the Eradiate radiative transfer model, in single precision there."""
    shape = {
        "w": 0.526, "b": 0.187, "c": 0.5 * (1 + 0.273), "h": 0.083, "b0": 1.0,
        "theta_bar": np.radians(13.3),
    }  # fmt: skip
    found = at("hapke", np.radians([30.0]), np.radians([theta_deg]), [phi], **shape)
    np.testing.assert_allclose(found, reff, atol=1e-7)


def test_hapke_of_a_smooth_dark_surface_is_lommel_seeliger():
    """w / (4 pi) / (cos_i + cos_o), for w -> 0 without phase function or opposition."""
    ti, to, phi = some_pairs(100)
    shape = {**HAPKE, "w": 1e-6, "b": 0, "b0": 0, "theta_bar": 0.002}
    found = at("hapke", ti, to, phi, **shape)[0]
    exact = 0.25e-6 / (np.cos(ti) + np.cos(to))
    np.testing.assert_allclose(found, exact, rtol=1e-4)


def test_hapke_opposition_doubles_the_single_scattering():
    """At zero phase 1 + b0, away from it 1 + b0 / (1 + tan(xi / 2) / h)."""
    shape = {**HAPKE, "w": 1e-6, "b0": 1.0, "h": 0.1}
    ti = np.array([0.3, 0.3])
    to = np.array([0.3, 0.9])
    with_it = at("hapke", ti, to, np.zeros(2), **shape)[0]
    without = at("hapke", ti, to, np.zeros(2), **{**shape, "b0": 0.0})[0]
    expected = [2.0, 1 + 1 / (1 + np.tan(0.3) / 0.1)]
    np.testing.assert_allclose(with_it / without, expected, rtol=1e-5)


@pytest.mark.parametrize("theta_bar", [0.002, 0.3, 1.0])
def test_hapke_is_reciprocal_and_crosses_its_cases_smoothly(theta_bar: float):
    """The formulas for i < e and i > e meet at i = e."""
    shape = {**HAPKE, "theta_bar": theta_bar}
    phi = np.linspace(0, np.pi, 7)
    theta = np.full(7, 1.1)
    below, above = (
        at("hapke", theta, theta + step, phi, **shape) for step in (-1e-9, 1e-9)
    )
    np.testing.assert_allclose(below, above, rtol=1e-7)
    there, back = (
        at("hapke", *a, phi, **shape) for a in ((theta, 0.4 * theta), (0.4 * theta, theta))
    )
    np.testing.assert_allclose(there, back, rtol=1e-13)


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("rtls", {}),
        ("rpv", RPV),
        ("rpv", {"k": 0.5, "g": -0.5, "rho_c": 0.0}),
        ("hapke", HAPKE),
        ("hapke", {**HAPKE, "w": 0.9999, "theta_bar": 0.002, "h": 1e-3}),
    ],
)
def test_error_of_the_quadrature(name: str, shape: dict[str, float]):
    mu = [0.02, 0.1, 0.3, 0.6, 1.0]
    few, most = (albedos(name, mu, nodes=n, **shape) for n in (16, 128))
    np.testing.assert_allclose(few, most, atol=5e-3 * np.max(np.abs(most)))


def test_the_kernels_of_modis_are_fitted_in_one_step():
    """Linear in all three coefficients: normal equations, and nothing to search for."""
    truth = {"rtls.f_iso": 0.3, "rtls.f_vol": 0.1, "rtls.f_geo": 0.02}
    result = fit(
        synthetic.measurement("rtls", truth), "rtls", objective="l2", cross_validate=False
    )
    assert result.solver.steps == 1
    for name, value in truth.items():
        np.testing.assert_allclose(result.parameter(name).value, value, rtol=1e-9)
