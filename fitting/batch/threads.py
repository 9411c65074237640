"""How many threads the libraries of a process start, before they are loaded."""

from __future__ import annotations

import os

# Each starts one thread per core, unless told.
_BY_CORE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_XLA = "PJRT_NPROC"
# With a single thread XLA adds up in another order than with two or any more, and results
# would differ in the last bits.
_LEAST_OF_XLA = 2


def cores() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def allowed() -> int:
    """How many threads this process may keep busy: all cores, unless it was limited."""
    told = os.environ.get(_BY_CORE[0], "")
    return min(cores(), int(told)) if told.isdigit() and int(told) else cores()


def limit_threads(threads: int) -> None:
    """So many threads for a process that shares a machine with others like it.

    What the user's environment says counts more.
    """
    for name in _BY_CORE:
        os.environ.setdefault(name, str(threads))
    same_sums(threads)


def same_sums(threads: int) -> None:
    """XLA's part of it, without which results depend on the machine's number of cores."""
    os.environ.setdefault(_XLA, str(max(threads, _LEAST_OF_XLA)))
