"""Lobes that transmit, against published numbers, limits and closed forms."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.albedo import LEAVING, albedo_basis, model_albedo
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.models import lobe_class
from fitting.models.fresnel import dielectric, dielectric_terms
from fitting.models.slab import reflected_and_transmitted
from fitting.stress.variants import of_expression

CLEAR = {"reflected": 1.0, "transmitted": 1.0}


@pytest.fixture(autouse=True)
def double():
    with jax.enable_x64(True):
        yield


def parts(expression: str, mu: list[float], side: str, nodes: int = 48, **shape: float):
    """What is reflected and what is transmitted, each ``(len(mu),)``."""
    lobe = of_expression(expression).lobe
    ways = LEAVING[side]
    own = {n: jnp.asarray(v) for n, v in shape.items()}
    found = [
        jax.jit(lambda s, way=way: albedo_basis(lobe, s, mu, nodes=nodes, way=way))(own)
        for way in ways
    ]
    return [np.asarray(sum(f)) for f in found]


@pytest.mark.parametrize(
    ("alpha", "mu", "r", "t"),
    [
        (0.50364, 1.0, 0.028031, 0.939637),
        (0.50364, 0.5161, 0.041664, 0.843979),
        (1.0, 1.0, 0.012702, 0.880638),
    ],
)
def test_rough_glass_reflects_and_transmits_what_is_published(alpha, mu, r, t):
    """Of GGX with separable shadowing and index 1.5; Adobe's tables agree to 1e-3."""
    got = parts("rough_dielectric", [mu], "front", alpha=alpha, eta=1.5)
    np.testing.assert_allclose(got, [[r], [t]], atol=2e-5)


def test_rough_glass_from_inside():
    r, t = parts("rough_dielectric", [1.0], "back", nodes=96, alpha=0.50364, eta=1.5)
    np.testing.assert_allclose([*r, *t], [0.046056, 0.704963], atol=3e-4)


@pytest.mark.parametrize("side", ["front", "back"])
@pytest.mark.parametrize("expression", ["rough_dielectric", "rough_dielectric(beckmann)"])
def test_as_the_width_goes_to_zero_fresnels_law_is_left(expression, side):
    mu = [1.0, 0.95, 0.9]
    r, t = parts(expression, mu, side, nodes=64, alpha=1e-3, eta=1.5)
    index = jnp.asarray(1.5 if side == "front" else 1 / 1.5)
    f = np.asarray(dielectric(jnp.asarray(mu), index))
    np.testing.assert_allclose(r, f, rtol=1e-3)
    np.testing.assert_allclose(t, 1 - f, rtol=1e-4)


def test_all_light_is_reflected_beyond_the_critical_angle():
    mu = [0.7, 0.5]
    r, t = parts("rough_dielectric", mu, "back", nodes=64, alpha=1e-3, eta=1.5)
    np.testing.assert_allclose(r, 1.0, atol=3e-3)
    assert np.all(t < 1e-4)


def test_single_scattering_never_gains_light_and_loses_what_shadowing_takes():
    for side in ("front", "back"):
        for alpha in (0.05, 0.3, 1.0):
            r, t = parts("rough_dielectric", [0.2, 0.6, 1.0], side, alpha=alpha, eta=1.5)
            assert np.all(r + t <= 1.0 + 1e-3)
            assert np.all(r + t > 0.35)


@pytest.mark.parametrize("polarisation", ["kept", "mixed"])
def test_a_plate_is_the_sum_over_all_orders_of_reflection(polarisation):
    c, eta, depth = jnp.linspace(0.05, 1.0, 40), jnp.asarray(1.5), jnp.asarray(0.3)
    both = dielectric_terms(c, eta)
    inside = jnp.exp(-depth / both.cos_t)
    faces = [both.reflected_s, both.reflected_p]
    if polarisation == "mixed":
        faces = [both.reflected]
    r = t = 0.0
    for f in faces:
        bounce = f * inside
        t += (1 - f) ** 2 * inside * sum(bounce ** (2 * k) for k in range(60))
        r += f + (1 - f) ** 2 * inside * bounce * sum(bounce ** (2 * k) for k in range(60))
    got = reflected_and_transmitted(c, eta, depth, polarisation)
    np.testing.assert_allclose(got[0], r / len(faces), rtol=1e-12)
    np.testing.assert_allclose(got[1], t / len(faces), rtol=1e-12)


def test_a_plate_without_absorption_loses_nothing_and_has_the_known_closed_form():
    c, eta = jnp.linspace(0.0, 1.0, 101), jnp.asarray(1.7)
    for kind in ("kept", "mixed"):
        r, t = reflected_and_transmitted(c, eta, jnp.zeros(()), kind)
        np.testing.assert_allclose(r + t, 1.0, rtol=1e-12)
    f = dielectric(c, eta)
    np.testing.assert_allclose(r, 2 * f / (1 + f), rtol=1e-10)


def test_lossless_plates_balance_to_1e_6():
    """The smooth one reflects and transmits everything; the rough one what facets that
    reflect everything would, since both parts have one distribution."""
    mu = [0.6, 0.8, 1.0]
    r, t = parts(
        "smooth_slab", mu, "front", nodes=96, width=0.01, eta=1.5, optical_depth=0.0
    )
    np.testing.assert_allclose(r + t, 1.0, atol=1e-6)
    r, t = parts("thin_slab", mu, "front", alpha=0.3, eta=1.5, optical_depth=0.0)
    mirror = of_expression("ggx(uncorrelated)").lobe
    white = albedo_basis(mirror, {"alpha": jnp.asarray(0.3)}, mu, nodes=48)
    np.testing.assert_allclose(r + t, sum(white), atol=1e-6)


def test_a_narrow_plate_has_the_beams_of_a_smooth_one():
    mu = [0.5, 0.9, 1.0]
    own = {"eta": 1.5, "optical_depth": 0.2}
    exact = reflected_and_transmitted(
        jnp.asarray(mu), *(jnp.asarray(v) for v in own.values())
    )
    np.testing.assert_allclose(
        parts("smooth_slab", mu, "back", nodes=64, width=1e-3, **own), exact, rtol=1e-4
    )
    np.testing.assert_allclose(
        parts("thin_slab", mu, "front", nodes=64, alpha=1e-3, **own), exact, rtol=1e-4
    )


def test_lambert_transmits_its_transmittance_and_less_out_of_the_dense_side():
    model = Model("lambert_transmission(media)")
    values = {
        "lambert_transmission.eta": 1.5, "lambert_transmission.transmittance": 0.6,
    }  # fmt: skip
    there = model_albedo(model, values, [0.3, 1.0], ways=LEAVING["front"])
    back = model_albedo(model, values, [0.3, 1.0], ways=LEAVING["back"])
    np.testing.assert_allclose(there, 0.6, rtol=1e-6)
    np.testing.assert_allclose(back, 0.6 / 1.5**2, rtol=1e-6)


def test_a_lobe_turned_over_does_at_the_back_what_it_did_at_the_front():
    rng = np.random.default_rng(3)
    theta, phi = rng.uniform(0, np.pi, (2, 200)), rng.uniform(0, 7, (2, 200))
    for name in ("ggx", "rough_dielectric", "lambert_transmission"):
        lobe = lobe_class(name)()
        shape = {p.name: jnp.asarray(p.default) for p in lobe.parameters()}
        own = of_expression(f"{name}(back)").lobe
        here = lobe.basis(shape, from_angles(theta[0], phi[0], theta[1], phi[1]))
        g = from_angles(np.pi - theta[0], phi[0], np.pi - theta[1], phi[1])
        for a, b in zip(here, own.basis(shape, g), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-300)
        assert own.ways != lobe.ways or len(lobe.ways) != 1


def test_light_is_on_one_way_and_lobes_know_which():
    rng = np.random.default_rng(4)
    g = from_angles(*(rng.uniform(0, np.pi, 400) * k for k in (1, 2, 1, 2)))
    seen = sum(np.asarray(g.on((w,))).astype(int) for w in ("front", "back", "down", "up"))
    assert np.all(seen == 1)
    back = from_angles([2.0], [0.0], [2.5], [1.0])
    assert float(Model("lambert")({"lambert.albedo": 1.0}, back)[0]) == 0.0


@pytest.mark.parametrize(
    ("expression", "reciprocal"),
    [
        ("lambert + lambert_transmission + thin_slab", True),
        ("ggx + rough_dielectric", True),
        ("lambert_transmission + rough_dielectric", False),
        ("lambert_transmission(media) + rough_dielectric", False),
    ],
)
def test_lobes_between_other_media_do_not_make_a_reciprocal_sum(expression, reciprocal):
    assert Model(expression).reciprocal is reciprocal


@pytest.mark.slow
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_derivatives_of_the_transmitted_albedo_are_finite(precision):
    lobe = lobe_class("rough_dielectric")()
    mu = [0.0, 0.1, 0.5, 0.8, 1.0]

    def sums(shape):
        ways = ("down", "up")
        return jnp.stack(
            [albedo_basis(lobe, shape, mu, nodes=2, way=way)[1] for way in ways]
        )

    def both(shape):
        return jax.jacrev(sums)(shape), jax.jacfwd(sums)(shape)

    with jax.enable_x64(precision is np.float64):
        shape = {
            "alpha": jnp.asarray([0.01, 0.3], precision),
            "eta": jnp.asarray([1.5, 1.1], precision),
        }
        slopes = jax.jit(jax.vmap(both))(shape)
        assert all(np.all(np.isfinite(s)) for s in jax.tree.leaves(slopes))
