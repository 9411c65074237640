"""dask: a real scheduler, workers in processes of their own, and one that is killed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from batch_files import ROOT, begin, brdf, environment, results, wait_for, write_paint
from batch_jobs import Square, Troubled

from fitting.batch import Cluster, ClusterError

pytest.importorskip("distributed")

FILES = 16


def start(*argv: str, cwd: Path) -> subprocess.Popen[str]:
    more = {"PYTHONPATH": os.pathsep.join((str(ROOT), str(Path(__file__).parent)))}
    with (cwd / f"{argv[0]}.log").open("a") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_" + argv[0], *argv[1:]],
            env=environment(**more), cwd=cwd, stdout=log, stderr=log, text=True,
        )  # fmt: skip


@contextmanager
def cluster(cwd: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """A scheduler's address, and the processes of workers without a nurse."""
    here = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    running = [start("scheduler", *here, cwd=cwd)]
    log = cwd / "scheduler.log"

    def address() -> re.Match[str] | None:
        return re.search(r"Scheduler at:\s+(tcp://\S+)", log.read_text())

    try:
        wait_for(lambda: address() is not None, running[0])
        found = address()
        assert found is not None
        for k in range(workers):
            running.append(
                start(
                    "worker", found[1], "--nthreads", "1", "--no-nanny", "--no-dashboard",
                    "--name", f"w{k}", "--local-directory", str(cwd / f"w{k}"), cwd=cwd,
                )
            )  # fmt: skip
        yield found[1], running[1:]
    finally:
        for process in running:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_engine_contract_and_a_killer_item(tmp_path: Path):
    square, said = Square(tmp_path), []
    work = Troubled(
        square, storage_once=frozenset([2]), storage_always=frozenset([5]),
        is_a_bug=frozenset([7]), kills_once=frozenset([3]),
    )  # fmt: skip
    numbers = {f"n{k}": k for k in range(9)}
    with cluster(tmp_path, 3) as (address, _):
        engine = Cluster(address, 1, said.append)
        answers = list(engine.run(work, numbers, retries=1))
    assert sorted(d.key for d in answers) == sorted(numbers)
    by_key = {d.key: d for d in answers}
    assert by_key["n5"].reason == "/net/paint.astm: Stale file handle (tried 2 times)"
    assert by_key["n7"].reason == "internal error (ZeroDivisionError: a bug)"
    for key in set(numbers) - {"n5", "n7"}:
        assert by_key[key].value == numbers[key] ** 2
    assert square.calls(3) >= 2


@pytest.mark.slow
def test_a_worker_is_killed_and_results_are_those_of_one_process(tmp_path: Path):
    for k in range(FILES):
        write_paint(tmp_path / "data" / f"p{k:02}.astm", k)
    command = ("batch", "data/*.astm", "-m", "lambert")
    with cluster(tmp_path, 3) as (address, workers):
        process = begin(*command, "-o", "many", "--scheduler", address, cwd=tmp_path)
        out = tmp_path / "many"
        wait_for(lambda: len(list(out.glob("*.fit.json"))) >= 3, process)
        os.kill(workers[0].pid, signal.SIGKILL)
        assert len(results(out)) < FILES
        said, err = process.communicate()
        assert process.returncode == 0, err
        assert workers[0].wait() == -signal.SIGKILL
        assert workers[1].poll() is workers[2].poll() is None
    assert f"{FILES} files: {FILES} fitted" in said
    one = brdf(*command, "-o", "one", "--workers", 0, cwd=tmp_path)
    assert one.returncode == 0, one.stderr
    theirs, ours = results(tmp_path / "many"), results(tmp_path / "one")
    assert len(ours) == FILES
    assert {k: v[2] for k, v in theirs.items()} == {k: v[2] for k, v in ours.items()}
    assert not list(out.rglob("*.part"))


@pytest.mark.slow
def test_a_cluster_of_its_own(tmp_path: Path):
    for k in range(4):
        write_paint(tmp_path / f"p{k}.astm", k)
    before = {p.pid for p in psutil.Process().children(recursive=True)}
    ran = brdf(
        "batch", "*.astm", "-m", "lambert", "--scheduler", "local", "--workers", 2,
        cwd=tmp_path,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert "4 files: 4 fitted" in ran.stdout
    assert "by dask, 2 workers of its own" in ran.stderr
    assert len(results(tmp_path / "results")) == 4
    assert {p.pid for p in psutil.Process().children(recursive=True)} <= before


@pytest.mark.slow
def test_a_scheduler_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("fitting.batch.cluster._CONNECT_S", 1)
    engine = Cluster("tcp://127.0.0.1:9", 1, print)
    with pytest.raises(ClusterError, match="no dask scheduler answers there"):
        list(engine.run(Square(tmp_path), {"a": 1}, retries=0))


def test_without_dask_it_says_what_to_install(tmp_path: Path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    engine = Cluster("local", 1, print)
    with pytest.raises(ClusterError, match=r"brdf-fitting\[dask\]"):
        list(engine.run(Square(tmp_path), {"a": 1}, retries=0))
