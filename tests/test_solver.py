"""The reduced problem and its solver against plain formulations of the same thing."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
import synthetic
from scipy.optimize import least_squares, nnls

from fitting import padding, problem, reduced, solve, starts, uncertainty
from fitting.model import Model
from fitting.objectives import OBJECTIVES, transform
from fitting.options import FitOptions
from fitting.rows import select_rows

TRUTH = {
    "lambert.albedo": np.array([0.3, 0.2, 0.1]),
    "ggx.alpha": 0.25,
    "ggx.f0": np.array([0.04, 0.05, 0.06]),
    "ggx.f90": np.array([1.0, 0.9, 0.8]),
}


@pytest.fixture(scope="module")
def noisy():
    return synthetic.measurement(
        "lambert + ggx", TRUTH, relative=0.02, absolute=1e-3, seed=4
    )


def prepared(measurement, expression="lambert + ggx", **kwargs):
    rows = select_rows(measurement, 85.0)
    return problem.prepare(rows, Model(expression), FitOptions(**kwargs))


def solved(p, count=3):
    us, xs = starts.best_starts(p, count)
    ends = [
        solve.refine(p, jnp.asarray(u), jnp.asarray(x)) for u, x in zip(us, xs, strict=True)
    ]
    return min(ends, key=lambda e: float(e.cost))


def plain_residual(p):
    """The residual as one would write it: all unknowns in one vector, no structure."""
    k, (c, _) = p.unknowns.n_shape, p.target.shape

    def residual(y):
        shape = p.unknowns.shape(y[:k])
        x = y[k:].reshape(c, -1)
        linear = jax.vmap(p.unknowns.coefficients)(x, p.unknowns.coefficient_constant.T)
        f = p.model({**shape, **linear}, p.geometry).T
        v = f * p.kappa
        return (p.weight * (transform(p.objective, v) - p.target)).ravel()

    return residual


@pytest.mark.parametrize("objective", ["l2", "log1p", "cbrt"])
def test_blocks_are_gradient_and_gauss_newton_matrix_of_the_plain_residual(
    noisy, objective
):
    with jax.enable_x64(True):
        p = prepared(noisy, objective=objective)
        u, x = jnp.array([0.3]), jnp.tile(jnp.array([0.2, 0.05, 0.7]), (3, 1))
        b = jax.jit(reduced.evaluate)(p, u, x)
        residual = plain_residual(p)
        y = jnp.concatenate([u, b.x.ravel()])
        r, jacobian = jax.jit(lambda y: (residual(y), jax.jacfwd(residual)(y)))(y)
        np.testing.assert_allclose(b.cost, r @ r, rtol=1e-9)
        gradient, matrix = jacobian.T @ r, jacobian.T @ jacobian
        size = float(np.abs(gradient).max())
        np.testing.assert_allclose(b.g_u, gradient[:1], atol=1e-9 * size)
        np.testing.assert_allclose(b.g_x.ravel(), gradient[1:], atol=1e-9 * size)
        np.testing.assert_allclose(b.h_uu, matrix[:1, :1], rtol=1e-9)
        np.testing.assert_allclose(b.h_xu.reshape(-1, 1), matrix[1:, :1], rtol=1e-8)
        for i in range(3):
            own = slice(1 + 3 * i, 4 + 3 * i)
            np.testing.assert_allclose(b.h_xx[i], matrix[own, own], rtol=1e-9)


@pytest.mark.parametrize("objective", list(OBJECTIVES))
def test_same_optimum_as_scipy_with_all_parameters(noisy, objective):
    """scipy's trust region on the full vector, from the truth, with the same bounds."""
    with jax.enable_x64(True):
        p = prepared(noisy, objective=objective)
        ours = solved(p)
        residual = jax.jit(plain_residual(p))
        jacobian = jax.jit(jax.jacfwd(plain_residual(p)))
        c, m = ours.x.shape
        lower = np.concatenate([[-np.inf], np.zeros(c * m)])
        start = np.concatenate([[0.5], np.tile([0.2, 0.05, 0.9], c)])
        theirs = least_squares(
            lambda y: np.asarray(residual(y)), start, lambda y: np.asarray(jacobian(y)),
            (lower, np.inf), x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15,
            max_nfev=500,
        )  # fmt: skip
        assert bool(ours.converged)
        assert float(ours.cost) == pytest.approx(2 * theirs.cost, rel=1e-8)
        np.testing.assert_allclose(ours.u, theirs.x[:1], rtol=1e-4)
        np.testing.assert_allclose(np.ravel(ours.x), theirs.x[1:], rtol=1e-3, atol=1e-5)


def test_same_optimum_as_the_stock_optimistix_solver(noisy):
    with jax.enable_x64(True):
        p = prepared(noisy, objective="asinh")
        ours = solved(p)
        residual = plain_residual(p)
        start = jnp.concatenate([ours.u + 0.3, (ours.x * 1.2).ravel()])
        theirs = optx.least_squares(
            lambda y, _: residual(y),
            optx.LevenbergMarquardt(rtol=1e-12, atol=1e-12),
            start,
            max_steps=500,
            throw=False,
        )
        cost = float(jnp.sum(residual(theirs.value) ** 2))
        assert float(ours.cost) == pytest.approx(cost, rel=1e-7)


@pytest.mark.parametrize(
    ("expression", "truth"),
    [
        (
            "lambert + ggx(aniso)",
            {"ggx.alpha_x": 0.1, "ggx.alpha_y": 0.35, "ggx.angle": 0.6},
        ),
        ("lambert + ggx(dielectric)", {"ggx.alpha": 0.3, "ggx.eta": 1.6}),
        ("oren_nayar + beckmann", {"oren_nayar.sigma": 0.5, "beckmann.alpha": 0.2}),
        ("eon + ward", {"eon.roughness": 0.6, "ward.alpha": 0.15}),
        ("blinn_phong", {"blinn_phong.exponent": 60.0}),
    ],
)
def test_noise_free_data_give_back_the_truth(expression, truth):
    angles = synthetic.directions(rings=14, azimuths=9)
    if "aniso" in expression:
        angles = tuple(np.concatenate([a, a]) for a in angles)
        half = angles[0].size // 2
        angles[1][half:] += 1.1
        angles[3][half:] += 1.1
    model = Model(expression)
    linear = {
        n: np.array([0.5, 0.2]) for n, q in model.parameters().items() if q.coefficient
    }
    m = synthetic.measurement(expression, linear | truth, angles=angles)
    with jax.enable_x64(True):
        end = solved(prepared(m, expression, objective="asinh"), count=4)
        p = prepared(m, expression, objective="asinh")
        shape = p.unknowns.shape(jnp.asarray(end.u))
    got = {name: float(value) for name, value in shape.items()}
    if "aniso" in expression:
        # Exchanging the axes and turning by 90 degrees is the same surface.
        if got["ggx.alpha_x"] > got["ggx.alpha_y"]:
            got["ggx.alpha_x"], got["ggx.alpha_y"] = got["ggx.alpha_y"], got["ggx.alpha_x"]
            got["ggx.angle"] += 0.5 * np.pi
        got["ggx.angle"] %= np.pi
    assert got == pytest.approx(truth, rel=1e-5)
    np.testing.assert_allclose(end.x, np.tile([[0.5], [0.2]], end.x.shape[1]), rtol=1e-4)


def test_chunks_and_padding_change_nothing(noisy):
    with jax.enable_x64(True):
        p = prepared(noisy)
        u, x = jnp.array([0.3]), jnp.full((3, 3), 0.3)
        evaluate = jax.jit(reduced.evaluate)
        whole = evaluate(p, u, x)
        parts = dataclasses.replace(p, chunk=p.kappa.shape[0] // 4)
        for a, b in zip(whole, evaluate(parts, u, x), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-15)
        n = select_rows(noisy, 85.0).index.size
        assert p.kappa.shape[0] == padding.bucket(n) > n


def test_buckets_waste_at_most_a_third_and_are_whole_chunks():
    for n in [1, 100, 1434, 4097, 10_804, 50_000, 10**6, 10**7]:
        size = padding.bucket(n)
        assert size >= n
        assert size <= 128 or size < 2 * n
        if size > 4096:
            assert size % 4096 == 0
        if n > 40_000:
            assert size < 1.34 * n


def test_the_scan_is_deterministic_and_orders_equal_lobes(noisy):
    with jax.enable_x64(True):
        p = prepared(noisy, "lambert + 2*ggx")
        points = starts.candidates(p)
        np.testing.assert_array_equal(points, starts.candidates(p))
    assert points.shape == (64, 2)
    assert np.all(points[:, 0] <= points[:, 1])


def test_masked_values_do_not_count(noisy):
    valid = noisy.valid.copy()
    valid[::7, 1] = False
    value = noisy.value.copy()
    value[::7, 1] = np.nan
    masked = dataclasses.replace(noisy, valid=valid, value=value)
    ruined = dataclasses.replace(noisy, valid=valid)
    with jax.enable_x64(True):
        a, b = solved(prepared(masked)), solved(prepared(ruined))
    assert float(a.cost) == float(b.cost)
    np.testing.assert_array_equal(a.x, b.x)


def test_variances_of_the_noise_are_those_of_scipys_non_negative_least_squares():
    rng = np.random.default_rng(3)
    for wanted in ([0.3, 0.2], [0.5, -0.4], [-0.3, 0.6], [0.0, 0.0]):
        design = rng.uniform(0.1, 1.0, (40, 2)) * [1.0, 1e-6]
        r2 = np.maximum(design @ (wanted * np.array([1.0, 1e6])), 0.0)
        r2 += 0.01 * rng.uniform(size=r2.size)
        found = uncertainty._not_negative(design.T @ design, design.T @ r2)
        np.testing.assert_allclose(found, nnls(design, r2)[0], rtol=1e-8, atol=1e-12)
