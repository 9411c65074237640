"""One item after the other in this process: the reference, and for debugging."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any

from fitting.batch.engine import Done, Work, attempt, gave_up


@dataclass(frozen=True)
class Serial:
    """No worker but this process: an item that crashes takes everything with it."""

    described: str = "this process alone"

    def run(
        self, work: Work, items: Mapping[str, Any], *, retries: int
    ) -> Generator[Done, None, None]:
        """Yield a `Done` for every item, in order."""
        for key, item in items.items():
            yield _one(work, key, item, retries)


def _one(work: Work, key: str, item: Any, retries: int) -> Done:
    tries = 1
    while (tried := attempt(work, item)).outcome == "again" and tries <= retries:
        tries += 1
    reason = tried.reason
    return Done(key, tried.value, None if reason is None else gave_up(reason, tries), tries)
