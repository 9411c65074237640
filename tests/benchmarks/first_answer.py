"""How long a user waits for `brdf fit`, against what importing JAX and optimistix takes.

    python tests/benchmarks/first_answer.py
    python tests/benchmarks/first_answer.py FILE

CPU and wall seconds of whole processes: the very first fit on a machine, with an empty
cache for compiled code, and later ones. Without a file: the bundled sample.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
IMPORTS = "import jax, optimistix"
BRDF = "import sys; from fitting.cli import main; sys.exit(main())"
REPEATS = 3


class Seconds(NamedTuple):
    """Of a process, by the clock and of the processor."""

    wall: float
    cpu: float


def once(program: str, *arguments: str, cache: str, folder: str) -> Seconds:
    """One process, as a user's: with Python's own cache of byte code."""
    ours = {"BRDF_CACHE_DIR": cache, "JAX_PLATFORMS": "cpu", "PYTHONPATH": str(ROOT)}
    without = ("PYTHONDONTWRITEBYTECODE", "XLA_FLAGS", "JAX_COMPILATION_CACHE_DIR")
    environment = {k: v for k, v in os.environ.items() if k not in without} | ours
    wall, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env=environment, cwd=folder, check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Seconds(time.perf_counter() - wall, cpu)


def measured(path: str | None = None, models: tuple[str, ...] = ()) -> dict[str, Seconds]:
    """Seconds of the imports, of the first fit and of later ones; the least of some."""
    model = [word for m in models for word in ("-m", m)]
    fit = ["fit", *([path] if path else []), *model, *(["--no-cv"] if models else []), "-q"]
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as folder:

        def least(program: str, *arguments: str) -> Seconds:
            runs = [
                once(program, *arguments, cache=cache, folder=folder)
                for _ in range(REPEATS)
            ]
            return min(runs, key=lambda s: s.cpu)

        # Byte code is made and files are in memory before anything is timed.
        once(BRDF, "formats", cache=cache, folder=folder)
        imports = least(IMPORTS)
        first = once(BRDF, *fit, cache=cache, folder=folder)
        return {"imports": imports, "first": first, "later": least(BRDF, *fit)}


def main() -> None:
    """Print the table."""
    path = str(Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else None
    for models in (("lambert + ggx",), ()):
        found = measured(path, models)
        print(f"brdf fit {path or ''} {'-m ' + models[0] if models else ''}")
        for name, seconds in found.items():
            ratio = seconds.cpu / found["imports"].cpu
            wall = seconds.wall / found["imports"].wall
            print(
                f"  {name:10} {seconds.wall:6.2f} s {seconds.cpu:6.2f} s CPU"
                f"  {wall:6.2f} x, CPU {ratio:6.2f} x"
            )


if __name__ == "__main__":
    main()
