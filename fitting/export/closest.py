"""Which of its own models a target is given: the first that is close, or the closest."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from fitting.export.parts import Lobes
from fitting.export.report import Residual, residual
from fitting.export.surface import Surface
from fitting.models import Way

# Relative RMS of log(1 + f cos) up to which nothing else is tried: each trial is a fit.
CLOSE = 0.05


@dataclass(frozen=True)
class Candidate:
    """What a target could be given: its content, and what the target computes from it.

    ``final`` where nothing else could be closer: what is left is the gamut of colours.
    ``faithful`` as in `Product`.
    """

    name: str
    representation: Lobes
    content: Any
    ways: tuple[Way, ...] = ("front",)
    remarks: tuple[str, ...] = ()
    final: bool = False
    faithful: bool = True


def closest(surface: Surface, candidates: Iterable[Candidate]) -> Candidate:
    """The first candidate within 5 % of the surface, or else the closest one.

    Candidates come one by one, since to make one may take a fit. Those passed over are
    named in the remarks.
    """
    tried: list[tuple[Residual, Candidate]] = []
    for candidate in candidates:
        off = residual(surface, candidate.representation, candidate.ways)
        tried.append((off, candidate))
        if candidate.final or off.relative_rms_log1p <= CLOSE:
            break
    tried.sort(key=lambda item: item[0].relative_rms_log1p)
    best = tried[0][1]
    others = tuple(
        f"{c.name} ({c.representation.words}) was tried as well: {off}"
        for off, c in tried[1:]
    )
    return dataclasses.replace(best, remarks=(*best.remarks, *others))


def ways_left_out(surface: Surface, ways: tuple[Way, ...], target: str) -> tuple[str, ...]:
    """A sentence on light that the model knows and a target does not get."""
    words = {
        "front": "reflection from the front", "back": "reflection from the back",
        "down": "transmission from front to back", "up": "transmission from back to front",
    }  # fmt: skip
    lacking = [words[w] for w in surface.model.ways if w not in ways]
    if not lacking:
        return ()
    return (f"left out, because {target} does not get it: {', '.join(lacking)}",)
