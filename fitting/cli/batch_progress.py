"""Progress of a batch: a bar with the time that remains, or a line now and then."""

from __future__ import annotations

import time
from datetime import timedelta
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)

from fitting.batch.receipt import Receipt

_LINE_EVERY_S = 10.0
# Files may take minutes each, and speed is forgotten after 30 s unless told.
_WHOLE_RUN_S = 86_400.0


class BatchProgress:
    """Says on stderr how many files are done, which failed, and how long it will take.

    A context manager; call `ended` with every receipt.
    """

    def __init__(self, console: Console, total: int, *, quiet: bool, verbose: bool):
        self._console = console
        self._total = total
        self._quiet = quiet
        self._verbose = verbose
        self._done = 0
        self._failed = 0
        self._start = self._last = time.monotonic()
        self._bar = None
        if console.is_terminal and not quiet:
            self._bar = Progress(
                TextColumn("{task.description}", markup=False),
                BarColumn(bar_width=20),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
                console=console,
                transient=True,
                speed_estimate_period=_WHOLE_RUN_S,
            )
            self._task = self._bar.add_task("starting", total=total)

    def __enter__(self) -> BatchProgress:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def say(self, text: str) -> None:
        """A line for the user."""
        if not self._quiet:
            self._console.print(text, style="dim", soft_wrap=True)

    def ended(self, receipt: Receipt) -> None:
        """One file more, well or not."""
        self._done += 1
        if receipt.status != "done":
            self._failed += 1
            self.say(f"failed: {receipt.path}: {receipt.reason}")
        elif self._verbose:
            self.say(
                f"{receipt.path}: read {receipt.read_s:.2f} s, fit {receipt.fit_s:.2f} s"
            )
        if self._bar is not None:
            self._bar.update(self._task, completed=self._done, description=self._words())
            return
        now = time.monotonic()
        if now - self._last >= _LINE_EVERY_S or self._done == self._total:
            self._last = now
            left = (now - self._start) / self._done * (self._total - self._done)
            about = f", about {timedelta(seconds=round(left))} left" if left else ""
            self.say(f"{self._done} of {self._total} files{about}")

    def _words(self) -> str:
        return "fitting" + (f", {self._failed} failed" if self._failed else "")
