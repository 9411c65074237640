"""The solver and the texels on the processor against a GPU, if there is one.

    python tests/benchmarks/gpu.py
    python tests/benchmarks/gpu.py --quick

Needs JAX for the GPU (``pip install 'jax[cuda12]'``). The program itself stays on the
processor unless ``JAX_PLATFORMS`` says otherwise (``JAX_PLATFORMS=cuda brdf fit ...``), and
nothing depends on a GPU. Each of the two runs in a process of its own, as users would run
it. The solver is timed from rows that are prepared to a minimum; preparing them is numpy's
work, the same for both. Texels also in float32 with a last descent in float64, which is for
GPUs that are slow at float64.

The README has what an H200 gained against 16 cores.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODEL = "lambert + ggx"
REPEATS = 3
NO_GPU = (
    "no GPU is at hand (JAX has none: install jax for it); everything works without one"
)


def least_seconds(run: Callable[[], object]) -> float:
    """Of some runs, after one that compiles."""
    import jax

    jax.block_until_ready(run())
    seconds = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        jax.block_until_ready(run())
        seconds.append(time.perf_counter() - begin)
    return min(seconds)


def solver(rows: int, channels: int) -> tuple[str, Callable[[], object]]:
    """Scan and one start of a problem of so many rows, as `fit` does."""
    import jax
    import numpy as np
    import synthetic

    from fitting import FitOptions, Model
    from fitting.problem import prepare
    from fitting.rows import select_rows
    from fitting.solve import refine
    from fitting.starts import best_starts

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
    with jax.enable_x64(True):
        chosen = select_rows(measurement, 85.0)
        problem = jax.device_put(prepare(chosen, Model(MODEL), FitOptions(objective="l2")))

    def run() -> object:
        with jax.enable_x64(True):
            points, x = best_starts(problem, 1)
            return refine(problem, points[0], x[0]).cost

    return f"solver, {rows} x {channels}", run


def texels(count: int, *, single_first: bool) -> tuple[str, Callable[[], object]]:
    """All texels of a made-up sample."""
    import texels_speed

    from fitting.texels import fit_many

    sample = texels_speed.made_up(count)

    def run() -> object:
        return fit_many(
            sample.values,
            sample.directions,
            MODEL,
            objective="l2",
            single_first=single_first,
        ).cost.sum()

    how = "float32, then float64" if single_first else "float64"
    return f"texels, {count} x 100 x 3, {how}", run


def measured(share: int) -> dict[str, list[float]]:
    """Of every job the seconds, and what came out, on this process's device."""
    jobs = [
        solver(10_000, 31),
        solver(1_000_000 // share, 3),
        solver(1_000_000 // share, 31),
        texels(65_536 // share, single_first=False),
        texels(65_536 // share, single_first=True),
    ]
    return {name: [least_seconds(run), float(run())] for name, run in jobs}  # type: ignore


def in_own_process(platform: str, share: int) -> tuple[str, dict[str, list[float]]]:
    """Name of the device, and what was measured there."""
    out = subprocess.run(
        [sys.executable, __file__, "--here", str(share)],
        env=os.environ | {"JAX_PLATFORMS": platform}, check=True, stdout=subprocess.PIPE,
    ).stdout  # fmt: skip
    return tuple(json.loads(out))  # type: ignore


def has_gpu() -> bool:
    """Whether JAX finds one, of any make."""
    done = subprocess.run(
        [sys.executable, "-c", "import jax; jax.devices('gpu')"],
        env=os.environ | {"JAX_PLATFORMS": ""}, capture_output=True,
    )  # fmt: skip
    return done.returncode == 0


def main() -> int:
    """Print the table; 0 also where there is no GPU."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of everything")
    parser.add_argument("--here", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.here:
        sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]
        import jax

        print(json.dumps([jax.devices()[0].device_kind, measured(given.here)]))
        return 0
    share = 10 if given.quick else 1
    if not has_gpu():
        print(NO_GPU)
        return 0
    _, cpu = in_own_process("cpu", share)
    name, gpu = in_own_process("", share)
    print(f"{'seconds':44} {'CPU':>9} {name:>20} {'ratio':>7} {'results':>9}")
    for job, (seconds, result) in cpu.items():
        there, other = gpu[job]
        print(
            f"{job:44} {seconds:9.4f} {there:20.4f} {seconds / there:7.1f} "
            f"{abs(other / result - 1):9.0e}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
