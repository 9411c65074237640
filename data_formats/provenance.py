"""Where a measurement comes from, and what its reader has to say about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Note:
    """Something that a reader noticed, repaired, masked or guessed.

    **Arguments:**

    - `code`: a stable kebab-case name for programs, such as `"degrees-converted"`.
    - `sentence`: the same for people.
    - `count`: how many rows or values are concerned; 0 where counting makes no sense.
    """

    code: str
    sentence: str
    count: int = 0


@dataclass(frozen=True)
class Provenance:
    """Where a measurement comes from. Text is `""` where unknown.

    **Arguments:**

    - `path`: the file as it was named to the reader.
    - `sha256`: of the file's bytes, before any decompression.
    - `format`: `NAME` of the format that read it.
    - `instrument`, `sample`, `date`: as stated in the file.
    - `header`: every header field of the file.
    """

    path: str = ""
    sha256: str = ""
    format: str = ""
    instrument: str = ""
    sample: str = ""
    date: str = ""
    header: Mapping[str, str] = field(default_factory=dict)


def one_line(text: str) -> str:
    """Text without line breaks and characters that cannot be printed."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
