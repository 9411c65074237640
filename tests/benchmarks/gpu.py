"""The solver and the texels on the processor against a GPU, if there is one.

    JAX_PLATFORMS=cuda,cpu python tests/benchmarks/gpu.py
    JAX_PLATFORMS=cuda,cpu python tests/benchmarks/gpu.py --quick

Needs JAX for the GPU (``pip install 'jax[cuda12]'``). The program itself stays on the
processor unless ``JAX_PLATFORMS`` says otherwise, and nothing depends on a GPU. The solver
is timed in float64; for texels also float32 with a last descent in float64, which is for
GPUs that are slow at float64.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

# All that there is, unless told: what is asked here is whether there is a GPU.
os.environ.setdefault("JAX_PLATFORMS", "")
sys.path.insert(0, str(Path(__file__).parents[1]))

import jax
import jax.numpy as jnp
import numpy as np
import synthetic
import texels_speed

from fitting import FitOptions, Model
from fitting.problem import prepare
from fitting.rows import select_rows
from fitting.solve import refine
from fitting.starts import best_starts
from fitting.texels import fit_many

MODEL = "lambert + ggx"
REPEATS = 3


def gpus() -> list:
    """What JAX has, of any make."""
    try:
        return jax.devices("gpu")
    except RuntimeError:
        return []


def least_seconds(run: Callable[[], object]) -> float:
    """Of some runs, after one that compiles."""
    jax.block_until_ready(run())
    seconds = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        jax.block_until_ready(run())
        seconds.append(time.perf_counter() - begin)
    return min(seconds)


def solver(rows: int, channels: int) -> tuple[str, Callable[[], object]]:
    """Scan and one start of a problem of so many rows, as `fit` does."""
    spectrum = np.linspace(0.0, 1.0, channels)
    truth = {
        "lambert.albedo": 0.1 + 0.4 * spectrum,
        "ggx.alpha": 0.17,
        "ggx.f0": 0.04 + 0.01 * spectrum,
        "ggx.f90": 1.0 - 0.1 * spectrum,
    }
    angles = synthetic.directions(rings=rows // 60 + 3, azimuths=12)
    measurement = synthetic.measurement(
        MODEL, truth, relative=0.01, angles=[a[:rows] for a in angles]
    )

    def run() -> object:
        with jax.enable_x64(True):
            chosen = select_rows(measurement, 85.0)
            problem = jax.device_put(
                prepare(chosen, Model(MODEL), FitOptions(objective="l2"))
            )
            points, x = best_starts(problem, 1)
            return refine(problem, jnp.asarray(points[0]), jnp.asarray(x[0]))

    return f"solver, {rows} x {channels}", run


def texels(count: int, *, single_first: bool) -> tuple[str, Callable[[], object]]:
    """All texels of a made-up sample."""
    sample = texels_speed.made_up(count)

    def run() -> object:
        return fit_many(
            sample.values,
            sample.directions,
            MODEL,
            objective="l2",
            single_first=single_first,
        ).cost

    how = "float32, then float64" if single_first else "float64"
    return f"texels, {count} x 100 x 3, {how}", run


def main() -> int:
    """Print the table; 0 also where there is no GPU."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of everything")
    share = 10 if parser.parse_args().quick else 1
    found = gpus()
    if not found:
        print(
            "no GPU is at hand (JAX has none: install jax for it and set "
            "JAX_PLATFORMS=cuda,cpu); everything works without one"
        )
        return 0
    cpu = jax.devices("cpu")[0]
    print(f"{'seconds':44} {'CPU':>9} {found[0].device_kind:>20} {'ratio':>7}")
    jobs = [
        solver(1_000_000 // share, 3),
        solver(100_000 // share, 31),
        texels(65_536 // share, single_first=False),
        texels(65_536 // share, single_first=True),
    ]
    for name, run in jobs:
        seconds = []
        for device in (cpu, found[0]):
            with jax.default_device(device):
                seconds.append(least_seconds(run))
        print(
            f"{name:44} {seconds[0]:9.3f} {seconds[1]:20.3f} {seconds[0] / seconds[1]:7.1f}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
