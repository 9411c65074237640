"""Approximations against textbook formulas and the errors that their authors state."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import erf

from fitting.albedo import albedo_basis
from fitting.models.eon import EON
from fitting.tradeoff import approximations
from fitting.tradeoff.evaluation_cost import directions


@pytest.fixture(autouse=True)
def double():
    with jax.enable_x64(True):
        yield


def test_schlick_meets_the_exact_at_both_ends():
    c = np.array([0.0, 1.0])
    found = np.asarray(approximations.schlick(jnp.asarray(c), jnp.asarray(1.5)))
    # 4 % of glass, and all of it at grazing.
    np.testing.assert_allclose(found, [1.0, 0.04], rtol=1e-14)


def test_beckmann_g1_is_walters():
    """Walter et al. 2007, eq. 26, with scipy's error function."""
    a = np.linspace(0.01, 5.0, 500)
    walter = 2.0 / (1.0 + erf(a) + np.exp(-(a**2)) / (a * math.sqrt(math.pi)))
    np.testing.assert_allclose(
        approximations.beckmann_g1(jnp.asarray(a)), walter, rtol=1e-13
    )


def test_rational_g1_has_the_error_that_walter_states():
    """Below 0.35 % (Walter et al. 2007, sec. 5.2); 3.13e-3 at 1.34, above 1 by 6.1e-5."""
    a = np.linspace(1e-3, 3.0, 20001)
    walter = 2.0 / (1.0 + erf(a) + np.exp(-(a**2)) / (a * math.sqrt(math.pi)))
    found = np.asarray(approximations.beckmann_g1_rational(jnp.asarray(a)))
    off = np.abs(found / walter - 1.0)
    assert off.max() < 0.0035
    assert off.max() == pytest.approx(3.13e-3, abs=5e-6)
    assert a[off.argmax()] == pytest.approx(1.34, abs=0.01)
    assert found.max() - 1.0 == pytest.approx(6.1e-5, abs=1e-6)


def test_eon_albedo_is_the_integral_of_the_lobe():
    mu = np.array([0.1, 0.3, 0.6, 0.95])
    integral = jax.jit(lambda r: albedo_basis(EON(), {"roughness": r}, mu, nodes=48)[0])
    for roughness in (0.2, 1.0):
        single = integral(jnp.asarray(roughness))
        found = approximations.eon_albedo(jnp.asarray(mu), jnp.asarray(roughness))
        np.testing.assert_allclose(found, single, rtol=1e-5)


def test_eon_polynomial_has_the_error_that_is_known():
    """4.7e-4 at most, at a roughness of 1."""
    mu = jnp.linspace(1e-3, 1.0, 5001)
    one = jnp.asarray(1.0)
    off = approximations.eon_albedo_polynomial(mu, one) - approximations.eon_albedo(mu, one)
    assert float(jnp.max(jnp.abs(off))) == pytest.approx(4.7e-4, abs=1e-5)


def test_eon_with_the_polynomial_is_eon_to_a_few_per_mille():
    g = jax.tree.map(jnp.asarray, directions(4000))
    shape = {"roughness": jnp.asarray(0.8)}
    exact, cheap = (
        approximations.eon_value(shape, g, jnp.asarray(0.6), exact=e) for e in (True, False)
    )
    off = np.abs(np.asarray(cheap / exact - 1.0))
    assert 1e-5 < off.max() < 3e-3
