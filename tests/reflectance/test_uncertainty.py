"""Propagated uncertainties, against draws of the parameters."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import msgspec
import numpy as np
import pytest

from fitting.reflectance import (
    Directional,
    Hemispherical,
    named,
    quantity,
    rule_and_quantity,
    surface_of,
)
from fitting.reflectance.luminous import colour_of_factors
from fitting.reflectance.surface import Covariance, covariance_of

VALUES = {
    "lambert.albedo": np.array([0.1, 0.2, 0.3, 0.35, 0.4]),
    "ggx.f0": np.full(5, 0.05),
    "ggx.f90": np.ones(5),
    "ggx.alpha": np.array(0.2),
}
NAMES = ("ggx.alpha", "lambert.albedo", "ggx.f0")


def drawn(rng: np.random.Generator, n: int) -> tuple[Covariance, dict[str, np.ndarray]]:
    """A covariance with a shared alpha, and parameters drawn from it."""
    b = np.array([[-0.4], [0.15]])
    s_u, s_c = 0.01**2, np.diag([2e-3, 1e-3]) ** 2 + 1e-6 * 0.3
    matrix = np.zeros((3, 3))
    matrix[0, 0] = s_u
    matrix[1:, :1] = b * s_u
    matrix[:1, 1:] = (b * s_u).T
    matrix[1:, 1:] = s_c + b @ b.T * s_u
    u = rng.normal(0, np.sqrt(s_u), n)
    x = rng.multivariate_normal([0, 0], s_c, (n, 5)) + u[:, None, None] * b[:, 0]
    follow = {name: np.zeros((5, 3)) for name in VALUES}
    for k, name in enumerate(NAMES):
        follow[name][:, k] = 1.0
    draws = {"ggx.alpha": 0.2 + u, "lambert.albedo": VALUES["lambert.albedo"] + x[..., 0],
             "ggx.f0": 0.05 + x[..., 1]}  # fmt: skip
    return Covariance(NAMES, 1, np.tile(matrix, (5, 1, 1)), follow, ()), draws


def test_monte_carlo():
    rng = np.random.default_rng(4)
    covariance, draws = drawn(rng, 400)
    at = [450.0, 500.0, 550.0, 600.0, 650.0]
    plain = surface_of("lambert + ggx", VALUES, wavelengths_nm=at)
    surface = dataclasses.replace(plain, covariance=covariance)
    rule, found = rule_and_quantity(
        surface, Directional(8.0), Hemispherical(), tolerance=1e-3
    )
    with jax.enable_x64(True):
        own = {n: jnp.asarray(v) for n, v in VALUES.items()}
        several = {n: jnp.asarray(v) for n, v in draws.items()}
        spectra = jax.lax.map(lambda d: rule(own | d), several, batch_size=20)
    spectra = np.asarray(spectra)
    sampled = np.cov(spectra.T)
    assert found.standard_uncertainty is not None
    np.testing.assert_allclose(
        found.standard_uncertainty, np.sqrt(np.diag(sampled)), rtol=0.15
    )
    np.testing.assert_allclose(np.asarray(found.covariance), sampled, rtol=0.3, atol=3e-7)

    colour = colour_of_factors(
        found.channels, at, found.factor, np.asarray(found.covariance)
    )
    assert colour is not None
    assert colour.luminous_reflectance_uncertainty is not None
    colours = [colour_of_factors(found.channels, at, s, None) for s in spectra[:200]]
    y = [c.luminous_reflectance for c in colours if c is not None]
    assert colour.luminous_reflectance_uncertainty == pytest.approx(np.std(y), rel=0.2)


def test_of_a_fit(fitted):
    truth, result, _ = fitted
    covariance = covariance_of(result)
    assert covariance is not None
    assert covariance.shared == 1
    for name in ("8/d", "45/0", "white-sky"):
        g = named(name)
        found = quantity(result, g.incident, g.collected)
        exact = quantity(surface_of("lambert + ggx", truth), g.incident, g.collected)
        assert found.standard_uncertainty is not None
        for k in range(2):
            sd = found.standard_uncertainty[k]
            assert 0 < sd < 0.02 * found.value[k]
            assert abs(found.value[k] - exact.value[k]) < 4 * sd


def test_fixed_parameters_have_none(fitted):
    _, result, _ = fitted
    fixed = [msgspec.structs.replace(p, standard_uncertainty=[None] * len(p.value))
             for p in result.parameters]  # fmt: skip
    bare = msgspec.structs.replace(result, parameters=fixed)
    found = quantity(bare, Directional(0.0), Directional(45.0))
    assert found.standard_uncertainty is None
