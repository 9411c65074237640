"""Text files that are one stream of words and counted lists, whatever the line breaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import MeasurementError

_SHOWN = 30


@dataclass
class Tokens:
    """The words of a text with their lines, read from the first to the last.

    **Arguments:**

    - `path`: named in errors.
    - `words`: all of them.
    - `line_numbers`: where each stands in the file, from 1.
    - `position`: of the next word.
    """

    path: str
    words: list[str]
    line_numbers: list[int]
    position: int = 0

    @staticmethod
    def of(
        path: str, lines: Sequence[str], first_line: int = 1, *, comment: str = "#"
    ) -> Tokens:
        """The words of lines; what follows `comment` in a line is left out."""
        words: list[str] = []
        numbers: list[int] = []
        for number, line in enumerate(lines, first_line):
            found = (line.partition(comment)[0] if comment else line).split()
            words += found
            numbers += [number] * len(found)
        return Tokens(path, words, numbers)

    def where(self, position: int | None = None) -> str:
        """File and line of a word, or of the next one."""
        at = self.position if position is None else position
        if at < len(self.line_numbers):
            return f"{self.path}, line {self.line_numbers[at]}"
        return f"{self.path}, at its end"

    def peek(self) -> str:
        """The next word; `""` at the end."""
        return self.words[self.position] if self.position < len(self.words) else ""

    def take(self, what: str) -> str:
        """The next word, which is `what`.

        **Raises:** `MeasurementError` at the end of the file.
        """
        word = self.peek()
        if not word:
            raise MeasurementError(
                f"{self.path}: the file ends where {what} is expected; is it cut short?"
            )
        self.position += 1
        return word

    def expect(self, word: str) -> None:
        """Go past a keyword, in whatever case.

        **Raises:** `MeasurementError` if the next word is another.
        """
        where = self.where()
        found = self.take(word)
        if found.lower() != word.lower():
            raise MeasurementError(f"{where}: found {found[:_SHOWN]!r}; expected {word}")

    def count(self, what: str) -> int:
        """A number of things, at least one and not more than words are left.

        **Raises:** `MeasurementError` if the next word is none.
        """
        where = self.where()
        word = self.take(f"the number of {what}")
        left = len(self.words) - self.position
        number = int(word) if word.isascii() and word.isdecimal() and len(word) < 10 else 0
        if not 1 <= number <= left:
            raise MeasurementError(
                f"{where}: found {word[:_SHOWN]!r} as the number of {what}; expected 1 to "
                f"{left}, which is how many words are left"
            )
        return number

    def numbers(self, count: int, what: str) -> NDArray[np.float64]:
        """The next `count` words as numbers.

        **Raises:** `MeasurementError` with the line of the first that is none.
        """
        start = self.position
        words = self.words[start : start + count]
        if len(words) < count:
            raise MeasurementError(
                f"{self.path}: the file ends after {len(words)} of {count} {what}; is it "
                "cut short?"
            )
        numbers = np.array([number_or_none(w) for w in words], dtype=np.float64)
        wrong = np.isnan(numbers)
        if wrong.any():
            for k in np.flatnonzero(wrong).tolist():
                if not words[k].lower().lstrip("+-").startswith("nan"):
                    raise MeasurementError(
                        f"{self.where(start + k)}: found {words[k][:_SHOWN]!r} among "
                        f"{count} {what}; expected a number"
                    )
        self.position += count
        return numbers


def number_or_none(word: str) -> float | None:
    """A number, as `float` reads it; `None` if it is none."""
    try:
        # float() accepts 1_000.
        return None if "_" in word else float(word)
    except ValueError:
        return None
