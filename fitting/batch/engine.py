"""What all engines have in common: the answer for an item, and one try at it."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

Work = Callable[[Any], Any]


@dataclass(frozen=True)
class Done:
    """How an item ended.

    ``value`` is what the work gave back; where it did not, ``reason`` is a sentence that
    says why. ``tries`` counts the attempts.
    """

    key: str
    value: Any
    reason: str | None
    tries: int


class Engine(Protocol):
    """Applies a function to many items; see `fitting.batch` for the contract."""

    @property
    def described(self) -> str:
        """Who works, in a few words."""
        ...

    def run(
        self, work: Work, items: Mapping[str, Any], *, retries: int
    ) -> Generator[Done, None, None]:
        """Yield a `Done` for every item as it ends."""
        ...


@dataclass(frozen=True)
class Try:
    """The answer to one attempt: a value, or why there is none and whether to try again."""

    outcome: Literal["value", "again", "failed"]
    value: Any = None
    reason: str | None = None


def attempt(work: Work, item: Any) -> Try:
    """Do the work once. Storage that does not answer may answer later; a bug stays one."""
    try:
        return Try("value", work(item))
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        return Try("again", reason=f"{name}{error.strerror or error}")
    except Exception as error:  # One item, whatever is wrong with it, stops no other.
        text = " ".join(str(error).split())[:200]
        return Try("failed", reason=f"internal error ({type(error).__name__}: {text})")


def gave_up(reason: str, tries: int) -> str:
    """The reason, with how often it was the same."""
    return reason if tries == 1 else f"{reason} (tried {tries} times)"
