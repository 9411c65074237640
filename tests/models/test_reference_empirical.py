"""Published values and closed forms of the empirical lobes and of simple diffuse bases."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from evaluation import albedos, directions, of, values

from fitting.models import fresnel, lobe_class
from fitting.models.interfaced_lambert import mean_transmittance, transmittance

# eta: mean internal reflectance of a smooth interface, 2 int F c dc from inside.
MEAN_INTERNAL = {
    1.33: 0.4719491488,
    1.5: 0.5963457597,
    1.8: 0.7327328548,
    2.0: 0.7901491593,
    2.5: 0.8754986518,
}


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


@pytest.mark.parametrize(
    ("exponent", "expected"),
    [
        (1.0, [1.0, 0.608998, 0.369903]),
        (10.0, [1.0, 0.504736, 0.179158]),
        (100.0, [1.0, 0.5, 0.108211]),
    ],
)
def test_phong_albedo(exponent: float, expected: list[float]):
    (found,) = albedos("phong", [1.0, 0.5, 0.1], 96, exponent=exponent)
    np.testing.assert_allclose(found, expected, atol=6e-7)


@pytest.mark.parametrize("exponent", [0.1, 1.0, 7.3, 1e4, 1e8])
def test_phong_is_normalised(exponent: float):
    (found,) = albedos("phong", [1.0], 64, exponent=exponent)
    # A small exponent has an infinite slope at the horizon.
    np.testing.assert_allclose(found, 1.0, rtol=1e-9 if exponent >= 1 else 1e-7)


@pytest.mark.parametrize("exponent", [0.3, 12.8, 377.0, 1e6])
def test_lafortune_is_phong_forwards_and_backwards(exponent: float):
    g = directions()
    phong, lafortune = (lobe_class(n)() for n in ("phong", "lafortune"))
    shape = values(exponent=exponent)
    for c_xy, geometry in ((-1.0, g), (1.0, g.turned)):
        (expected,) = phong.basis(shape, geometry)
        (found,) = lafortune.basis({**shape, "c_xy": jnp.asarray(c_xy)}, g)
        np.testing.assert_allclose(found, expected, rtol=1e-13 * (1 + exponent))


@pytest.mark.parametrize(("cx", "cz"), [(-0.6, 0.59), (-1.2, 0.8), (0.3, 1.1), (0.9, 0.2)])
def test_lafortune_in_the_normalisation_of_ngan(cx: float, cz: float):
    """``(n + 2) / (2 pi max(|cx|, |cz|)^n) (C wi.wo)^n`` with the paper's three numbers."""
    g, n = directions(), 12.8
    dot = cx * (g.wix * g.wox + g.wiy * g.woy) + cz * g.cos_i * g.cos_o
    plain = np.maximum(np.asarray(dot), 0.0) ** n
    expected = (n + 2) / (2 * np.pi * max(abs(cx), abs(cz)) ** n) * plain
    (found,) = of("lafortune", g, c_xy=cx / cz, exponent=n)
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-300)


@pytest.mark.parametrize("exponent", [0.1, 1.0, 25.4, 1030.0, 1e6])
def test_ashikhmin_shirley_at_normal_incidence(exponent: float):
    """With ``F = 1`` the albedo is one of powers of ``cos(theta_h)`` up to 45 deg."""
    n = exponent
    exact = 2 * (n + 1) / (n + 3) * (1 - 2 ** (-(n + 3) / 2)) - (1 - 2 ** (-(n + 1) / 2))
    found = sum(albedos("ashikhmin_shirley", [1.0], 64, exponent=n))
    np.testing.assert_allclose(found, exact, rtol=1e-9)


def test_round_ashikhmin_shirley_has_no_tangent():
    g = directions()
    both = of("ashikhmin_shirley", g, exponent=25.4)
    turned = of(
        "ashikhmin_shirley", g, {"anisotropic": True},
        exponent_u=25.4, exponent_v=25.4, angle=0.7,
    )  # fmt: skip
    np.testing.assert_allclose(turned, both, rtol=1e-12)


def test_ashikhmin_shirley_diffuse_albedo():
    mu = np.array([0.0, 0.1, 0.5, 1.0])
    (found,) = albedos("ashikhmin_shirley_diffuse", mu, 32)
    np.testing.assert_allclose(found, 1 - (1 - mu / 2) ** 5, rtol=1e-12)


@pytest.mark.parametrize("k", [0.8, 1.0, 1.5, 3.0])
def test_minnaert_albedo(k: float):
    """Where ``k`` is no integer the quadrature converges slowly at the horizon."""
    mu = np.array([0.05, 0.3, 1.0])
    (found,) = albedos("minnaert", mu, 400, k=k)
    np.testing.assert_allclose(found, mu ** (k - 1), rtol=2e-6)


@pytest.mark.parametrize(
    ("roughness", "expected"),
    [
        (0.0, {1.0: 0.976190, 0.01: 0.512017}),
        (1.0, {1.0: 1.035714, 0.5: 1.056904, 0.1: 1.380126, 0.01: 1.537952}),
    ],
)
def test_burley_albedo(roughness: float, expected: dict[float, float]):
    (found,) = albedos("burley", list(expected), 32, roughness=roughness)
    np.testing.assert_allclose(found, list(expected.values()), atol=1e-6)


def test_burley_exceeds_one_at_grazing_by_what_it_declares():
    bound = lobe_class("burley").ALBEDO_BOUND or 0.0
    (most,) = albedos("burley", [0.0], 32, roughness=1.0)
    assert 1.5575 < most[0] <= bound


@pytest.mark.parametrize(("eta", "internal"), MEAN_INTERNAL.items())
def test_mean_reflectance_from_inside(eta: float, internal: float):
    found = 1 - mean_transmittance(jnp.asarray(eta)) / eta**2
    assert abs(found - internal) < 6e-11


@pytest.mark.parametrize("eta", [1.01, 1.02, 1.1, 1.5, 4.0])
def test_mean_transmittance_by_many_nodes(eta: float):
    """Gauss and Legendre in ``c = s^4``, for the root of ``eta^2 - 1 + c^2`` next to 0."""
    x, w = np.polynomial.legendre.leggauss(800)
    s, ds = 0.5 * (x + 1), 0.5 * w
    t = 1 - np.asarray(fresnel.dielectric(jnp.asarray(s**4), jnp.asarray(eta)))
    exact = np.sum(2 * t * s**4 * 4 * s**3 * ds)
    assert abs(mean_transmittance(jnp.asarray(eta)) - exact) < 1e-12
    with jax.enable_x64(False):
        single = mean_transmittance(jnp.asarray(eta))
        assert single.dtype == jnp.float32
        assert abs(float(single) - exact) < 5e-7


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("eta", [1.01, 1.5, 2.5])
def test_interfaced_lambert_and_its_interface_share_the_light(eta: float, rho: float):
    """``F + rho (1 - F) (1 - K) / (1 - rho K)``, which is 1 for a white body."""
    mu = np.array([0.0, 0.05, 0.3, 1.0])
    (body,) = albedos("interfaced_lambert", mu, 96, eta=eta)
    lobe = lobe_class("interfaced_lambert")()
    (amplitude,) = lobe.amplitudes(values(eta=eta), (jnp.asarray(rho),))
    f = np.asarray(fresnel.dielectric(jnp.asarray(mu), jnp.asarray(eta)))
    k = 1 - float(mean_transmittance(jnp.asarray(eta))) / eta**2
    found = f + float(amplitude) * body
    np.testing.assert_allclose(
        found, f + rho * (1 - f) * (1 - k) / (1 - rho * k), atol=1e-6
    )
    if rho == 1.0:
        np.testing.assert_allclose(found, 1.0, atol=1e-6)


def test_transmittance_keeps_its_digits_at_grazing():
    found = transmittance(jnp.asarray([1e-12, 0.5, 1.0]), jnp.asarray(1.5))
    g = math.sqrt(1.25)
    slope = 2 / g * (1 + 1.5**2)
    rest = 1 - np.asarray(fresnel.dielectric(jnp.asarray([0.5, 1.0]), jnp.asarray(1.5)))
    np.testing.assert_allclose(found, [slope * 1e-12, *rest], rtol=1e-11)


def test_interfaced_lambert_amplitude_beyond_white():
    lobe = lobe_class("interfaced_lambert")()
    rho = jnp.asarray([0.0, 0.5, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 2.0, 100.0])
    for eta in (1.01, 1.5, 4.0):

        def amplitude(x, eta=eta):
            return lobe.amplitudes(values(eta=eta), (x,))[0]

        found = amplitude(rho)
        assert np.all(np.isfinite(found))
        assert np.all(np.diff(found) > 0)
        slope = jax.vmap(jax.grad(amplitude))(rho)
        np.testing.assert_allclose(slope[2], slope[4], rtol=1e-6)
        np.testing.assert_allclose(slope[5], slope[6], rtol=1e-12)
