"""Text files in which every line is counted: a number of things, then as many of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from data_formats.measurement import MeasurementError
from data_formats.token_stream import number_or_none


@dataclass
class CountedLines:
    """The lines of a file, read from the first to the last.

    **Arguments:**

    - `path`: named in errors.
    - `lines`: all of them.
    - `index`: of the next line.
    """

    path: str
    lines: Sequence[str]
    index: int = 0

    @property
    def where(self) -> str:
        """File and line of the line read last."""
        return f"{self.path}, line {self.index}"

    def text(self, what: str) -> str:
        """The next line, which is `what`.

        **Raises:** `MeasurementError` at the end of the file.
        """
        if self.index >= len(self.lines):
            raise MeasurementError(
                f"{self.path}: the file ends where {what} is expected; is it cut short?"
            )
        self.index += 1
        return self.lines[self.index - 1]

    def numbers(self, what: str, count: int | None = None) -> list[float]:
        """The numbers of the next line, `count` of them.

        **Raises:** `MeasurementError` if there are more or fewer, or other words.
        """
        words = self.text(what).split()
        found = [x for w in words if (x := number_or_none(w)) is not None]
        if len(found) < len(words) or not words or len(words) != (count or len(words)):
            shown = " ".join(words)[:40]
            number = "numbers" if count is None else f"{count} numbers"
            raise MeasurementError(
                f"{self.where}: found {len(words)} words, {shown!r}; expected {what}, "
                f"{number}"
            )
        return found

    def counts(self, what: str, count: int = 1) -> list[int]:
        """The whole numbers of the next line.

        **Raises:** `MeasurementError` if one is not from 1 to a million.
        """
        found = self.numbers(what, count)
        if not all(x == x // 1 and 1 <= x <= 1e6 for x in found):
            raise MeasurementError(
                f"{self.where}: {what} is {found}; expected whole numbers from 1 to 1000000"
            )
        return [int(x) for x in found]

    def angles(self, what: str, count: int, most: float) -> list[float]:
        """The angles of the next line, in degrees.

        **Raises:** `MeasurementError` if one is larger than `most`.
        """
        found = self.numbers(what, count)
        if not all(abs(x) <= most for x in found):
            raise MeasurementError(
                f"{self.where}: {what} from {min(found):g} to {max(found):g}; expected at "
                f"most {most:g} degrees"
            )
        return found

    def expect_end(self) -> None:
        """Nothing but blank lines, and one that says that this is the end.

        **Raises:** `MeasurementError` if there is more.
        """
        for number, line in enumerate(self.lines[self.index :], self.index + 1):
            text = line.strip()
            if text and text.lower() != "end of file":
                raise MeasurementError(
                    f"{self.path}, line {number}: found {text[:30]!r} after the last "
                    "table; expected the end of the file"
                )
