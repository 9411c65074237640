"""Worker processes on this machine, each with its own pipe: who dies is known by name.

`concurrent.futures` breaks the whole pool when one process dies and does not say at which
item; here the item is known, is tried again in a new process, and the others go on.
"""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from fitting.batch import worker
from fitting.batch.engine import Done, Try, Work, gave_up
from fitting.batch.threads import cores

# Processes that end before they take an item cannot work at all: a broken installation.
_NEVER_READY = 3


@dataclass(eq=False)
class _Lane:
    process: SpawnProcess
    pipe: Connection
    ready: bool = False
    key: str | None = None


@dataclass(frozen=True)
class Processes:
    """So many long-lived processes, which share the cores among them.

    They are spawned, not forked, since threads of XLA do not survive a fork.
    """

    workers: int

    @property
    def described(self) -> str:
        """Who works, in a few words."""
        return f"{self.workers} process{'' if self.workers == 1 else 'es'}"

    def run(
        self, work: Work, items: Mapping[str, Any], *, retries: int
    ) -> Generator[Done, None, None]:
        """Yield a `Done` for every item as it ends; a dead process is replaced.

        Raises ``RuntimeError`` if processes end before they have begun to work.
        """
        waiting, tries = deque(items), dict.fromkeys(items, 0)
        lanes = [self._begin(work) for _ in range(min(self.workers, len(items)))]
        stillborn = 0
        try:
            while waiting or any(lane.key is not None for lane in lanes):
                for lane in _stirring(lanes):
                    answer, alive = _hear(lane)
                    key, lane.key = lane.key, None
                    if not alive:
                        lanes.remove(lane)
                        stillborn += not lane.ready
                        if stillborn >= _NEVER_READY:
                            raise RuntimeError("worker processes end before they begin")
                    done = None
                    if answer is not None and key is not None:
                        if answer.outcome == "again" and tries[key] <= retries:
                            waiting.append(key)
                        else:
                            done = _done(key, answer, tries[key])
                    if waiting and not alive:
                        lanes.append(self._begin(work))
                    elif waiting:
                        lane.key = waiting.popleft()
                        tries[lane.key] += 1
                        _send(lane, items[lane.key])
                    # Last, so that nobody is idle while the receiver is busy.
                    if done is not None:
                        yield done
        finally:
            for lane in lanes:
                lane.process.kill()
            for lane in lanes:
                lane.process.join()
                lane.pipe.close()

    def _begin(self, work: Work) -> _Lane:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(
            target=worker.serve,
            args=(theirs, work, max(1, cores() // self.workers)),
            name="brdf-worker",
            daemon=True,
        )
        process.start()
        theirs.close()
        return _Lane(process, ours)


def _stirring(lanes: list[_Lane]) -> list[_Lane]:
    """Lanes that have something to say, or will never say anything again."""
    found = wait([lane.pipe for lane in lanes])
    return [lane for lane in lanes if lane.pipe in found]


def _hear(lane: _Lane) -> tuple[Try | None, bool]:
    """The answer to the lane's item, if it gave one or died of it; whether it lives."""
    try:
        said = lane.pipe.recv()
    except (EOFError, OSError):
        lane.process.join()
        lane.pipe.close()
        return Try("again", reason=_death(lane.process.exitcode)), False
    if said == worker.READY:
        lane.ready = True
        return None, True
    return said, True


def _send(lane: _Lane, item: Any) -> None:
    try:
        lane.pipe.send(item)
    except OSError:
        # It has just died, which `_hear` finds out next.
        return


def _done(key: str, answer: Try, tries: int) -> Done:
    reason = answer.reason
    return Done(
        key, answer.value, None if reason is None else gave_up(reason, tries), tries
    )


def _death(exitcode: int | None) -> str:
    how = "ended" if exitcode is None or exitcode >= 0 else "was killed"
    what = f"exit code {exitcode}" if exitcode is None or exitcode >= 0 else (
        f"signal {-exitcode}" + (", as when memory runs out" if exitcode == -9 else "")
    )  # fmt: skip
    return f"its worker process {how} ({what})"
