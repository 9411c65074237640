"""What runs in a worker process: one item after the other, until nobody asks any more."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
from multiprocessing.connection import Connection, wait

from fitting.batch.engine import Work, attempt
from fitting.batch.threads import limit_threads

READY = "ready"
# JAX makes many objects that stay; looking through them again and again takes a tenth of
# the time before the first result.
_RARELY = (100_000, 20, 20)


def serve(pipe: Connection, work: Work, threads: int) -> None:
    """Answer every item that comes through the pipe with a `Try`.

    Interrupts are the parent's business; without a parent there is nothing to do.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _end_with_the_parent()
    limit_threads(threads)
    gc.set_threshold(*_RARELY)
    pipe.send(READY)
    while True:
        try:
            item = pipe.recv()
        except EOFError:
            return
        pipe.send(attempt(work, item))


def _end_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        wait([parent.sentinel])
        # Nobody may find this item undone and do it again while this process still does.
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
