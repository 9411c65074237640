"""Small measured files, and `brdf` in processes of its own, which can be killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import haste
import synthetic

import data_formats

ROOT = Path(__file__).parents[2]
# What a shell runs in the background ignores interruptions, and so do its children.
_PROGRAM = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from fitting.cli import main; sys.exit(main())"
)
# Several commands in one process, separated by a line.
_PROGRAMS = """
import sys
from fitting.cli import main
for line in sys.stdin.read().splitlines():
    assert main(line.split("|")) == 0, line
"""
PATIENCE_S = 120.0


def write_paint(path: Path, seed: int, rows: int = 6) -> Path:
    """A matt paint of two channels with a little noise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    angles = synthetic.directions((10.0, 40.0, 60.0), rings=rows, azimuths=5)
    measurement = synthetic.measurement(
        "lambert", {"lambert.albedo": [0.2 + 0.01 * seed, 0.5]}, relative=0.02, seed=seed,
        angles=angles,
    )  # fmt: skip
    data_formats.write(measurement, path)
    return path


def environment(**more: str) -> dict[str, str]:
    """Compiled in haste, kept for all tests, and with this checkout."""
    path = os.pathsep.join((str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])))
    ours = {"PYTHONPATH": path, "COLUMNS": "100", "JAX_PLATFORMS": "cpu"}
    return os.environ | haste.environment(ROOT) | ours | more


def brdf(*argv: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(
        [sys.executable, "-c", _PROGRAM, *map(str, argv)], env=environment(), cwd=cwd,
        capture_output=True, text=True, timeout=PATIENCE_S,
    )  # fmt: skip


def brdf_each(commands: list[list[str]], cwd: Path) -> None:
    """Run several commands in one process; all have to end well."""
    subprocess.run(
        [sys.executable, "-c", _PROGRAMS], env=environment(), cwd=cwd, text=True,
        input="\n".join("|".join(c) for c in commands), capture_output=True, check=True,
        timeout=PATIENCE_S,
    )  # fmt: skip


def begin(*argv: object, cwd: Path) -> subprocess.Popen[str]:
    """Start a command."""
    return subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, *map(str, argv)], env=environment(), cwd=cwd,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def wait_for(what: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Until it is so; fails if the process ends before, or after a long time."""
    end = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < end
        if process.poll() is not None:
            raise AssertionError(f"ended early: {process.communicate()}")
        time.sleep(0.005)


def results(folder: Path) -> dict[str, tuple[int, int, bytes]]:
    """Inode, time of writing and content of every result."""
    return {
        p.name: (p.stat().st_ino, p.stat().st_mtime_ns, p.read_bytes())
        for p in sorted(folder.glob("*.fit.json"))
    }
