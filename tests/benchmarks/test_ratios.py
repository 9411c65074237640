"""Speed and memory of the fit as ratios within one run, so that the machine cancels.

    python -m pytest tests/benchmarks -m slow -n 0 -s

With ``-n 0``, for timings that do not disturb each other. The opponent is scipy's
trust-region least squares over all parameters at once, with the exact Jacobian from
forward-mode derivatives, compiled; it starts from a sensible point and knows the scales.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import synthetic
from scipy import sparse
from scipy.optimize import least_squares

from data_formats import Measurement
from fitting import FitOptions, Model, fit, read
from fitting.problem import prepare
from fitting.reduced import Problem
from fitting.rows import Rows, select_rows
from fitting.solve import Solution, refine
from fitting.starts import best_starts

pytestmark = pytest.mark.slow

MODEL = "lambert + ggx"
ROWS, CHANNELS = 1435, 31
OURS_REPEATS = 15
SAME_COST = 1e-6


def spectral_measurement() -> tuple[Measurement, str]:
    """A measured paint of about 1,435 directions by 31 wavelengths, or a synthetic one."""
    folder = os.environ.get("BRDF_TEST_DATA", "")
    path = Path(folder) / "cornell" / "garnet_red.astm"
    if folder and path.is_file():
        return read(path), path.name
    spectrum = np.linspace(0.0, 1.0, CHANNELS)
    truth = {
        "lambert.albedo": 0.1 + 0.4 * spectrum,
        "ggx.alpha": 0.17,
        "ggx.f0": 0.04 + 0.01 * spectrum,
        "ggx.f90": 0.9 - 0.1 * spectrum,
    }
    return made(ROWS, truth, relative=0.02, absolute=1e-3), "a synthetic paint"


def made(rows: int, parameters: dict, **noise: float) -> Measurement:
    """A synthetic measurement of so many rows."""
    angles = synthetic.directions(rings=rows // 60 + 3, azimuths=12)
    return synthetic.measurement(
        MODEL, parameters, angles=[a[:rows] for a in angles], **noise
    )


def timed(run: Callable, repeats: int):
    """Least seconds of ``run()``, which other load disturbs least, and its answer."""
    seconds = []
    for _ in range(repeats):
        begin = time.perf_counter()
        answer = run()
        seconds.append(time.perf_counter() - begin)
    return min(seconds), answer


def ours(problem: Problem, starts: int) -> Solution:
    """What `fitting.fit` does for shape and coefficients: a scan, then its best starts."""
    points, x = best_starts(problem, starts)
    ends = [
        jax.device_get(refine(problem, jnp.asarray(u), jnp.asarray(c)))
        for u, c in zip(points, x, strict=True)
    ]
    return min(ends, key=lambda end: float(end.cost))


@dataclass(frozen=True)
class Plain:
    """The same fit as one vector of parameters: ``[alpha, albedo (c), (f0 (c),) f90 (c)]``.

    ``columns`` is the exact Jacobian as one tangent per kind of parameter, which holds all
    of it, because a channel depends on its own coefficients only.
    """

    start: np.ndarray
    bounds: tuple[np.ndarray, np.ndarray]
    residual: Callable
    dense: Callable
    columns: Callable
    shape: tuple[int, int]

    @staticmethod
    def of(rows: Rows, tied: bool) -> Plain:
        model, (n, c) = Model(MODEL), rows.value.shape
        kinds = 2 if tied else 3
        geometry = jax.tree.map(jnp.asarray, rows.geometry)
        y, valid = jnp.asarray(np.where(rows.valid, rows.value, 0.0)), rows.valid

        def residual(z):
            by_kind = z[1:].reshape(kinds, c)
            f90 = by_kind[-1]
            values = {
                "lambert.albedo": by_kind[0],
                "ggx.alpha": z[0],
                "ggx.f0": 0.04 * f90 if tied else by_kind[1],
                "ggx.f90": f90,
            }
            return (valid * (model(values, geometry) - y)).ravel()

        def columns(z):
            units = jnp.eye(1 + kinds)
            kind = np.concatenate([[0], np.repeat(np.arange(kinds) + 1, c)])
            return jnp.stack([jax.jvp(residual, (z,), (u[kind],))[1] for u in units])

        size = 1 + kinds * c
        diffuse = np.pi * np.median(np.asarray(y), axis=0)
        middle = [] if tied else [np.full(c, 0.05)]
        return Plain(
            start=np.concatenate([[0.2], np.maximum(diffuse, 1e-3), *middle, np.ones(c)]),
            bounds=(
                np.concatenate([[1e-4], np.zeros(size - 1)]),
                np.concatenate([[1.5], np.full(size - 1, np.inf)]),
            ),
            residual=jax.jit(residual),
            dense=jax.jit(jax.jacfwd(residual)),
            columns=jax.jit(columns),
            shape=(n * c, size),
        )

    def sparse(self, z: np.ndarray) -> sparse.csr_matrix:
        values = np.asarray(self.columns(z))
        channels = (self.shape[1] - 1) // (len(values) - 1)
        row = np.arange(self.shape[0])
        at = [np.zeros_like(row)] + [
            1 + k * channels + row % channels for k in range(len(values) - 1)
        ]
        where = (np.tile(row, len(values)), np.concatenate(at))
        return sparse.csr_matrix((values.ravel(), where), shape=self.shape)

    def solve(self, solver: str):
        """``exact`` and ``lsmr`` on the dense Jacobian, ``sparse`` on the sparse one."""
        jacobian = self.sparse if solver == "sparse" else self._dense
        return least_squares(
            lambda z: np.asarray(self.residual(z)),
            self.start,
            jacobian,
            bounds=self.bounds,
            x_scale="jac",
            tr_solver="exact" if solver == "exact" else "lsmr",
        )

    def _dense(self, z: np.ndarray) -> np.ndarray:
        return np.asarray(self.dense(z))


@pytest.mark.parametrize(
    ("tie", "parameters"),
    [({}, 1 + 3 * CHANNELS), ({"ggx.f0": "0.04*ggx.f90"}, 1 + 2 * CHANNELS)],
    ids=["94 parameters", "63 parameters, f0 = 0.04 f90"],
)
def test_fit_is_many_times_faster_than_all_parameters_at_once(tie, parameters, line):
    measurement, name = spectral_measurement()
    options = FitOptions(objective="l2", tie=tie)
    with jax.enable_x64(True):
        rows = select_rows(measurement, options.max_theta_deg)
        problem = prepare(rows, Model(MODEL), options)
        plain = Plain.of(rows, tied=bool(tie))
        n, c = rows.value.shape
        assert plain.shape == (n * c, parameters)
        for compiled in (plain.residual, plain.dense, plain.columns):
            jax.block_until_ready(compiled(plain.start))
        np.testing.assert_allclose(
            plain.sparse(plain.start).toarray(), plain.dense(plain.start), atol=1e-12
        )
        ours(problem, 4)

        single, best = timed(lambda: ours(problem, 1), OURS_REPEATS)
        four, best_of_four = timed(lambda: ours(problem, 4), OURS_REPEATS)
        theirs = {
            solver: timed(lambda s=solver: plain.solve(s), repeats)
            for solver, repeats in (("exact", 2), ("lsmr", 3), ("sparse", 5))
        }
    line(f"{name}, {n} x {c}, {MODEL}, l2, {parameters} parameters")
    line(f"  {'method':44} {'seconds':>9} {'times ours':>11} {'cost / ours - 1':>16}")
    described = {
        "exact": "scipy trf, dense exact Jacobian",
        "lsmr": "scipy trf, dense exact Jacobian, lsmr",
        "sparse": "scipy trf, sparse exact Jacobian, lsmr",
    }
    line(f"  {'scan and one start':44} {single:9.4f} {1:11.1f} {'':>16}")
    line(f"  {'scan and four starts, as fit() does':44} {four:9.4f} {four / single:11.1f}")
    for solver, (seconds, answer) in theirs.items():
        ratio, excess = seconds / single, 2 * answer.cost / float(best.cost) - 1
        line(f"  {described[solver]:44} {seconds:9.4f} {ratio:11.1f} {excess:16.1e}")

    assert bool(best.converged)
    assert float(best.cost) <= float(best_of_four.cost) * (1 + SAME_COST)
    for _, answer in theirs.values():
        assert abs(2 * answer.cost / float(best.cost) - 1) < SAME_COST
    # 290 and 17 times, of the smaller problem; other machines differ by a factor of two.
    assert theirs["exact"][0] >= 100 * single
    assert theirs["sparse"][0] >= 6 * single


SIZES = ((8192, 3), (16384, 3), (8192, 31), (65536, 3))


def temporary_bytes(rows: int, channels: int) -> int:
    """What the compiled `refine` needs besides its arguments, by XLA's own analysis."""
    truth = {
        "lambert.albedo": np.full(channels, 0.3),
        "ggx.f0": np.full(channels, 0.05),
        "ggx.f90": np.full(channels, 1.0),
    }
    with jax.enable_x64(True):
        measurement = made(rows, truth, relative=0.01)
        problem = prepare(
            select_rows(measurement, 85.0), Model(MODEL), FitOptions(objective="l2")
        )
        assert problem.target.shape == (channels, rows)
        lowered = refine.lower(problem, jnp.zeros(1), jnp.ones((channels, 3)))
        analysis = lowered.compile().memory_analysis()
    if analysis is None:
        pytest.skip("XLA has no memory analysis on this platform")
    return analysis.temp_size_in_bytes


def test_memory_is_less_than_the_data_and_holds_no_jacobian(line):
    needed = {size: temporary_bytes(*size) for size in SIZES}
    line("temporary memory of the compiled solver")
    line(f"  {'rows x channels':>16} {'MB':>8} {'bytes/value':>12} {'Jacobian, MB':>13}")
    for (rows, channels), temporary in needed.items():
        values = rows * channels
        jacobian = 8 * values * (1 + 3 * channels)
        line(
            f"  {f'{rows} x {channels}':>16} {temporary / 1e6:8.2f} "
            f"{temporary / values:12.1f} {jacobian / 1e6:13.1f}"
        )
    for size, temporary in needed.items():
        assert temporary < 8 * np.prod(size)
    # With three channels the Jacobian has ten columns only; with 31 it has 94.
    assert needed[8192, 31] < 8 * 8192 * 31 * 94 / 20
    assert needed[65536, 3] < 8 * 65536 * 3 * 10 / 3


def test_where_a_warm_fit_spends_its_time(line):
    measurement, name = spectral_measurement()
    options = FitOptions(objective="l2")
    fit(measurement, MODEL, options)
    whole, _ = timed(lambda: fit(measurement, MODEL, options), 5)
    plain, _ = timed(lambda: fit(measurement, MODEL, options, cross_validate=False), 5)
    marks = [("selecting rows", time.perf_counter())]
    fit(
        measurement, MODEL, options, cross_validate=False,
        progress=lambda what: marks.append((what, time.perf_counter())),
    )  # fmt: skip
    marks.append(("", time.perf_counter()))
    with jax.enable_x64(True):
        rows = select_rows(measurement, options.max_theta_deg)
        problem = prepare(rows, Model(MODEL), options)
        points, x = best_starts(problem, 1)
        start = jnp.asarray(points[0]), jnp.asarray(x[0])
        alone, _ = timed(
            lambda: jax.block_until_ready(refine(problem, *start)), OURS_REPEATS
        )
    line(f"warm fit() of {name}, {rows.value.shape[0]} x {rows.value.shape[1]}, seconds")
    line(f"  {'refine alone, from one start':44} {alone:9.4f}")
    line(f"  {'fit()':44} {whole:9.4f}")
    line(f"  {'fit(cross_validate=False)':44} {plain:9.4f}, of which once")
    for (what, at), (_, until) in pairwise(marks):
        more = ", scores, diagnostics" if what == "uncertainties" else ""
        line(f"    {what + more:42} {until - at:9.4f}")
    assert alone < plain
