"""The batched quadratic program against scipy."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, nnls

from fitting import qp

solve = jax.jit(qp.solve)
within = jax.jit(qp.within)


def problems(seed: int, m: int, channels: int = 7, rows: int = 60):
    """Correlated columns of very different size, as basis functions have."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(channels, rows, m)) + 3.0 * rng.normal(size=(channels, rows, 1))
    a *= 10.0 ** rng.uniform(-3, 3, size=m)
    y = rng.normal(size=(channels, rows))
    return a, y, np.einsum("cni,cnj->cij", a, a), np.einsum("cni,cn->ci", a, y)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), m=st.sampled_from([1, 3, 5]))
def test_non_negative_least_squares(seed, m):
    a, y, hessian, linear = problems(seed, m)
    with jax.enable_x64(True):
        out = solve(hessian, linear, np.eye(m), np.zeros((7, m)))
    for c in range(7):
        x, residual = nnls(a[c], y[c])
        ours = np.linalg.norm(a[c] @ np.asarray(out.x[c]) - y[c])
        assert np.all(np.asarray(out.x[c]) >= 0)
        assert ours <= residual * (1 + 1e-10)
        np.testing.assert_array_equal(np.asarray(out.x[c]) == 0, x == 0)


def test_upper_and_lower_bounds():
    a, y, hessian, linear = problems(3, 4)
    size = np.abs(np.linalg.solve(hessian, linear[..., None])[..., 0]).max(axis=0)
    low, high = -0.05 * size, 0.1 * size
    rows = np.vstack([np.eye(4), -np.eye(4)])
    limits = np.tile(np.concatenate([low, -high]), (7, 1))
    with jax.enable_x64(True):
        out = solve(hessian, linear, rows, limits)
    for c in range(7):
        best = lsq_linear(a[c], y[c], (low, high), tol=1e-14)
        ours = a[c] @ np.asarray(out.x[c]) - y[c]
        assert 0.5 * ours @ ours <= best.cost * (1 + 1e-9)
        assert np.all(np.asarray(out.x[c]) >= low * (1 + 1e-12))
        assert np.all(np.asarray(out.x[c]) <= high * (1 + 1e-12))


def kkt(hessian, linear, low, high, x):
    """How far a point is from the conditions of a minimum, in the problem's own scales."""
    roots = np.sqrt(np.einsum("cii->ci", hessian))
    slope = (np.einsum("cij,cj->ci", hessian, x) - linear) / roots
    slope /= np.abs(linear / roots).max(axis=1, keepdims=True)
    pushed = np.where(
        x <= low, np.minimum(slope, 0), np.where(x >= high, np.maximum(slope, 0), slope)
    )
    return np.abs(pushed).max()


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    m=st.sampled_from([1, 2, 3, 5, 8]),
    upper=st.booleans(),
    guess=st.sampled_from([None, "low", "random"]),
)
def test_within_bounds_it_is_the_minimum_exactly(seed, m, upper, guess):
    a, y, hessian, linear = problems(seed, m, channels=31)
    size = np.abs(np.linalg.solve(hessian, linear[..., None])[..., 0]).max(axis=0)
    rng = np.random.default_rng(seed)
    low = np.where(rng.uniform(size=m) < 0.3, -0.05, 0.0) * size * np.ones((31, 1))
    high = np.where(upper & (rng.uniform(size=m) < 0.6), 0.1 * size, np.inf) * np.ones(
        (31, 1)
    )
    near = None
    if guess:
        inner = np.minimum(high, low + size * rng.uniform(0, 0.2, (31, m)))
        near = (
            low if guess == "low" else np.where(rng.uniform(size=(31, m)) < 0.5, low, inner)
        )
    with jax.enable_x64(True):
        x, inverse = (np.asarray(v) for v in within(hessian, linear, low, high, near))
    assert np.all((x >= low) & (x <= high))
    assert kkt(hessian, linear, low, high, x) < 1e-9
    for c in range(0, 31, 10):
        best = lsq_linear(a[c], y[c], (low[c], high[c]), tol=1e-14)
        ours = a[c] @ x[c] - y[c]
        assert 0.5 * ours @ ours <= best.cost * (1 + 1e-9)
        free = np.flatnonzero((x[c] > low[c]) & (x[c] < high[c]))
        exact = np.zeros((m, m))
        exact[np.ix_(free, free)] = np.linalg.inv(hessian[c][np.ix_(free, free)])
        scale = np.sqrt(np.diag(hessian[c]))
        np.testing.assert_allclose(
            inverse[c] * np.outer(scale, scale),
            exact * np.outer(scale, scale),
            rtol=1e-6,
            atol=1e-9,
        )


@pytest.mark.parametrize("m", [1, 4])
def test_what_is_no_number_stays_none_and_spoils_nothing(m):
    _, _, hessian, linear = problems(4, m)
    hessian[2] = np.nan
    linear[3] = 0.0
    low, high = np.zeros((7, m)), np.full((7, m), np.inf)
    with jax.enable_x64(True):
        x = np.asarray(within(hessian, linear, low, high)[0])
        alone = np.asarray(within(hessian[5:], linear[5:], low[5:], high[5:])[0])
    assert not np.isfinite(x[2]).any()
    np.testing.assert_array_equal(x[3], 0.0)
    np.testing.assert_array_equal(x[5:], alone)


def test_equal_columns_share_what_they_explain():
    """Of two equal columns any share is a minimum, within bounds."""
    _, _, hessian, linear = problems(6, 3)
    twice = np.array([0, 1, 2, 1])
    hessian, linear = hessian[:, twice][:, :, twice], linear[:, twice]
    low, high = np.zeros((7, 4)), np.full((7, 4), np.inf)
    with jax.enable_x64(True):
        x, inverse = (np.asarray(v) for v in within(hessian, linear, low, high))
        other, _ = within(hessian[:, :3, :3], linear[:, :3], low[:, :3], high[:, :3])
    assert np.all(np.isfinite(inverse))
    assert np.all(x >= 0)
    np.testing.assert_allclose(
        x[:, 1] + x[:, 3], np.asarray(other)[:, 1], rtol=1e-6, atol=1e-9 * np.abs(x).max()
    )


@pytest.mark.parametrize("apart", [0.0, 1e-9, 1e-7, 1e-5])
@pytest.mark.parametrize("bound", ["one", "all"])
def test_two_pairs_of_nearly_equal_columns(apart, bound):
    """Singular in two directions, and bounded: still a minimum, and never off."""
    rng = np.random.default_rng(0)
    a = np.abs(rng.normal(size=(2000, 10, 4)))
    a[..., 3] = a[..., 0] + apart * rng.normal(size=(2000, 10))
    a[..., 2] = a[..., 1] + apart * rng.normal(size=(2000, 10))
    y = a.sum(axis=-1)
    hessian, linear = np.einsum("cni,cnj->cij", a, a), np.einsum("cni,cn->ci", a, y)
    low, high = np.zeros((2000, 4)), np.full((2000, 4), np.inf)
    high[:, 1] = 0.7
    if bound == "all":
        high = np.minimum(high, 5.0)
    finite = np.isfinite(high[0])
    rows = np.concatenate([np.eye(4), -np.eye(4)[finite]])
    limits = np.concatenate([low, -high[:, finite]], axis=1)

    def left(x) -> np.ndarray:
        r = np.einsum("cni,ci->cn", a, np.asarray(x)) - y
        return np.sum(r**2, axis=1) / np.sum(y**2, axis=1)

    with jax.enable_x64(True):
        ours = left(within(hessian, linear, low, high)[0])
        exact = left(solve(hessian, linear, rows, limits).x)
    # A ridge of 1e-12 decides between points that cost the same but for that much.
    assert np.all(ours <= exact * (1 + 1e-6) + 2e-12)


def test_sum_constraint_is_kept_and_its_inverse_is_the_constrained_one():
    """With sum(x) <= s active, the inverse is that of the Hessian on sum(dx) = 0."""
    _, _, hessian, linear = problems(5, 3)
    free = np.linalg.solve(hessian, linear[..., None])[..., 0]
    weights = 1.0 / np.abs(free).max(axis=0)
    limit = -np.abs(0.5 * free @ weights) - 1e-3
    rows, limits = -weights[None], limit[:, None]
    with jax.enable_x64(True):
        out = solve(hessian, linear, rows, limits)
    x = np.asarray(out.x)
    assert np.all(rows @ x.T >= limits.T - 1e-9)
    basis = np.linalg.svd(weights[None])[2][1:].T
    for c in np.flatnonzero(np.asarray(out.active)[:, 0]):
        exact = basis @ np.linalg.inv(basis.T @ hessian[c] @ basis) @ basis.T
        np.testing.assert_allclose(
            out.inverse[c], exact, rtol=2e-3, atol=1e-6 * exact.max()
        )
    assert np.asarray(out.active).any()


def test_without_constraints_it_is_the_plain_solution():
    _, _, hessian, linear = problems(8, 5)
    with jax.enable_x64(True):
        out = solve(hessian, linear, np.zeros((0, 5)), np.zeros((7, 0)))
    exact = np.linalg.solve(hessian, linear[..., None])[..., 0]
    np.testing.assert_allclose(out.x, exact, rtol=1e-7)
    np.testing.assert_allclose(out.inverse, np.linalg.inv(hessian), rtol=1e-6)


def test_a_basis_that_vanishes_leaves_its_coefficient_at_the_bound():
    _, _, hessian, linear = problems(2, 3)
    hessian[:, 1] = hessian[:, :, 1] = 0.0
    linear[:, 1] = 0.0
    with jax.enable_x64(True):
        out = solve(hessian, linear, np.eye(3), np.zeros((7, 3)))
    assert np.all(np.isfinite(out.x))
    np.testing.assert_allclose(np.asarray(out.x)[:, 1], 0.0, atol=1e-6)


@pytest.mark.parametrize("m", [1, 2, 6])
def test_inverse_by_sweeping(m):
    _, _, hessian, _ = problems(1, m)
    scale = 1.0 / np.sqrt(np.einsum("cii->ci", hessian))
    unit = hessian * scale[:, :, None] * scale[:, None, :]
    with jax.enable_x64(True):
        inverse = np.moveaxis(np.asarray(qp.inverse(np.moveaxis(unit, 0, -1))), -1, 0)
        product = inverse @ unit
    np.testing.assert_allclose(product, np.tile(np.eye(m), (7, 1, 1)), atol=1e-9)
