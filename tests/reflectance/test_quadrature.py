"""The quadrature itself: other quadratures, its error bound, and its derivatives."""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import dblquad
from test_nine import clear, value

from fitting.models import lobe_names
from fitting.predict import predict
from fitting.reflectance import (
    Conical,
    Directional,
    Hemispherical,
    Surface,
    quantity,
    rule_and_quantity,
    surface_of,
)

WHOLE = Hemispherical()


def brute_force(
    surface: Surface, light: tuple[float, float], axis: tuple, half_angle: float
) -> float:
    """Over a cone in polar coordinates around its axis, by scipy; angles in rad."""
    t, p = axis
    c = np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])
    e1 = np.array([math.cos(t) * math.cos(p), math.cos(t) * math.sin(p), -math.sin(t)])
    e2 = np.cross(c, e1)
    x, w = np.polynomial.legendre.leggauss(200)
    angle = 0.5 * half_angle * (x + 1)
    turn = 2 * np.pi * (np.arange(400) + 0.5) / 400
    a, b = (v.ravel() for v in np.meshgrid(angle, turn, indexing="ij"))
    d = (np.outer(np.cos(a), c) + (np.sin(a) * np.cos(b))[:, None] * e1
         + (np.sin(a) * np.sin(b))[:, None] * e2)  # fmt: skip
    theta, phi = np.arccos(np.clip(d[:, 2], -1, 1)), np.arctan2(d[:, 1], d[:, 0])
    f = predict(surface.model.expression, dict(surface.values), *light, theta, phi)
    weight = np.outer(w * 0.5 * half_angle * np.sin(angle), np.full(400, 2 * np.pi / 400))
    return float(np.sum(weight.ravel() * f.reshape(-1) * np.maximum(d[:, 2], 0)))


@pytest.mark.parametrize(
    ("lobe", "shape"),
    [("ggx", {"alpha": 0.3}),
     ("ggx(aniso)", {"alpha_x": 0.2, "alpha_y": 0.5, "angle": 0.7}),
     ("phong", {"exponent": 20.0}), ("eon", {"roughness": 0.6}),
     ("ggx(retro)", {"alpha": 0.3})],
)  # fmt: skip
def test_cones_against_a_product_rule(lobe, shape):
    surface = clear(lobe, **shape)
    for theta, phi, half in ((50.0, 170.0, 20.0), (30.0, 10.0, 25.0)):
        found = quantity(surface, Directional(40.0, 0.0), Conical(theta, phi, half))
        at = (math.radians(theta), math.radians(phi))
        expected = brute_force(surface, (math.radians(40.0), 0.0), at, math.radians(half))
        assert found.value[0] == pytest.approx(expected, rel=2e-5)


def test_two_cones_against_scipy():
    surface = clear("ggx", alpha=0.5)
    light, seen = Conical(40.0, 0.0, 6.0), Conical(35.0, 180.0, 8.0)
    found = quantity(surface, light, seen, tolerance=1e-3)
    axis = math.radians(35.0), math.pi

    def over_detector(turn: float, tilt: float) -> float:
        # The light's direction, around its own axis.
        t = math.radians(40.0)
        x = math.sin(t) * math.cos(tilt) + math.cos(t) * math.sin(tilt) * math.cos(turn)
        y = math.sin(tilt) * math.sin(turn)
        z = math.cos(t) * math.cos(tilt) - math.sin(t) * math.sin(tilt) * math.cos(turn)
        at = math.acos(z), math.atan2(y, x)
        beam = Directional(*np.degrees(at))
        inner = quantity(surface, beam, seen, tolerance=1e-4).value[0]
        return inner * z * math.sin(tilt)

    x, w = np.polynomial.legendre.leggauss(2)
    half = math.radians(6.0)
    total = sum(
        wk * 0.5 * half * np.mean([over_detector(t, 0.5 * half * (xk + 1))
                                   for t in 2 * np.pi * np.arange(4) / 4]) * 2 * np.pi
        for xk, wk in zip(x, w, strict=True)
    )  # fmt: skip
    total /= math.pi * math.sin(half) ** 2 * math.cos(math.radians(40.0))
    assert found.value[0] == pytest.approx(total, rel=1e-4)
    one = quantity(surface, Directional(40.0), seen).value[0]
    assert one == pytest.approx(brute_force(surface, (math.radians(40.0), 0.0), axis,
                                            math.radians(8.0)), rel=1e-6)  # fmt: skip


def test_hemisphere_against_scipy():
    surface = clear("beckmann", alpha=0.6)
    light = math.radians(60.0)

    def f(phi: float, theta: float) -> float:
        value = predict("beckmann", dict(surface.values), light, 0.0, [theta], phi)
        return float(np.ravel(value)[0]) * math.cos(theta) * math.sin(theta)

    expected, *_ = dblquad(f, 0, 0.5 * np.pi, 0, np.pi, epsabs=1e-4, epsrel=1e-4)
    assert value(surface, Directional(60.0), WHOLE) == pytest.approx(2 * expected, rel=1e-4)


def cases(count: int, seed: int):
    """Random shapes and beams of every lobe."""
    from fitting.model import Model

    rng = np.random.default_rng(seed)
    names = lobe_names()
    for k in range(count):
        name = names[k % len(names)]
        model, shape = Model(name), {}
        for n, p in model.parameters().items():
            low, high = p.support
            if p.coefficient:
                shape[n] = 1.0
            elif p.scale == "log":
                shape[n] = float(np.exp(rng.uniform(np.log(low), np.log(high))))
            else:
                shape[n] = float(rng.uniform(max(low, -3.0), min(high, 3.0)))
        theta = float(rng.choice([0.0, rng.uniform(0, 89), 90 - 10 ** rng.uniform(-1, 1)]))
        half = float(10 ** rng.uniform(-1, np.log10(90)))
        at = (theta, 180.0) if rng.random() < 0.6 else (float(rng.uniform(0, 89)), 77.0)
        cone = Conical(*at, half)
        way = str(rng.choice(list(model.ways)))
        side = "front" if way in ("front", "down") else "back"
        free = (cone, WHOLE, Hemispherical(cone))[k % 3]
        yield surface_of(name, shape), Directional(theta), free, side, way in ("down", "up")


def check_bounds(count: int, seed: int) -> None:
    for surface, light, free, side, through in cases(count, seed):
        options: dict[str, Any] = {"side": side, "transmitted": through}
        fine = quantity(surface, light, free, tolerance=1e-9, **options)
        for tolerance in (1e-3, 1e-6):
            found = quantity(surface, light, free, tolerance=tolerance, **options)
            error = abs(found.value[0] - fine.value[0])
            bound = found.error_bound[0] + fine.error_bound[0]
            # What is a hundred times better than asked for may be a lucky agreement.
            lucky = 1e-2 * tolerance * abs(fine.value[0])
            assert error <= max(bound, lucky), (surface, light, free)


@pytest.mark.slow
@pytest.mark.usefixtures("compiled_to_run_long")
def test_the_error_bound_holds_for_every_lobe():
    check_bounds(30, 1)


@pytest.mark.full
@pytest.mark.usefixtures("compiled_to_run_long")
def test_the_error_bound_holds_for_many_lobes():
    check_bounds(300, 2)


@pytest.mark.parametrize("alpha", [1e-3, 0.02, 0.3, 1.0])
@pytest.mark.parametrize(
    "theta", [60.0, *(pytest.param(t, marks=pytest.mark.slow) for t in (0.0, 89.0))]
)
def test_the_error_bound_holds(alpha, theta):
    surface = clear("ggx", alpha=alpha)
    trapped = Hemispherical(Conical(theta, 180.0, 5.0))
    beams = WHOLE, Conical(theta, 180.0, 0.1), trapped, Conical(30.0, 90.0, 90.0)
    for free in beams:
        fine = quantity(surface, Directional(theta), free, tolerance=1e-10)
        for tolerance in (1e-2, 1e-4, 1e-6):
            found = quantity(surface, Directional(theta), free, tolerance=tolerance)
            error = abs(found.value[0] - fine.value[0])
            assert error <= found.error_bound[0] + fine.error_bound[0]
            assert found.error_bound[0] <= 1.1 * tolerance * abs(fine.value[0]) + 1e-15


@pytest.mark.parametrize(
    ("beams", "options"),
    [((Directional(50.0), WHOLE), {}),
     ((Hemispherical(Conical(8.0, 180.0, 8.0)), Directional(8.0)), {}),
     ((Directional(20.0), Conical(20.0, 180.0, 5.0)), {})],
)  # fmt: skip
def test_derivatives(beams, options):
    values = {"lambert.albedo": 0.3, "ggx.alpha": 0.15, "ggx.f0": 0.06, "ggx.f90": 0.9}
    surface = surface_of("lambert + ggx", values)
    rule, found = rule_and_quantity(surface, *beams, **options)
    with jax.enable_x64(True):
        own = {n: jnp.asarray(v) for n, v in values.items()}
        assert float(rule(own)[0]) == pytest.approx(found.value[0], rel=1e-12)
        gradient = jax.jit(jax.grad(lambda v: rule(v)[0]))(own)
    for name, at in values.items():
        step = 1e-3 * at
        up, down = (
            quantity(surface_of("lambert + ggx", values | {name: at + s}), *beams,
                     tolerance=1e-8).value[0]
            for s in (step, -step)
        )  # fmt: skip
        expected = (up - down) / (2 * step)
        assert float(gradient[name]) == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_channels_with_shapes_of_their_own():
    values = {"ggx.alpha": [0.05, 0.1, 0.4], "ggx.f0": 1.0, "ggx.f90": [1.0, 1.0, 0.5]}
    beams = Directional(30.0), Conical(30.0, 180.0, 9.0)
    together = quantity(surface_of("ggx", values), *beams)
    for k, alpha in enumerate(values["ggx.alpha"]):
        alone = surface_of("ggx", {"ggx.alpha": alpha, "ggx.f0": 1.0,
                                   "ggx.f90": values["ggx.f90"][k]})  # fmt: skip
        expected = quantity(alone, *beams)
        assert together.value[k] == pytest.approx(expected.value[0], abs=2e-6)
