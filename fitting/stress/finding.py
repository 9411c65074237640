"""The answer of one contract."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """Whether a contract holds: the worst number met, where, and a sentence on it."""

    name: str
    passed: bool
    worst: float
    where: str
    sentence: str

    def __str__(self) -> str:
        word = "ok    " if self.passed else "FAILED"
        at = f"; worst at {self.where}" if self.where and not self.passed else ""
        return f"{word} {self.name}: {self.sentence}{at}"
