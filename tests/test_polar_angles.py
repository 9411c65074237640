"""Functions of one polar angle are evaluated once per angle that occurs."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import synthetic

from fitting import FitOptions, Model
from fitting.problem import prepare
from fitting.reduced import evaluate
from fitting.rows import select_rows


@pytest.mark.parametrize(
    "expression",
    [
        "lambert + beckmann",
        "beckmann(retro)",
        *(pytest.param(e, marks=pytest.mark.slow) for e in ("student_t", "gtr")),
    ],
)
def test_the_table_changes_nothing(expression: str):
    with jax.enable_x64(True):
        rows = select_rows(synthetic.measurement(expression, {}), 85.0)
        problem = prepare(rows, Model(expression), FitOptions(objective="l2"))
        assert problem.angles is not None
        assert problem.angles[0].shape[0] == 32
        plain = dataclasses.replace(problem, angles=None, angle_rows=None)
        k, m = problem.unknowns.n_shape, problem.unknowns.n_coefficients
        u, x = 0.1 * jnp.ones(k), 0.3 * jnp.ones((1, m))
        with_table = jax.jit(evaluate)(problem, u, x)
        without = jax.jit(evaluate)(plain, u, x)
        for name, a, b in zip(without._fields, with_table, without, strict=True):
            scale = float(np.max(np.abs(b), initial=1e-300))
            if name == "g_x":
                # At the best coefficients nothing but rounding is left of it.
                scale = float(np.max(np.abs(without.h_xx))) * float(np.max(without.x))
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12 * scale)


def test_no_table_where_it_saves_nothing():
    """Lobes without such functions, and directions that do not repeat."""
    with jax.enable_x64(True):
        rows = select_rows(synthetic.measurement("ggx", {}), 85.0)
        assert prepare(rows, Model("ggx"), FitOptions()).angles is None
        rng = np.random.default_rng(0)
        angles = (*rng.uniform(0, 1.2, (2, 300)), *rng.uniform(0, 3, (2, 300)))
        order = (angles[0], angles[2], angles[1], angles[3])
        rows = select_rows(synthetic.measurement("beckmann", {}, angles=order), 85.0)
        assert prepare(rows, Model("beckmann"), FitOptions()).angles is None
