"""Values that others published, or that closed forms and 20-digit quadrature give."""

from __future__ import annotations

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import Case

from fitting.albedo import albedo_basis
from fitting.geometry import from_angles
from fitting.models import fresnel, lobe_class, ndf, shadowing

# Blender Cycles, height-correlated GGX, F = 1: average albedo at alpha = (i / 31)^2.
CYCLES_MEAN = """
1.000000 0.999992 0.999897 0.999548 0.998729 0.997199 0.994703 0.990986
0.985805 0.978930 0.970160 0.959321 0.946279 0.930937 0.913247 0.893209
0.870874 0.846345 0.819774 0.791360 0.761345 0.730001 0.697631 0.664547
0.631068 0.597509 0.564165 0.531311 0.499191 0.468013 0.437950 0.409137
"""
# The same table by direction, (j, i): mu = j / 31, alpha = (i / 31)^2.
CYCLES_DIRECTIONAL = {
    (16, 16): 0.847421,
    (31, 16): 0.903873,
    (31, 31): 0.306853,
    (24, 28): 0.455949,
    (8, 24): 0.727744,
    (4, 20): 0.852774,
}
# alpha: albedo with F = 1 at mu = 0.05, 0.1, 0.25, 0.5, 0.75, 1; average.
MU = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
GGX_TABLE = {
    0.10: "0.9117625 0.8834550 0.9216232 0.9692050 0.9831444 0.9883041 0.972046",
    0.25: "0.9331317 0.8916224 0.8400819 0.8572634 0.8915329 0.9158124 0.882323",
    0.50: "0.9125478 0.8601051 0.7652033 0.6982507 0.6820832 0.6878485 0.700240",
    0.75: "0.8806096 0.8107141 0.6802478 0.5646232 0.5014111 0.4639165 0.536303",
    1.00: "0.8477739 0.7602105 0.5976405 0.4506939 0.3645266 0.3068528 0.409137",
}
BECKMANN_TABLE = {
    0.10: "0.9293770 0.9129114 0.9719958 0.9998465 1.0000000 1.0000000 0.995261",
    0.25: "0.9620889 0.9351183 0.9051608 0.9465501 0.9907299 0.9999910 0.971153",
    0.50: "0.9759855 0.9550277 0.9074229 0.8693603 0.8801187 0.9429984 0.893416",
    1.00: "0.9760638 0.9527950 0.8848279 0.7665678 0.6240628 0.4615881 0.663678",
}
# eta: F at 0, 45, 60, 75, 85 deg; averages from outside and from inside.
FRESNEL_TABLE = {
    1.33: "0.0200593122 0.0275213836 0.0591255993 0.2114266041 0.5827282449"
    " 0.0659308493 0.4719491488",
    1.5: "0.04 0.0502399110 0.0891867128 0.2530605630 0.6127996453"
    " 0.0917779593 0.5963457597",
    1.8: "0.0816326531 0.0935231208 0.1346432966 0.2928474867 0.6293968646"
    " 0.1340544494 0.7327328548",
    2.0: "0.1111111111 0.1226507601 0.1613765956 0.3086509920 0.6301540130"
    " 0.1605966371 0.7901491593",
    2.5: "0.1836734694 0.1922250926 0.2204573846 0.3339202183 0.6192200947"
    " 0.2218665735 0.8754986518",
}


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


def numbers(text: str) -> np.ndarray:
    return np.array(text.split(), dtype=np.float64)


@functools.cache
def compiled(name: str, nodes: int):
    lobe = lobe_class(name)()
    return jax.jit(lambda shape, mu: albedo_basis(lobe, shape, mu, nodes=nodes))


def albedos(name: str, cos_theta, *, nodes: int = 16, **shape: float) -> list[np.ndarray]:
    """Directional albedo of each basis function."""
    values = {n: jnp.asarray(v) for n, v in shape.items()}
    return [np.asarray(e) for e in compiled(name, nodes)(values, jnp.asarray(cos_theta))]


def white(name: str, cos_theta, *, nodes: int = 16, **shape: float) -> np.ndarray:
    """Directional albedo with all amplitudes 1, that is F = 1."""
    return sum(albedos(name, cos_theta, nodes=nodes, **shape), np.zeros(len(cos_theta)))


def half_range(count: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1), 0.5 * w


def mean(name: str, *, nodes: int, count: int = 24, **shape: float) -> float:
    """``2 int E mu dmu``, with nodes that crowd towards grazing: mu = x^2."""
    x, w = half_range(count)
    return float(np.sum(4 * w * x**3 * white(name, x**2, nodes=nodes, **shape)))


def test_ggx_at_normal_incidence_is_one_minus_log_two():
    exact = 1 - math.log(2)
    np.testing.assert_allclose(white("ggx", [1.0], nodes=32, alpha=1.0), exact, rtol=1e-13)


@pytest.mark.parametrize(
    ("alpha", "value", "nodes"),
    [
        (0.5, 0.68784851511, 32),
        (0.25, 0.91581243025, 32),
        (0.1, 0.98830405652, 64),
        (0.03, 0.99905781580, 256),
        (0.01, 0.99989855641, 512),
        (0.001, 0.999998998649, 64),
    ],
)
def test_ggx_at_normal_incidence(alpha: float, value: float, nodes: int):
    np.testing.assert_allclose(
        white("ggx", [1.0], nodes=nodes, alpha=alpha), value, rtol=2e-9
    )


@pytest.mark.parametrize("i", [4, 6, 8, 12, 16, 20, 24, 28, 31])
def test_ggx_mean_albedo_of_cycles(i: int):
    found = mean("ggx", nodes=48 if i > 10 else 128, alpha=(i / 31) ** 2)
    assert abs(found - numbers(CYCLES_MEAN)[i]) < 2e-6


@pytest.mark.parametrize(("j", "i"), CYCLES_DIRECTIONAL)
def test_ggx_directional_albedo_of_cycles(j: int, i: int):
    found = white("ggx", [j / 31], nodes=48, alpha=(i / 31) ** 2)
    assert abs(found[0] - CYCLES_DIRECTIONAL[j, i]) < 2e-6


@pytest.mark.parametrize(
    ("name", "alpha", "table"),
    [("ggx", a, t) for a, t in GGX_TABLE.items()]
    + [("beckmann", a, t) for a, t in BECKMANN_TABLE.items()],
)
def test_microfacet_albedos(name: str, alpha: float, table: str):
    """The table's own quadrature error is 1e-6 at alpha = 0.1, and else in no digit."""
    *directional, average = numbers(table)
    last_digit = 1.5e-6 if alpha == 0.1 else 1e-7
    found = white(name, MU, nodes=192, alpha=alpha)
    np.testing.assert_allclose(found, directional, atol=last_digit)
    assert abs(mean(name, nodes=64, alpha=alpha) - average) < 2e-6


@pytest.mark.parametrize(
    ("alpha", "mu", "a", "b"),
    [
        (0.25, 1.0, 0.915785, 0.000027),
        (0.25, 0.5, 0.834916, 0.022347),
        (0.25, 0.1, 0.751930, 0.139692),
        (0.5, 0.5, 0.688101, 0.010150),
        (0.5, 0.1, 0.798685, 0.061420),
        (1.0, 0.5, 0.447705, 0.002989),
    ],
)
def test_ggx_schlick_split(alpha: float, mu: float, a: float, b: float):
    found = np.ravel(albedos("ggx", [mu], nodes=96, alpha=alpha))
    np.testing.assert_allclose(found, [a, b], atol=6e-7)


def test_beckmann_values_of_mitsuba():
    """Computed by Mitsuba 0.6 in single precision, with 1e-6 in the exponential."""
    alpha = 0.1
    theta = np.array([0.0, np.pi / 19, 2 * np.pi / 19, 0.1])
    h2 = jnp.asarray((np.sin(theta) / alpha) ** 2)
    found = ndf.beckmann(h2, jnp.asarray(np.cos(theta)), jnp.asarray(alpha**2))
    expected = [31.8309879, 2.07673073, 3.02855828e-4, 11.86709118]
    np.testing.assert_allclose(found, expected, rtol=1.5e-6)


def monodirectional(cos_lambda, alpha: float, theta: np.ndarray) -> np.ndarray:
    """``G1 = 1 / (1 + Lambda)``."""
    c, t2 = np.cos(theta), (alpha * np.sin(theta)) ** 2
    return c / (c + np.asarray(cos_lambda(jnp.asarray(t2), jnp.asarray(c))))


def test_shadowing_of_mitsuba():
    """Mitsuba takes the rational approximation of Beckmann's G1, good to 3.5e-3.

    Its table for GGX is in single precision, with 4e-6 at 88 deg.
    """
    steep = np.array([0.98 * np.pi / 2])
    beckmann = monodirectional(shadowing.cos_lambda_beckmann, 0.1, steep)
    np.testing.assert_allclose(beckmann, 0.67333597, rtol=3.5e-3)
    ggx = monodirectional(shadowing.cos_lambda_ggx, 0.1, steep)
    np.testing.assert_allclose(ggx, 0.46130955, rtol=1e-6)
    table = """
    0.99261039 0.99160647 0.99042398 0.98901933 0.98733366 0.98528832 0.98277503 0.97964239
    0.97567332 0.97054905 0.96378750 0.95463598 0.94187391 0.92344058 0.89569420 0.85189372
    0.77902949 0.65144652 0.41989169
    """
    theta = np.linspace(np.pi / 3, np.pi / 2, 20)[:-1]
    found = monodirectional(shadowing.cos_lambda_ggx, 0.1, theta)
    np.testing.assert_allclose(found, numbers(table), rtol=5e-6)


@pytest.mark.parametrize("eta", FRESNEL_TABLE)
def test_dielectric_reflectance(eta: float):
    *directional, outside, inside = numbers(FRESNEL_TABLE[eta])
    cosine = jnp.asarray(np.cos(np.radians([0.0, 45.0, 60.0, 75.0, 85.0])))
    index = jnp.asarray(eta)
    np.testing.assert_allclose(fresnel.dielectric(cosine, index), directional, atol=6e-11)

    x, w = half_range(100)
    average = 2 * np.sum(w * x * np.asarray(fresnel.dielectric(jnp.asarray(x), index)))
    assert abs(average - outside) < 1e-9
    # Seen from inside all is reflected below the critical cosine; c = sqrt(c0^2 + x^2).
    c0 = np.sqrt(1 - eta**-2)
    c, dc = np.sqrt(c0**2 + (x / eta) ** 2), x / eta**2
    internal = np.asarray(fresnel.dielectric(jnp.asarray(c), 1 / index))
    assert abs(c0**2 + 2 * np.sum(w * dc * internal) - inside) < 1e-9
    assert abs(1 - (1 - outside) / eta**2 - inside) < 1e-9


def test_dielectric_amplitudes_of_mitsuba():
    """Mitsuba prints amplitudes ``rs, rp``; the reflectance is their mean square."""
    brewster = math.radians(56.3099)
    for theta, eta, rs, rp in [
        (math.radians(45), 1.5, 0.3033370452904235, 0.0920133630455244),
        (math.radians(10), 1 / 1.5, 0.2094943196385201, 0.1904679719777941),
        (brewster, 1.5, 0.3846150939598947, 0.0),
    ]:
        found = fresnel.dielectric(jnp.asarray(math.cos(theta)), jnp.asarray(eta))
        assert abs(float(found) - 0.5 * (rs**2 + rp**2)) < 1e-7
    total = fresnel.dielectric(
        jnp.asarray(math.cos(math.radians(45))), jnp.asarray(1 / 1.5)
    )
    assert float(total) == 1.0


def test_dielectric_derivatives_inside_total_reflection():
    slope = jax.vmap(jax.grad(fresnel.dielectric, argnums=(0, 1)), in_axes=(0, None))
    cosine = jnp.asarray([0.0, 1e-3, 0.3, 0.7, 1.0])
    for eta in (1 / 1.5, 1.0001, 1.01, 4.0):
        for derivative in slope(cosine, jnp.asarray(eta)):
            assert np.all(np.isfinite(derivative))


@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.5])
def test_ward_albedo_at_normal_incidence(alpha: float):
    exact = 1 - alpha**2 + alpha**2 * math.exp(-1 / alpha**2)
    np.testing.assert_allclose(
        white("ward", [1.0], nodes=48, alpha=alpha), exact, rtol=1e-12
    )


@pytest.mark.parametrize(
    ("alpha", "expected"),
    [
        (0.1, [0.985986, 0.973957, 0.913218, 0.818825]),
        (0.25, [0.909791, 0.855967, 0.794092, 0.802855]),
        (0.5, [0.720582, 0.708255, 0.737303, 0.813205]),
    ],
)
def test_ward_albedo(alpha: float, expected: list[float]):
    found = white("ward", [0.75, 0.5, 0.25, 0.1], nodes=128, alpha=alpha)
    np.testing.assert_allclose(found, expected, atol=6e-7)


@pytest.mark.parametrize(
    ("exponent", "expected"),
    [
        (1.0, [1.0, 0.818948, 0.639187]),
        (10.0, [1.0, 0.400324, 0.140611]),
        (100.0, [1.0, 0.265058, 0.027614]),
    ],
)
def test_blinn_phong_albedo(exponent: float, expected: list[float]):
    found = white("blinn_phong", [1.0, 0.5, 0.1], nodes=96, exponent=exponent)
    np.testing.assert_allclose(found, expected, atol=6e-7)


@pytest.mark.parametrize("exponent", [0.1, 1.0, 7.3, 50.0, 1e4, 1e8])
def test_blinn_phong_is_normalised(exponent: float):
    found = white("blinn_phong", [1.0], nodes=64, exponent=exponent)
    np.testing.assert_allclose(found, 1.0, rtol=1e-9)


@pytest.mark.parametrize("roughness", [0.0, 0.5, 1.0])
def test_eon_loses_no_energy(roughness: float):
    mu = [0.02, 0.1, 0.25, 0.5, 0.75, 1.0]
    np.testing.assert_allclose(white("eon", mu, roughness=roughness), 1.0, rtol=1e-7)


@pytest.mark.parametrize(
    ("roughness", "expected"),
    [
        (
            1.0,
            "0.7765220670 0.8078554251 0.8653195483 0.9333857918 0.9743067508 0.8328107636",
        ),
        (
            0.5,
            "0.8742048089 0.8918422808 0.9241886975 0.9625030224 0.9855373318 0.9058895808",
        ),
    ],
)
def test_eon_single_scattering_albedo(roughness: float, expected: str):
    *directional, average = numbers(expected)
    found = albedos("eon", [1, 0.75, 0.5, 0.25, 0.1], nodes=32, roughness=roughness)[0]
    np.testing.assert_allclose(found, directional, atol=1e-9)
    x, w = half_range(32)
    theta = 0.5 * np.pi * x
    single = albedos("eon", np.cos(theta), nodes=32, roughness=roughness)[0]
    assert abs(np.sum(0.5 * np.pi * w * np.sin(2 * theta) * single) - average) < 1e-9


@pytest.mark.parametrize(
    ("rho", "roughness", "expected"),
    [
        (0.8, 1.0, [0.75872262, 0.77512392, 0.79525434]),
        (0.5, 0.5, [0.46699830, 0.48011131, 0.49620580]),
    ],
)
def test_eon_total_albedo(rho: float, roughness: float, expected: list[float]):
    basis = albedos("eon", [1.0, 0.5, 0.1], nodes=32, roughness=roughness)
    amplitudes = lobe_class("eon")().amplitudes(
        {"roughness": jnp.asarray(roughness)}, (jnp.asarray(rho),)
    )
    total = sum(a * e for a, e in zip(amplitudes, basis, strict=True))
    np.testing.assert_allclose(total, expected, atol=1e-8)


def test_smooth_eon_is_lambert():
    geometry = from_angles([0.3, 1.0], 0.0, [1.2, 0.4], 2.0)
    single, multiple = lobe_class("eon")().basis({"roughness": jnp.asarray(0.0)}, geometry)
    np.testing.assert_allclose(single, 1 / np.pi, rtol=1e-15)
    np.testing.assert_array_equal(multiple, 0.0)


@pytest.mark.parametrize(
    ("sigma", "expected"),
    [
        (0.3, [0.892857, 0.933518, 0.959936, 0.984539, 0.997673]),
        (1.0, [0.624060, 0.698666, 0.747141, 0.792284, 0.816384]),
    ],
)
def test_oren_nayar_albedo(sigma: float, expected: list[float]):
    found = white("oren_nayar", [1.0, 0.75, 0.5, 0.25, 0.1], nodes=32, sigma=sigma)
    np.testing.assert_allclose(found, expected, atol=1.5e-6)
    assert abs(found[0] - (1 - 0.5 * sigma**2 / (sigma**2 + 0.33))) < 1e-5


def test_oren_nayar_exceeds_one_at_grazing_by_what_it_declares():
    bound = lobe_class("oren_nayar").ALBEDO_BOUND or 0.0
    sigma = np.linspace(0.05, 0.4, 36)
    most = max(float(white("oren_nayar", [0.0], sigma=s)[0]) for s in sigma)
    assert 1.015 < most <= bound


@pytest.mark.slow
@pytest.mark.usefixtures("compiled_to_run_long")
@pytest.mark.parametrize("name", ["ggx", "beckmann", "ward"])
def test_declared_error_of_the_quadrature(name: str):
    """Against many more nodes, for elongated lobes across and along the plane."""
    lobe = Case(name, (("anisotropic", True),)).lobe
    mu = [0.02, 0.1, 0.3, 0.6, 0.9, 1.0]

    def total(shape, azimuth, count):
        each = albedo_basis(lobe, shape, mu, azimuth=azimuth, nodes=count)
        return sum(each[1:], each[0])

    total = jax.jit(total, static_argnums=2)
    for alpha_x in (1e-3, 0.02, 0.1, 0.3, 1.5):
        for alpha_y in (1e-4, 0.05, 0.2, 0.7, 1.5):
            shape = {"alpha_x": alpha_x, "alpha_y": alpha_y, "angle": 0.4}
            for azimuth in (0.0, 1.0):
                exact = total(shape, azimuth, 200)
                for nodes, error in ((8, 1.3e-2), (16, 2e-3), (32, 5e-4)):
                    found = total(shape, azimuth, nodes)
                    np.testing.assert_allclose(found, exact, atol=error)


def test_diffuse_albedo_with_few_nodes():
    mu = [0.0, 0.02, 0.3, 0.7, 1.0]
    few, many = (white("oren_nayar", mu, nodes=n, sigma=0.7) for n in (16, 128))
    np.testing.assert_allclose(few, many, atol=1e-6)
    few, many = (white("eon", mu, nodes=n, roughness=1.0) for n in (16, 128))
    np.testing.assert_allclose(few, many, atol=1e-6)
