"""Progress of work of a few steps of unknown length: a spinner, or a line per step."""

from __future__ import annotations

import time
from types import TracebackType

from rich.status import Status

from fitting.cli import terminal


class Saying:
    """Says on stderr what is being done; what follows a colon is a detail.

    A context manager that gives the function to call.
    """

    def __init__(self, *, quiet: bool, verbose: bool):
        self._console = terminal.stderr()
        self._quiet = quiet
        self._verbose = verbose
        self._start = time.monotonic()
        live = self._console.is_terminal and not quiet
        self._status = Status("starting", console=self._console) if live else None

    def __enter__(self) -> Saying:
        if self._status is not None:
            self._status.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._status is not None:
            self._status.stop()

    def __call__(self, what: str) -> None:
        detail = ": " in what
        if self._quiet:
            return
        if self._status is not None:
            self._status.update(what)
        if self._verbose:
            elapsed = time.monotonic() - self._start
            self._console.print(f"{elapsed:7.1f} s  {what}", style="dim")
        elif self._status is None and not detail:
            self._console.print(what)
