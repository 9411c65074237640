"""One fit against other solvers and against the least that a pass over the rows costs.

    python tests/benchmarks/solver_speed.py            sizes that take a minute or two
    python tests/benchmarks/solver_speed.py --large    and 10^7 x 3, 10^6 x 31

`lambert + ggx`, ``l2``, synthetic rows. *Ours* is what `fitting.fit` does for shape and
coefficients: the scan of the profile and the refinement of its best start, compiled.
Against it, on the same arrays: scipy's trust region and Ceres (if pyceres is installed)
over all parameters at once with the exact dense Jacobian, compiled; and, per pass, a kernel
written by hand in C for this very model (if there is a C compiler), on one core: as often
as the refinement has steps, and as often as it and the scan go over all rows together.
Least of a few, on a machine that does nothing else.
"""

from __future__ import annotations

import ctypes
import gc
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting import FitOptions, Model, sampling, starts
from fitting.geometry import Geometry
from fitting.padding import padded_geometry
from fitting.predict import predict_geometry
from fitting.problem import prepare
from fitting.reduced import Problem
from fitting.row_sums import FAST, over_rows
from fitting.rows import Rows
from fitting.solve import Solution, refine
from fitting.starts import best_starts

MODEL = "lambert + ggx"
SIZES = ((10_000, 3), (10_000, 31), (100_000, 3), (100_000, 31), (1_000_000, 3))
LARGE = ((1_000_000, 31), (10_000_000, 3))
T = TypeVar("T")
# Dense Jacobians of more values than this are left out.
_MOST_DENSE = 40_000_000


@dataclass(frozen=True)
class Made:
    """Rows and the parameters that they were made from."""

    rows: Rows
    truth: dict[str, np.ndarray]


def made(n: int, channels: int, seed: int = 0) -> Made:
    """Random pairs of directions, half of them near the mirror's, with 1 % of noise."""
    rng = np.random.default_rng(seed)
    theta_i = np.arccos(rng.uniform(0.1, 1.0, n))
    mirror = rng.uniform(size=n) < 0.5
    near = np.clip(theta_i + 0.15 * rng.standard_normal(n), 0.0, 1.45)
    theta_r = np.where(mirror, near, np.arccos(rng.uniform(0.1, 1.0, n)))
    turn = np.where(mirror, 0.15 * rng.standard_normal(n), rng.uniform(0, 2 * np.pi, n))
    g = padded_geometry(theta_i, np.zeros(n), theta_r, np.pi + turn)
    spectrum = np.linspace(0.0, 1.0, channels)
    truth = {
        "lambert.albedo": 0.1 + 0.4 * spectrum,
        "ggx.alpha": np.asarray(0.17),
        "ggx.f0": 0.04 + 0.01 * spectrum,
        "ggx.f90": 0.9 - 0.1 * spectrum,
    }
    value = predict_geometry(Model(MODEL), truth, g)[:n].copy()
    value *= 1.0 + 0.01 * rng.standard_normal(value.shape)
    return Made(
        Rows(
            index=np.arange(n), padded=g, value=value,
            valid=np.broadcast_to(True, value.shape), sigma=None, solid_angle=np.ones(n),
            left_out=(), way=np.broadcast_to("front", n),
        ),
        truth,
    )  # fmt: skip


def timed(run: Callable[[], T], repeats: int) -> tuple[float, T]:
    """Least seconds of ``run()``, which other load disturbs least, and its answer."""
    seconds: list[float] = []
    for _ in range(max(1, repeats) - 1):
        begin = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - begin)
    begin = time.perf_counter()
    answer = run()
    return min([*seconds, time.perf_counter() - begin]), answer


def problem_of(m: Made) -> Problem:
    """What our solver works on."""
    return prepare(m.rows, Model(MODEL), FitOptions(objective="l2"))


def ours(problem: Problem) -> Solution:
    """The scan, and its best start refined."""
    points, x = best_starts(problem, 1)
    return jax.device_get(refine(problem, jnp.asarray(points[0]), jnp.asarray(x[0])))


def scanned(problem: Problem) -> int:
    """How many rows the scan looks at, over and over again."""
    rows = starts.thinned(problem, sampling.brightness(problem)).kappa.size
    return rows * len(starts.candidates(problem))


class Dense:
    """The same fit as one vector: ``[alpha, albedo (c), f0 (c), f90 (c)]``."""

    def __init__(self, m: Made):
        model, c = Model(MODEL), m.rows.value.shape[1]
        geometry: Geometry = jax.tree.map(jnp.asarray, m.rows.geometry)
        y = jnp.asarray(m.rows.value)

        def residual(z):
            albedo, f0, f90 = z[1:].reshape(3, c)
            values = {
                "lambert.albedo": albedo, "ggx.alpha": z[0], "ggx.f0": f0, "ggx.f90": f90,
            }  # fmt: skip
            return (model(values, geometry) - y).ravel()

        self.size = 1 + 3 * c
        self.start = np.concatenate([[0.3], np.full(c, 0.3), np.full(c, 0.05), np.ones(c)])
        self.lower = np.concatenate([[1e-4], np.zeros(3 * c)])
        self.residual = jax.jit(residual)
        self.jacobian = jax.jit(jax.jacfwd(residual))

    def compile(self) -> None:
        jax.block_until_ready((self.residual(self.start), self.jacobian(self.start)))

    def scipy(self) -> float:
        """Sum of squares at the end of ``trf``."""
        end = least_squares(
            lambda z: np.asarray(self.residual(z)),
            self.start,
            lambda z: np.asarray(self.jacobian(z)),  # pyright: ignore[reportArgumentType]
            bounds=(self.lower, np.full(self.size, np.inf)),
            x_scale="jac",
        )
        return 2.0 * end.cost

    def ceres(self) -> float | None:
        """Sum of squares at the end of Ceres' Levenberg-Marquardt; None without pyceres."""
        try:
            import pyceres  # pyright: ignore[reportMissingImports]
        except ModuleNotFoundError:
            return None
        outer = self

        class Cost(pyceres.CostFunction):
            def __init__(self):
                super().__init__()
                rows = outer.residual(outer.start).shape[0]
                self.set_num_residuals(rows)
                self.set_parameter_block_sizes([outer.size])

            def Evaluate(self, parameters, residuals, jacobians):
                z = np.asarray(parameters[0])
                residuals[:] = np.asarray(outer.residual(z))
                if jacobians is not None and jacobians[0] is not None:
                    jacobians[0][:] = np.asarray(outer.jacobian(z)).ravel()
                return True

        z = self.start.copy()
        problem = pyceres.Problem()
        problem.add_residual_block(Cost(), pyceres.TrivialLoss(), [z])
        for j in range(self.size):
            problem.set_parameter_lower_bound(z, j, self.lower[j])
        options = pyceres.SolverOptions()
        options.linear_solver_type = pyceres.LinearSolverType.DENSE_NORMAL_CHOLESKY
        options.max_num_iterations = 100
        options.function_tolerance = 1e-10
        options.minimizer_progress_to_stdout = False
        summary = pyceres.SolverSummary()
        pyceres.solve(options, problem, summary)
        return 2.0 * summary.final_cost


class Kernel:
    """The pass that is written by hand."""

    def __init__(self, problem: Problem):
        compiler = shutil.which("cc") or shutil.which("gcc")
        if compiler is None:
            raise RuntimeError("no C compiler is installed; expected `cc` or `gcc`")
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "pass_kernel.so"
            source = Path(__file__).with_name("pass_kernel.c")
            command = [compiler, "-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
            subprocess.run([*command, source, "-o", library, "-lm"], check=True)
            self._pass = ctypes.CDLL(str(library))["pass"]
        g = problem.geometry
        names = ("cos_i", "cos_o", "hx", "hy", "hz", "cos_d")
        held = [np.ascontiguousarray(getattr(g, n)) for n in names]
        self._arrays = [*held, np.asarray(problem.weight[0]), np.asarray(problem.target)]

    def run(self, alpha: float, a: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """The upper half of the Gram matrix, the gradient ``(c, 5)`` and the cost."""
        n, c = self._arrays[0].size, a.shape[0]
        gram, gradient, cost = np.zeros(15), np.zeros((c, 5)), np.zeros(1)
        pointers = [v.ctypes.data_as(ctypes.c_void_p) for v in (a, *self._arrays)]
        out = [v.ctypes.data_as(ctypes.c_void_p) for v in (gram, gradient, cost)]
        self._pass(
            ctypes.c_long(n), ctypes.c_int(c), ctypes.c_double(alpha), *pointers, *out
        )
        return gram, gradient, float(cost[0])


def passes(problem: Problem, repeats: int) -> tuple[float, float]:
    """Seconds of our pass and of the one by hand, which must agree."""
    kernel = Kernel(problem)
    u, c = jnp.asarray([-1.0]), problem.target.shape[0]
    a = np.tile([[0.3, 0.05, 0.9]], (c, 1))
    run = jax.jit(over_rows, compiler_options=FAST)
    alpha, slope = jax.value_and_grad(lambda v: problem.unknowns.shape(v)["ggx.alpha"])(u)
    sums = jax.block_until_ready(run(problem, u, jnp.asarray(a)))
    gram, gradient, cost = kernel.run(float(alpha), a)
    scale = np.array([1.0, 1.0, 1.0, slope[0], slope[0]])
    upper = np.triu_indices(5)
    ours_gram = np.asarray(sums.gram)[0][upper] / (scale[:, None] * scale)[upper]
    np.testing.assert_allclose(gram, ours_gram, rtol=1e-8)
    np.testing.assert_allclose(gradient, np.asarray(sums.gradient) / scale, rtol=1e-7)
    np.testing.assert_allclose(cost, float(sums.cost), rtol=1e-9)
    mine, _ = timed(lambda: jax.block_until_ready(run(problem, u, jnp.asarray(a))), repeats)
    theirs, _ = timed(lambda: kernel.run(float(alpha), a), repeats)
    return mine, theirs


_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def bytes_beyond(run: Callable[[], object]) -> int | None:
    """Most memory of this process while ``run()`` goes on, beyond what it holds before.

    None where the system does not tell; Linux does.
    """
    if not _CLEAR.exists():
        return None
    gc.collect()
    # What is free, but not yet given back, would hide what is taken.
    ctypes.CDLL(None)["malloc_trim"](0)
    _CLEAR.write_text("5")
    before = _status("VmRSS")
    run()
    return _status("VmHWM") - before


def _status(name: str) -> int:
    lines = (one.split() for one in _STATUS.read_text().splitlines())
    return next(int(words[1]) * 1024 for words in lines if words[0] == f"{name}:")


def line(n: int, channels: int) -> str:
    """One line of the table."""
    data = made(n, channels)
    problem = problem_of(data)
    ours(problem)
    del problem
    more = bytes_beyond(lambda: ours(problem_of(data)))
    problem = problem_of(data)
    repeats = max(2, min(15, 3_000_000 // (n * channels)))
    own, end = timed(lambda: ours(problem), repeats)
    cells = [f"{n} x {channels}", f"{1e3 * own:.1f} ms", f"{int(end.steps)}"]
    size = n * channels * (1 + 3 * channels)
    if size <= _MOST_DENSE:
        dense = Dense(data)
        dense.compile()
        for solver in (dense.scipy, dense.ceres):
            seconds, cost = timed(solver, 1)
            excess = "" if cost is None else f"{cost / float(end.cost) - 1:+.0e}"
            cells.append("-" if cost is None else f"{seconds / own:.0f}x ({excess})")
    else:
        cells += ["-", "-"]
    try:
        mine, theirs = passes(problem, 2 * repeats)
        cells.append(f"{1e3 * mine:.2f} / {1e3 * theirs:.2f} ms = {mine / theirs:.1f}")
        steps, more_rows = int(end.steps), scanned(problem) / n
        cells.append(f"{own / (theirs * steps):.1f}")
        cells.append(f"{own / (theirs * (steps + more_rows)):.1f}")
    except RuntimeError as error:
        cells += [str(error), "-", "-"]
    cells.append("-" if more is None else f"{more / 1e6:.0f} MB")
    return "| " + " | ".join(cells) + " |"


HEADER = """\
| rows x channels | ours | steps | scipy | Ceres | pass, ours / C | fit / (steps x C) | \
fit / (steps and scan x C) | memory beyond the rows |
|---|---|---|---|---|---|---|---|---|"""


def main(arguments: list[str]) -> None:
    """Print the table, a line at a time."""
    print(HEADER)
    sizes = SIZES + (LARGE if "--large" in arguments else ())
    with jax.enable_x64(True):
        for n, channels in sizes:
            print(line(n, channels), flush=True)


if __name__ == "__main__":
    from fitting.cli import jax_setup

    jax_setup.set_up()
    main(sys.argv[1:])
