"""Running a batch to its end or to its interruption, and writing the tables over it."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from types import FrameType

from fitting.batch.cluster import ClusterError
from fitting.batch.engine import Done, Engine
from fitting.batch.receipt import FOLDER, Receipt
from fitting.batch.summary import Row
from fitting.cli.batch_plan import Plan
from fitting.cli.batch_progress import BatchProgress
from fitting.cli.batch_work import RESULT_NAME, FitFile
from fitting.cli.failures import UsageError


class Terminated(KeyboardInterrupt):
    """The system asks to end: a batch queue at its time limit, a shutdown."""


@dataclass(frozen=True)
class Ran:
    """Receipts in the order of the plan, as far as there are; how long it took, in s.

    ``stopped`` is what ended it before its time.
    """

    receipts: tuple[Receipt, ...]
    files: tuple[Row, ...]
    new: int
    seconds: float
    stopped: KeyboardInterrupt | ClusterError | None


def run(
    engine: Engine, work: FitFile, plan: Plan, *, retries: int, progress: BatchProgress
) -> Ran:
    """Fit what is left; interrupted, keep what was done.

    Raises `UsageError` for options with which no file could be fitted.
    """
    begin = time.perf_counter()
    receipts, new = dict(plan.settled), 0
    stopped = None
    try:
        with (
            progress,
            _terminated_as_interrupted(),
            closing(engine.run(work, plan.todo, retries=retries)) as answers,
        ):
            for done in answers:
                receipt = _receipt(done, plan, work)
                if receipt.status == "wrong command":
                    raise UsageError(receipt.reason)
                receipts[receipt.name] = receipt
                new += 1
                progress.ended(receipt)
                _load_writers()
    except KeyboardInterrupt as error:
        stopped = error
    except ClusterError as error:
        if not new:
            raise UsageError(str(error)) from error
        stopped = error
    ordered = tuple(receipts[i.name] for i in plan.items if i.name in receipts)
    files = write_tables(work, ordered)
    return Ran(ordered, tuple(files), new, time.perf_counter() - begin, stopped)


def write_tables(work: FitFile, receipts: Sequence[Receipt]) -> list[Row]:
    """Write the tables anew from the results; gives the rows of the files."""
    from fitting.batch.summary import tables
    from fitting.batch.summary_files import write_summary

    files, parameters = tables(work.folder, receipts, RESULT_NAME)
    write_summary(work.folder, files, parameters, beside=work.folder / FOLDER)
    return files


def _load_writers() -> None:
    """Load what the tables need while the workers work and this process would wait."""
    import fitting.batch.summary_files  # noqa: F401


def _receipt(done: Done, plan: Plan, work: FitFile) -> Receipt:
    """That of the work, or one which says why there is none."""
    if done.reason is None:
        return done.value
    item = plan.todo[done.key]
    lost = Receipt(item.name, str(item.source), item.path, "", "", "lost")
    return work.give_up(lost, "lost", done.reason)


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    def stop(number: int, frame: FrameType | None) -> None:
        raise Terminated

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
