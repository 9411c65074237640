"""Progress of work whose amount is known: a bar with the time that remains, on stderr."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

# Steps may take minutes each, and speed is forgotten after 30 s unless told.
_WHOLE_RUN_S = 86_400.0


class Work:
    """A bar on a terminal, one line per thing that is done elsewhere.

    A context manager; call `at` with what is being done and how far it is.
    """

    def __init__(self, console: Console, total: int, *, quiet: bool):
        self._console = console
        self._quiet = quiet
        self._subject = ""
        self._progress = None
        if console.is_terminal and not quiet:
            self._progress = Progress(
                TextColumn("{task.description}", markup=False),
                BarColumn(bar_width=20),
                TimeRemainingColumn(),
                console=console,
                transient=True,
                speed_estimate_period=_WHOLE_RUN_S,
            )
            self._task = self._progress.add_task("starting", total=total)

    def __enter__(self) -> Work:
        if self._progress is not None:
            self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._progress is not None:
            self._progress.stop()

    def at(self, what: str, least: int, more: int) -> None:
        """What is done now; how much was done before it at least; how much was added."""
        subject = what.partition(":")[0]
        if self._progress is not None:
            done = self._progress.tasks[self._task].completed
            self._progress.update(
                self._task, description=what, completed=max(done, least) + more
            )
        elif not self._quiet and subject != self._subject:
            self._console.print(subject)
        self._subject = subject
