"""Fits in threads: JAX compiles, loads and computes outside of Python's lock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import jax

from fitting.batch.threads import allowed

_T = TypeVar("_T")
# Measured values; of more, the arrays of a fit are long enough to keep all cores busy, and
# too large to have several times.
_FEW = 2_000_000


def side_by_side(jobs: Sequence[Callable[[], _T]], n_values: int) -> list[_T]:
    """What jobs on so many measured values return, in their order.

    Results do not depend on whether they run side by side. The first error in the order of
    the jobs is raised; jobs that have not begun then never do.
    """
    workers = min(allowed(), len(jobs)) if n_values <= _FEW else 1
    if jax.config.jax_default_device is not None:  # pyright: ignore
        # Which threads would not know of.
        workers = 1
    if workers <= 1:
        return [job() for job in jobs]
    pool = ThreadPoolExecutor(workers)
    try:
        return [future.result() for future in [pool.submit(job) for job in jobs]]
    finally:
        # Not waiting, so that an error or an interruption is told at once; what has begun
        # goes on in a program that does.
        pool.shutdown(wait=False, cancel_futures=True)
