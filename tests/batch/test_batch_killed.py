"""Killed at any moment, a batch goes on and ends as if nothing had been."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
from pathlib import Path

import psutil
import pytest
from batch_files import begin, brdf, results, wait_for, write_paint

COMMAND = ("batch", "data/*.astm", "-m", "lambert", "-o", "out")
FILES = 20


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for k in range(FILES):
        write_paint(tmp_path / "data" / f"p{k:02}.astm", k)
    return tmp_path


def workers(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """The processes that fit, without Python's own tracker of resources."""
    children = psutil.Process(process.pid).children()
    return [c for c in children if "spawn_main" in " ".join(c.cmdline())]


def several_done(out: Path, least: int = 3):
    return lambda: len(list(out.glob("*.fit.json"))) >= least


def finish(folder: Path, before: dict) -> None:
    """Resume, and look that every file is there once and none was fitted anew."""
    out = folder / "out"
    ran = brdf(*COMMAND, "--resume", "--workers", 1, cwd=folder)
    assert ran.returncode == 0, ran.stderr
    after = results(out)
    assert list(after) == [f"p{k:02}.fit.json" for k in range(FILES)]
    assert {name: after[name] for name in before} == before
    assert f"{FILES - len(before)} of {FILES} files to fit" in ran.stderr
    assert f"{len(before)} were there from before" in ran.stdout
    assert not list(out.rglob("*.part"))
    with (out / "summary.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [r["file"] for r in rows] == [f"data/p{k:02}.astm" for k in range(FILES)]
    assert {r["status"] for r in rows} == {"done"}


def test_kill_nine(folder: Path):
    out = folder / "out"
    process = begin(*COMMAND, "--workers", 2, cwd=folder)
    wait_for(several_done(out), process)
    orphans = workers(process)
    assert len(orphans) == 2
    process.send_signal(signal.SIGKILL)
    process.communicate()
    # Nobody works on unseen.
    _, left = psutil.wait_procs(orphans, timeout=5)
    assert not left
    before = results(out)
    assert 3 <= len(before) < FILES
    finish(folder, before)


@pytest.mark.parametrize(
    ("number", "code"),
    [
        pytest.param(signal.SIGTERM, 143, id="term"),
        pytest.param(signal.SIGINT, 130, id="int", marks=pytest.mark.slow),
    ],
)
def test_asked_to_end(folder: Path, number: signal.Signals, code: int):
    out = folder / "out"
    process = begin(*COMMAND, "--workers", 1, cwd=folder)
    wait_for(several_done(out), process)
    fitting = workers(process)
    process.send_signal(number)
    said, err = process.communicate()
    assert process.returncode == code, err
    assert "--resume" in err
    assert "Traceback" not in err
    assert not any(psutil.pid_exists(w.pid) for w in fitting)
    before = results(out)
    with (out / "summary.csv").open() as file:
        listed = len(list(csv.DictReader(file)))
    assert f"{FILES - listed} left" in said
    # A result whose receipt was not written any more is not listed, and made again.
    assert listed <= len(before) <= listed + 1
    if number == signal.SIGTERM:
        finish(folder, before)


def test_a_killed_worker_is_replaced(folder: Path):
    process = begin(*COMMAND, "--workers", 1, cwd=folder)
    wait_for(several_done(folder / "out"), process)
    (worker,) = workers(process)
    os.kill(worker.pid, signal.SIGKILL)
    said, err = process.communicate()
    assert process.returncode == 0, err
    assert f"{FILES} files: {FILES} fitted" in said
    assert len(results(folder / "out")) == FILES
