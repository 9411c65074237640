"""One process compiles what several need; the others wait and take it from the cache."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def first_of(what: str, cache: Path | None) -> Iterator[None]:
    """Let the first process through that does ``what``, the others when it has done it.

    ``cache`` is the folder of compiled code, with which the memory of it goes. The lock is
    the system's and ends with its process, however that ends. Without a cache, or where
    locks are not to be had, everyone goes through.
    """
    if cache is None:
        yield
        return
    name = hashlib.sha256(what.encode()).hexdigest()[:32]
    done = cache / f"{name}.compiled"
    if done.exists():
        yield
        return
    try:
        handle = _locked(cache / f"{name}.lock")
    except (OSError, ImportError):
        yield
        return
    try:
        if done.exists():
            _let_others(handle)
        yield
        done.touch()
    finally:
        os.close(handle)


def _let_others(handle: int) -> None:
    import fcntl

    fcntl.flock(handle, fcntl.LOCK_UN)


def _locked(path: Path) -> int:
    import fcntl

    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
    except OSError:
        os.close(handle)
        raise
    return handle
