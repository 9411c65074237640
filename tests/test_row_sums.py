"""Sums over the rows, made in three ways, are those of plain arrays."""

from __future__ import annotations

import dataclasses
from typing import Any

import haste
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import synthetic

from fitting import FitOptions, Model, objectives, row_sums
from fitting.problem import prepare
from fitting.reduced import Problem
from fitting.row_sums import features, reductions
from fitting.rows import select_rows

CHANNELS = 11


def problem(
    expression: str, *, channels: int = CHANNELS, sigma: bool = False, **kwargs: Any
) -> Problem:
    """Of a noisy measurement, in more channels than one block has, and no multiple."""
    one = np.linspace(0.5, 1.0, channels)
    truth = {"lambert.albedo": 0.4 * one, "ggx.f0": 0.1 * one, "ggx.f90": 0.8 * one}
    m = synthetic.measurement("lambert + ggx", truth, relative=0.05)
    if sigma:
        rng = np.random.default_rng(1)
        m = dataclasses.replace(m, sigma=0.01 + 0.1 * rng.uniform(size=m.value.shape))
    width = kwargs.pop("robust_width", np.inf)
    options = FitOptions(**kwargs)
    rows = select_rows(m, 85.0)
    return prepare(rows, Model(expression), options, robust_width=width)


def plain(p: Problem, u, a):
    """Gram matrices, gradients and cost by numpy; derivatives of the functions by JAX."""
    names = p.unknowns

    def basis(v):
        shape = names.shape(v)
        out = p.model.basis(shape, p.geometry)
        return jnp.stack([jnp.broadcast_to(b, p.kappa.shape) for b in out])

    value, slopes = basis(u), jax.jacfwd(basis)(u)
    features = np.stack([*value, *(slopes[j, :, k] for j, k in row_sums.dependents(p))])
    v = a @ np.asarray(value) * p.kappa
    r = p.weight * (objectives.transform(p.objective, v) - p.target)
    d = p.weight * p.kappa * objectives.slope(p.objective, v)
    if p.robust:
        r, inner = objectives.pseudo_huber(r, p.robust_width)
        d = d * inner
    r, d = (np.broadcast_to(np.asarray(v), p.target.shape) for v in (r, d))
    gram = np.einsum("cn,fn,gn->cfg", d * d, features, features)
    return gram, np.einsum("cn,fn->cf", d * r, features), np.sum(r * r)


WAYS = {
    "products": reductions.Most(0, 4, 0),
    "held": reductions.Most(0, 4, 999),
    "held for all": reductions.Most(0, 99, 9999),
    "inlined": reductions.Most(99, 4, 9999),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("expression", "options"),
    [
        ("lambert + ggx", {"objective": "l2"}),
        ("lambert + ggx", {"objective": "log1p"}),
        ("eon + ggx", {"objective": "chi2", "sigma": True}),
        ("lambert + 2*ggx", {"objective": "l2cos"}),
        ("lambert + ggx", {"objective": "cbrt", "robust_width": 0.01}),
        ("lambert", {"objective": "l2"}),
    ],
)
def test_all_ways_are_the_sums_of_plain_arrays(monkeypatch, expression, options, way):
    monkeypatch.setattr(reductions, "_most", lambda _: WAYS[way])
    with jax.enable_x64(True):
        p = problem(expression, **options)
        p = dataclasses.replace(p, chunk=p.kappa.size // 2)
        u = jnp.linspace(-0.7, 0.4, p.unknowns.n_shape)
        n_basis = sum(p.model.n_basis(i) for i in range(len(p.model.lobes)))
        a = np.random.default_rng(0).uniform(0.05, 0.3, (CHANNELS, n_basis))
        assert reductions.all_at_once(p) == (way == "inlined")
        assert reductions.some_at_once(p) == (way != "products")
        assert features.inlinable(p, u) is not None
        run = jax.jit(row_sums.over_rows, compiler_options=row_sums.FAST)
        got = jax.device_get(run(p, u, jnp.asarray(a)))
        gram, gradient, cost = plain(p, u, a)
    size = np.sqrt(np.einsum("cff->cf", gram))
    apart = np.abs(np.broadcast_to(got.gram, gram.shape) - gram)
    assert np.max(apart / (size[:, :, None] * size[:, None, :] + 1e-300)) < 1e-12
    assert np.max(np.abs(got.gradient - gradient) / (size * np.sqrt(cost))) < 1e-12
    assert float(got.cost) == pytest.approx(float(cost), rel=1e-12)


def test_what_is_costly_or_differs_by_channel_is_not_inlined():
    own: dict[str, Any] = {"fix": {"ggx.alpha": [0.2] * CHANNELS}}
    with jax.enable_x64(True):
        for expression, options in (("lambert + student_t", {}), ("lambert + ggx", own)):
            p = problem(expression, objective="l2", **options)
            assert features.inlinable(p, jnp.zeros(p.unknowns.n_shape)) is None


def test_the_loop_of_the_solver_holds_nothing_of_the_size_of_the_rows():
    """What does not change from step to step may not be written out once for all."""
    from fitting.solve import refine

    with jax.enable_x64(True):
        p = problem("lambert + ggx", channels=3, objective="l2")
        n = 1 << 16
        p = jax.tree.map(
            lambda v: (
                jnp.resize(v, (*v.shape[:-1], n))
                if v.ndim and v.shape[-1] == p.kappa.size
                else v
            ),
            p,
        )
        p = dataclasses.replace(p, chunk=4096)
        x = jnp.full((3, 3), 0.1)
        with haste.compiling(in_haste=False):
            compiled = refine.lower(p, jnp.zeros(1), x).compile()
        analysis = compiled.memory_analysis()
    if analysis is None:
        pytest.skip("XLA has no memory analysis on this platform")
    assert analysis.temp_size_in_bytes < 8 * n
