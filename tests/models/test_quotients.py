"""Quotients with derivatives of their own, against plain ones and near overflow."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.models.quotients import half_excess, reciprocal

Y = np.array([1e-8, 0.3, 1.0, 7.0, 1e9])
T2 = np.array([1e-8, 0.04, 1.0, 2.0])
Z = np.array([0.0, 1e-3, 0.5, 1.0])


def plain_excess(t2, z):
    return 0.5 * (jnp.sqrt(z * z + t2) - z)


def derivatives(function, *at):
    """Value, first and second derivatives, forward and backward."""
    n = tuple(range(len(at)))
    first = jax.vmap(jax.jacfwd(function, n))(*at)
    back = jax.vmap(jax.jacrev(function, n))(*at)
    second = jax.vmap(jax.jacfwd(jax.jacfwd(function, n), n))(*at)
    return jax.tree.leaves((function(*at), first, back, second))


@pytest.mark.parametrize(
    ("own", "plain", "at"),
    [
        (reciprocal, lambda y: 1.0 / y, (Y,)),
        (half_excess, plain_excess, (T2[:, None] + 0 * Z, Z + 0 * T2[:, None])),
    ],
)
def test_values_and_derivatives(own, plain, at):
    with jax.enable_x64(True):
        at = [jnp.ravel(jnp.asarray(a, dtype=jnp.float64)) for a in at]
        pairs = zip(derivatives(own, *at), derivatives(plain, *at), strict=True)
        for ours, exact in pairs:
            # Where the plain difference cancels, all that is left is its rounding.
            rounding = 1e-12 * np.abs(exact).max()
            np.testing.assert_allclose(ours, exact, rtol=1e-7, atol=rounding)


def test_in_one_variable_alone():
    """The other one is not looked at."""
    slope = jax.grad(lambda t2: half_excess(t2, 0.3))(0.2)
    assert slope == pytest.approx(0.25 / np.sqrt(0.29), rel=1e-6)
    slope = jax.grad(lambda z: half_excess(0.2, z))(0.3)
    assert slope == pytest.approx(0.5 * (0.3 / np.sqrt(0.29) - 1.0), rel=1e-6)


def test_the_square_of_a_reciprocal_may_overflow_where_its_product_does_not():
    y, dy = np.float32(1e-25), np.float32(1e-20)
    value, tangent = jax.jvp(reciprocal, (y,), (dy,))
    assert value == pytest.approx(1e25, rel=1e-6)
    assert tangent == pytest.approx(-1e30, rel=1e-6)
