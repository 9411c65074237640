"""What sections of a report are made of; ``kind`` names the macro that renders a block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Words:
    """A paragraph."""

    kind: ClassVar = "words"
    text: str


@dataclass(frozen=True)
class Bullets:
    """Sentences of a list."""

    kind: ClassVar = "bullets"
    items: Sequence[str]


@dataclass(frozen=True)
class Terms:
    """Names and what stands for them; ``large`` for the figures that matter most."""

    kind: ClassVar = "terms"
    items: Sequence[tuple[str, str]]
    large: bool = False


@dataclass(frozen=True)
class Table:
    """Cells as text; the first of a row is its head.

    Columns named in ``words`` are no numbers; ``marked`` is the row that matters most.
    """

    kind: ClassVar = "table"
    id: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[str] = ()
    marked: int | None = None

    @property
    def wide(self) -> bool:
        """Whether it may have to scroll on a phone."""
        return len(self.columns) > 3


@dataclass(frozen=True)
class Command:
    """A line for the shell."""

    kind: ClassVar = "command"
    text: str


@dataclass(frozen=True)
class Picture:
    """A figure as a data URI of ``width`` by ``height`` px, with what it shows in words.

    ``alternative`` tells the main number to those who do not see it.
    """

    kind: ClassVar = "picture"
    id: str
    uri: str
    width: int
    height: int
    caption: str
    alternative: str


@dataclass(frozen=True)
class Folded:
    """Blocks that are closed at first, and open in print."""

    kind: ClassVar = "folded"
    summary: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Embedded:
    """HTML of this program, as it is."""

    kind: ClassVar = "embedded"
    html: str


@dataclass(frozen=True)
class Verdict:
    """The first sentence of a verdict."""

    kind: ClassVar = "verdict"
    level: str
    headline: str


Block = Words | Bullets | Terms | Table | Command | Picture | Folded | Embedded | Verdict


@dataclass(frozen=True)
class Section:
    """A heading and what follows; none if there are no blocks."""

    id: str
    title: str
    blocks: Sequence[Block]
