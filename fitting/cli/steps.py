"""Progress of long work on stderr: a spinner on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class Steps:
    """Says which models are being fitted and what is done with them.

    A context manager; so is `of` a model, which gives a function to call with what is done.
    Models may be fitted side by side.
    """

    def __init__(self, console: Console, total: int, *, quiet: bool, verbose: bool):
        self._console = console
        self._total = total
        self._quiet = quiet
        self._verbose = verbose
        self._begun = 0
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

    @contextmanager
    def of(self, model: str) -> Iterator[Callable[[str], None]]:
        """A model's turn: call what this gives with what is done with the model now."""
        self._begun += 1
        if self._progress is None and not self._quiet:
            self._console.print(f"fitting {model} ({self._begun} of {self._total})")
        first = True

        def say(what: str) -> None:
            nonlocal first
            what += " (compiling first, unless it was before)" if first else ""
            first = False
            self._say(model, what)

        yield say
        if self._progress is not None and self._task is not None:
            self._progress.advance(self._task)

    def _say(self, model: str, what: str) -> None:
        if self._verbose and not self._quiet:
            elapsed = time.monotonic() - self._start
            self._console.print(f"{elapsed:7.1f} s  {model}: {what}", style="dim")
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, description=f"{model}: {what}")


def _bar(console: Console) -> Progress:
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=12),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
