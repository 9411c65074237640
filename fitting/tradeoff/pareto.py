"""Which of some candidates are worth their price, and what dominates the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

# Of two costs or errors that differ by less neither counts as the smaller.
_SAME = 1e-9


class Standing(NamedTuple):
    """Whether a candidate is on the front, and else the index of one that dominates it."""

    on_front: bool
    dominated_by: int | None


def standings(points: Sequence[tuple[float, float] | None]) -> list[Standing]:
    """Of points (cost, error), both better when smaller; None for what has no error.

    A point is dominated if another is no dearer and no worse, and one of the two less;
    the one that is named is the most accurate such, and of those the cheapest. Equal points
    are all on the front.
    """
    out: list[Standing] = []
    for i, own in enumerate(points):
        if own is None:
            out.append(Standing(False, None))
            continue
        better = [
            (other[1], other[0], j)
            for j, other in enumerate(points)
            if j != i and other is not None and _dominates(other, own)
        ]
        out.append(Standing(not better, min(better)[2] if better else None))
    return out


def _dominates(one: tuple[float, float], other: tuple[float, float]) -> bool:
    no_worse = all(a <= b * (1 + _SAME) for a, b in zip(one, other, strict=True))
    less = any(a < b * (1 - _SAME) for a, b in zip(one, other, strict=True))
    return no_worse and less


def domination(
    name: str, other: str, own: tuple[float, float], better: tuple[float, float]
) -> str:
    """The sentence on a dominated candidate, with ``(cost, error)`` of both."""
    cost = better[0] / own[0]
    error = better[1] / own[1] if own[1] > 0 else 1.0
    costs = f"costs {cost:.2g} times as much" if cost < 0.995 else "costs the same"
    makes = f"has {error:.2g} times its error" if error < 0.995 else "has the same error"
    return f"{name} is dominated by {other}, which {costs} and {makes}"


def step_up(
    name: str, cheaper: str, own: tuple[float, float], before: tuple[float, float]
) -> str:
    """The sentence on the next point of the front: what more one pays, and gets."""
    cost, error = own[0] / before[0], own[1] / before[1]
    return (
        f"{name} costs {cost:.2g} times as much as {cheaper}, for {error:.2g} times its "
        "error"
    )
