"""Where the time of a batch goes: ``python tests/benchmarks/batch_time.py [FILE ...]``.

Without files, 44 synthetic paints of 10,804 rows x 3 channels, as many as a published job
of model paints has. Seconds on the clock and of the processors, the latter because others
may use the machine; the job of many files beside what one process needs to read and to fit.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
FILES, ROWS = 44, 10_804
MODEL = "lambert + ggx"
_BRDF = "import sys; from fitting.cli import main; sys.exit(main())"
_WARM_FITS = 5


@dataclass(frozen=True)
class Took:
    """Seconds on the clock and of all processors."""

    wall: float
    cpu: float

    def __str__(self) -> str:
        return f"{self.wall:8.3f} {self.cpu:8.3f}"


def write_paints(folder: Path, files: int) -> list[Path]:
    """Synthetic paints in rings, as a goniometer scans them, as ASTM text."""
    sys.path.insert(0, str(ROOT / "tests"))
    import synthetic

    import data_formats

    rng = np.random.default_rng(0)
    # 8 incidences x 38 rings x 36 azimuths, of which the first rows are kept.
    angles = synthetic.directions(np.linspace(5.0, 75.0, 8).tolist(), 38, 37)
    paths = [folder / f"paint{k:02}.astm" for k in range(files)]
    for seed, path in enumerate(paths):
        truth = {
            "lambert.albedo": rng.uniform(0.05, 0.7, 3),
            "ggx.alpha": rng.uniform(0.08, 0.4),
            "ggx.f0": rng.uniform(0.03, 0.06, 3),
            "ggx.f90": rng.uniform(0.7, 1.0, 3),
        }
        measurement = synthetic.measurement(
            MODEL, truth, angles=[a[:ROWS] for a in angles], relative=0.02, absolute=1e-3,
            seed=seed,
        )  # fmt: skip
        data_formats.write(measurement, path)
    return paths


def environment(cache: Path) -> dict[str, str]:
    """Of the processes: this checkout, and a cache of compiled code of their own."""
    return os.environ | {
        "PYTHONPATH": str(ROOT),
        "BRDF_CACHE_DIR": str(cache),
        "JAX_PLATFORMS": "cpu",
    }


def batch(paths: Sequence[Path], out: Path, cache: Path, *argv: str) -> Took:
    """One `brdf batch` from the start of its process to its end."""
    command = ["batch", *map(str, paths), "-m", MODEL, "--no-cv", "-q", "-o", str(out)]
    return of_children(
        lambda: subprocess.run(
            [sys.executable, "-c", _BRDF, *command, *argv], env=environment(cache),
            check=True, capture_output=True,
        )
    )  # fmt: skip


def inside(paths: Sequence[Path], cache: Path) -> dict[str, Took]:
    """What one process needs: to start, to read, for its first fit, and for one more."""
    ran = subprocess.run(
        [sys.executable, __file__, "--inside", *map(str, paths)], env=environment(cache),
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    return {name: Took(*took) for name, took in json.loads(ran.stdout).items()}


def of_children(run: Callable[[], Any]) -> Took:
    """What processes that end in the meantime take."""

    def cpu() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    begin, before = time.perf_counter(), cpu()
    run()
    return Took(time.perf_counter() - begin, cpu() - before)


def _inside(paths: Sequence[str]) -> None:
    took: dict[str, tuple[float, float]] = {}

    def timed(name: str, run: Callable[[], Any], times: int = 1) -> Any:
        begin, before = time.perf_counter(), time.process_time()
        answer = run()
        wall, cpu = time.perf_counter() - begin, time.process_time() - before
        took[name] = wall / times, cpu / times
        return answer

    def start() -> Any:
        from fitting.cli import jax_setup

        jax_setup.set_up()
        from fitting.fitter import fit

        return fit

    fit = timed("loading JAX and the fit", start)
    from data_formats import read

    found = timed("reading a file", lambda: [read(p) for p in paths], len(paths))
    timed("the first fit of a process", lambda: fit(found[0], MODEL, cross_validate=False))
    some = found[:_WARM_FITS]
    timed(
        "one fit more",
        lambda: [fit(m, MODEL, cross_validate=False).to_json() for m in some],
        len(some),
    )
    print(json.dumps(took))


def main(paths: Sequence[Path]) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cache = folder / "cache"
        paths = paths or write_paints(folder, FILES)
        cold = batch(paths, folder / "cold", cache)
        one = batch(paths[:1], folder / "one", cache)
        whole = batch(paths, folder / "all", cache)
        resumed = batch(paths, folder / "all", cache, "--resume")
        print(f"{len(paths)} files, {MODEL}, {os.cpu_count()} cores: seconds, and of CPU")
        print(f"  {'all files, nothing compiled yet':40} {cold}")
        print(f"  {'all files':40} {whole}")
        each = Took(whole.wall / len(paths), whole.cpu / len(paths))
        print(f"  {'  per file':40} {each}")
        print(f"  {'all files, resumed when all is done':40} {resumed}")
        print(f"  {'one file':40} {one}")
        for what, took in inside(paths, cache).items():
            print(f"  {what:40} {took}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        _inside(sys.argv[2:])
    else:
        main([Path(p) for p in sys.argv[1:]])
