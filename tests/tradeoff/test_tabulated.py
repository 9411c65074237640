"""A table of a model: its coordinates, its limit, and how fast it comes near."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting import Model
from fitting.geometry import from_angles
from fitting.predict import predict_geometry
from fitting.tradeoff.evaluation_cost import directions
from fitting.tradeoff.tabulated import BrdfTable, half_and_difference, table_of
from fitting.tradeoff.trade import NotPossible

RNG = np.random.default_rng(5)


class Fitted:
    """What `table_of` takes of a result."""

    def __init__(self, model: str, **values: float):
        self.model = model
        self.values = {n.replace("_", ".", 1): np.asarray(v) for n, v in values.items()}


def test_angles_are_rusinkiewiczs():
    """By rotating the source: around z by -phi_h, then around y by -theta_h."""
    ti, tr = np.arccos(RNG.uniform(0.02, 1.0, (2, 200)))
    pi, pr = RNG.uniform(0, 2 * np.pi, (2, 200))
    wi, wo = (
        np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
        for t, p in ((ti, pi), (tr, pr))
    )
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=0)
    theta_h, phi_h = np.arccos(h[2]), np.arctan2(h[1], h[0])
    x = np.cos(phi_h) * wi[0] + np.sin(phi_h) * wi[1]
    y = -np.sin(phi_h) * wi[0] + np.cos(phi_h) * wi[1]
    dx = np.cos(theta_h) * x - np.sin(theta_h) * wi[2]
    dz = np.sin(theta_h) * x + np.cos(theta_h) * wi[2]
    phi_d = np.mod(np.arctan2(y, dx), np.pi)
    expected = theta_h, np.arccos(np.clip(dz, -1, 1)), np.minimum(phi_d, np.pi - phi_d)
    with jax.enable_x64(True):
        g = jax.tree.map(jnp.asarray, from_angles(ti, pi, tr, pr))
        found = half_and_difference(g)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-7)


def test_a_constant_is_exact():
    table = table_of(Fitted("lambert", lambert_albedo=0.3), (5, 4, 3))
    g = jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), directions(500))
    np.testing.assert_allclose(table(g), 0.3 / math.pi, rtol=1e-6)
    assert table.bytes == 5 * 4 * 3 * 4


def test_twice_as_fine_is_four_times_as_near():
    """Linear interpolation is of second order."""
    of = Fitted("lambert + ggx", lambert_albedo=0.3, ggx_alpha=0.5, ggx_f0=0.1, ggx_f90=1.0)
    theta_i, theta_r = np.radians(RNG.uniform(0.0, 55.0, (2, 2000)))
    g = from_angles(theta_i, 0.0, theta_r, RNG.uniform(0, 2 * np.pi, 2000))
    exact = predict_geometry(Model(of.model), of.values, g).reshape(-1)
    single = jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), g)
    off = []
    for n in (12, 24):
        table: BrdfTable = table_of(of, (n + 1, n + 1, n + 1))
        off.append(np.median(np.abs(np.asarray(table(single))[:, 0] / exact - 1.0)))
    assert 3.0 < off[0] / off[1] < 5.5
    assert off[1] < 3e-3


@pytest.mark.parametrize("model", ["ggx(aniso)", "lambert_transmission", "openpbr"])
def test_what_a_table_cannot_hold(model):
    with pytest.raises(NotPossible, match="isotropic, reciprocal"):
        table_of(Fitted(model), (4, 4, 4))
