"""Progress of long work on stderr: a spinner on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class Steps:
    """Says which model is being fitted and what is done with it.

    A context manager; `begin` a model, then call `say` with what is being done.
    """

    def __init__(self, console: Console, total: int, *, quiet: bool, verbose: bool):
        self._console = console
        self._total = total
        self._quiet = quiet
        self._verbose = verbose
        self._done = 0
        self._model = ""
        self._first = True
        self._start = time.monotonic()
        live = console.is_terminal and not quiet
        self._progress = _bar(console) if live else None
        self._task = None
        if self._progress is not None:
            self._task = self._progress.add_task("starting", total=total)

    def __enter__(self) -> Steps:
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

    def begin(self, model: str) -> None:
        """A model's turn."""
        self._model, self._first = model, True
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, completed=self._done)
        elif not self._quiet:
            self._console.print(f"fitting {model} ({self._done + 1} of {self._total})")
        self._done += 1

    def say(self, what: str) -> None:
        """What is done with the model now."""
        if self._first:
            what += " (compiling, once per model)"
            self._first = False
        if self._verbose and not self._quiet:
            elapsed = time.monotonic() - self._start
            self._console.print(f"{elapsed:7.1f} s  {self._model}: {what}", style="dim")
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, description=f"{self._model}: {what}")


def _bar(console: Console) -> Progress:
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=12),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
