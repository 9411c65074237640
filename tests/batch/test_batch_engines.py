"""Every item once, whatever happens to workers, storage and the work itself."""

from __future__ import annotations

import multiprocessing
import os
import time
from pathlib import Path

import pytest
from batch_jobs import Slow, Square, Troubled, Unloadable

from fitting.batch import Engine, Processes, Serial

NUMBERS = {f"n{k}": k for k in range(12)}


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("engine", [Serial(), Processes(1), Processes(3)], ids=repr)
def test_every_item_once(engine: Engine, tmp_path: Path):
    work = Square(tmp_path)
    answers = list(engine.run(work, NUMBERS, retries=2))
    assert sorted(d.key for d in answers) == sorted(NUMBERS)
    for done in answers:
        number = NUMBERS[done.key]
        assert (done.value, done.reason, done.tries) == (number**2, None, 1)
        assert work.calls(number) == 1
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize("engine", [Serial(), Processes(2)], ids=repr)
def test_nothing_to_do(engine: Engine, tmp_path: Path):
    assert list(engine.run(Square(tmp_path), {}, retries=2)) == []


@pytest.mark.parametrize("engine", [Serial(), Processes(2)], ids=repr)
def test_storage_is_asked_again_and_a_bug_is_not(engine: Engine, tmp_path: Path):
    square = Square(tmp_path)
    work = Troubled(
        square, storage_once=frozenset([2]), storage_always=frozenset([5]),
        is_a_bug=frozenset([7]),
    )  # fmt: skip
    answers = {d.key: d for d in engine.run(work, NUMBERS, retries=2)}
    assert len(answers) == len(NUMBERS)
    assert (answers["n2"].value, answers["n2"].tries) == (4, 2)
    assert square.calls(5) == answers["n5"].tries == 3
    assert answers["n5"].reason == "/net/paint.astm: Stale file handle (tried 3 times)"
    assert square.calls(7) == 1
    assert answers["n7"].reason == "internal error (ZeroDivisionError: a bug)"
    good = set(NUMBERS) - {"n5", "n7"}
    assert all(answers[key].reason is None for key in good)


def test_a_killed_process_costs_its_own_item_only(tmp_path: Path):
    square = Square(tmp_path)
    work = Troubled(square, kills_once=frozenset([0, 4]), kills_always=frozenset([6]))
    answers = list(Processes(3).run(work, NUMBERS, retries=2))
    assert sorted(d.key for d in answers) == sorted(NUMBERS)
    by_key = {d.key: d for d in answers}
    for number in (0, 4):
        assert by_key[f"n{number}"].value == number**2
        assert square.calls(number) == by_key[f"n{number}"].tries == 2
    assert square.calls(6) == 3
    assert by_key["n6"].reason == (
        "its worker process was killed (signal 9, as when memory runs out) (tried 3 times)"
    )
    for number in set(NUMBERS.values()) - {0, 4, 6}:
        assert square.calls(number) == 1
        assert by_key[f"n{number}"].value == number**2


def test_closing_ends_the_processes_at_once(tmp_path: Path):
    square = Square(tmp_path)
    answers = Processes(2).run(Slow(square, 0.5), {f"{k}": k for k in range(20)}, retries=0)
    next(answers)
    pids = [p.pid for p in multiprocessing.active_children() if p.name == "brdf-worker"]
    assert len(pids) == 2
    begin = time.monotonic()
    answers.close()
    assert time.monotonic() - begin < 0.5
    assert not any(alive(pid) for pid in pids if pid is not None)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_processes_that_cannot_begin_are_not_started_for_ever(tmp_path: Path):
    with pytest.raises(RuntimeError, match="end before they begin"):
        list(Processes(1).run(Unloadable(), NUMBERS, retries=2))
