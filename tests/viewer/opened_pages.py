"""A page in the browser of the tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Opened:
    """A page, with what it said and asked for since it was opened."""

    page: Any
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def run(self, script: str, argument: object = None) -> Any:
        """What a function in the page returns."""
        return self.page.evaluate(script, argument)


Open = Callable[..., Opened]
