"""Many machines by dask.distributed: its scheduler, its workers, its care for lost ones.

`Cluster("tcp://host:8786")` uses a scheduler that runs, `Cluster("local")` starts one with
workers on this machine. Every worker needs this package in the same versions, and the files
under the same names: a shared file system.

Under Slurm, dask-jobqueue submits the workers (``pip install dask-jobqueue``)::

    from dask_jobqueue import SLURMCluster

    cluster = SLURMCluster(
        cores=16, processes=16, memory="32GB", walltime="02:00:00",
        queue="compute", local_directory="$TMPDIR",
    )
    cluster.scale(jobs=8)
    print(cluster.scheduler_address)
    input("Enter ends it: ")

Leave that running on the login node (or in a job), and give the address that it prints to
``brdf batch 'data/*.astm' -o results --scheduler tcp://...``. As many processes as cores,
one thread each, is right: the fits do not share memory. ``BRDF_CACHE_DIR`` on a file system
that all nodes see lets them share compiled code, if their processors are of one kind.
"""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from fitting.batch.engine import Done, Try, Work, attempt, gave_up
from fitting.batch.threads import limit_threads

LOCAL = "local"
_CONNECT_S = 15
# Any free port: the usual one may be taken, which dask says in a warning.
_NO_DASHBOARD = ":0"


class ClusterError(ValueError):
    """A scheduler that is not there, or not any more, in one sentence."""


@dataclass(frozen=True)
class Cluster:
    """The workers of a dask scheduler.

    ``workers`` is for ``"local"``; ``say`` is called with what the user should know. A lost
    worker's items go to others; an item during which more than ``retries`` workers died is
    given up (with a scheduler that ran before: more than its ``allowed-failures``).
    """

    scheduler: str
    workers: int
    say: Callable[[str], None]

    @property
    def described(self) -> str:
        """Who works, in a few words."""
        if self.scheduler == LOCAL:
            return f"dask, {self.workers} workers of its own"
        return f"dask, scheduler {self.scheduler}"

    def run(
        self, work: Work, items: Mapping[str, Any], *, retries: int
    ) -> Generator[Done, None, None]:
        """Yield a `Done` for every item as it ends.

        Raises `ClusterError` if dask is not installed, or the scheduler does not answer.
        """
        try:
            from distributed import as_completed
        except ImportError as error:
            raise ClusterError(
                f"--scheduler {self.scheduler}: dask.distributed is not installed; "
                "python -m pip install 'brdf-fitting[dask]'"
            ) from error
        with ExitStack() as stack:
            client = self._connected(stack, retries)
            task = _Task(work)
            run, keys = uuid.uuid4().hex, list(items)
            names = [f"brdf-{key}-{run}" for key in keys]
            futures = client.map(task, list(items.values()), key=names, pure=False)
            # Workers that run on are told to forget what nobody waits for.
            stack.callback(lambda: client.cancel(list(key_of), force=True))
            key_of = dict(zip(futures, keys, strict=True))
            tries = dict.fromkeys(keys, 1)
            ended = as_completed(futures)
            for future in ended:
                key = key_of.pop(future)
                answer = self._answer(future)
                if answer.outcome == "again" and tries[key] <= retries:
                    tries[key] += 1
                    name = f"brdf-{key}-{run}-{tries[key]}"
                    again = client.submit(task, items[key], key=name, pure=False)
                    key_of[again] = key
                    ended.add(again)
                    continue
                reason = answer.reason
                if reason is not None:
                    reason = gave_up(reason, tries[key])
                yield Done(key, answer.value, reason, tries[key])

    def _answer(self, future: Any) -> Try:
        import asyncio

        from distributed import KilledWorker

        error = None if future.cancelled() else future.exception()
        if future.cancelled() or isinstance(error, asyncio.CancelledError):
            raise ClusterError(f"the scheduler {self.scheduler} does not answer any more")
        if isinstance(error, KilledWorker):
            died = error.allowed_failures + 1
            return Try("failed", reason=f"{died} workers died in turn while they did it")
        if error is not None:
            text = " ".join(str(error).split())[:200]
            return Try("failed", reason=f"a worker could not run it: {text}")
        return future.result()

    def _connected(self, stack: ExitStack, retries: int) -> Any:
        from dask import config
        from distributed import Client, LocalCluster

        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        address = self.scheduler
        if self.scheduler == LOCAL:
            stack.enter_context(
                config.set({"distributed.scheduler.allowed-failures": retries})
            )
            address = stack.enter_context(
                LocalCluster(
                    n_workers=self.workers, threads_per_worker=1, processes=True,
                    dashboard_address=_NO_DASHBOARD, silence_logs=logging.CRITICAL,
                )
            )  # fmt: skip
        try:
            client = stack.enter_context(Client(address, timeout=_CONNECT_S))
        except (OSError, ValueError) as error:
            raise ClusterError(
                f"--scheduler {self.scheduler}: no dask scheduler answers there "
                f"({' '.join(str(error).split())[:120]}); expected an address such as "
                "tcp://host:8786, or local"
            ) from error
        if not client.scheduler_info()["workers"]:
            self.say(f"{self.scheduler} has no workers yet: waiting for the first")
        return client


@dataclass(frozen=True)
class _Task:
    """One try in a worker of dask, which shares its machine with others like it."""

    work: Work

    def __call__(self, item: Any) -> Try:
        from distributed import get_worker

        limit_threads(get_worker().state.nthreads)
        return attempt(self.work, item)
