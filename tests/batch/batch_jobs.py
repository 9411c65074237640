"""Work for engines, in a module that other processes can import and that loads quickly."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from fitting.batch.turns import first_of
from fitting.batch.writing import replace_file


@dataclass(frozen=True)
class Square:
    """Writes the square of a number, and a line for every time that it was asked to."""

    folder: Path

    def __call__(self, number: int) -> int:
        with (self.folder / f"{number}.calls").open("a") as file:
            file.write(f"{os.getpid()}\n")
        replace_file(self.folder / f"{number}.txt", str(number**2).encode())
        return number**2

    def calls(self, number: int) -> int:
        return len((self.folder / f"{number}.calls").read_text().splitlines())


@dataclass(frozen=True)
class Troubled:
    """Squares, but for the numbers with which something is wrong."""

    square: Square
    kills_once: frozenset[int] = frozenset()
    kills_always: frozenset[int] = frozenset()
    storage_once: frozenset[int] = frozenset()
    storage_always: frozenset[int] = frozenset()
    is_a_bug: frozenset[int] = frozenset()

    def __call__(self, number: int) -> int:
        done = self.square(number)
        first = self.square.calls(number) == 1
        if number in self.kills_always or (number in self.kills_once and first):
            os.kill(os.getpid(), signal.SIGKILL)
        if number in self.storage_always or (number in self.storage_once and first):
            raise OSError(116, "Stale file handle", "/net/paint.astm")
        if number in self.is_a_bug:
            raise ZeroDivisionError("a bug")
        return done


@dataclass(frozen=True)
class Slow:
    """Squares after some seconds."""

    square: Square
    seconds: float

    def __call__(self, number: int) -> int:
        time.sleep(self.seconds)
        return self.square(number)


class Unloadable:
    """Work that no other process can load."""

    def __reduce__(self):
        return os._exit, (3,)

    def __call__(self, number: int) -> int:
        raise AssertionError(number)


@dataclass(frozen=True)
class Compile:
    """Something that one process is to do first; writes down when it was at it."""

    folder: Path
    kills_once: bool = False

    def __call__(self, number: int) -> tuple[float, float]:
        with first_of("the same", self.folder):
            begin = time.monotonic()
            killed = self.folder / "killed"
            if self.kills_once and not killed.exists():
                killed.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            time.sleep(0.2)
            return begin, time.monotonic()
