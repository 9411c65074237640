"""One thing that can be had cheaper inside a model, setting by setting."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import msgspec

from fitting.quantities import number, percent
from fitting.tradeoff.timing import Spread

# An error this much above the reference's is no loss that anybody could see in the data.
_SAME_ERROR = 1.01
# A deviation of a tenth of the noise adds 0.5 % to it; without a known noise, 0.1 %.
_SHARE_OF_NOISE = 0.1
_DEVIATION_WITHOUT_NOISE = 1e-3


class NotPossible(ValueError):
    """Why something cannot be varied with these data or this model, as a sentence."""


class Trade(msgspec.Struct, frozen=True):
    """One setting of what is varied, with its cost and its error, and the reference's.

    ``seconds`` are of what ``cost_of`` names, on this machine; ``work`` counts in
    ``work_unit`` and does not depend on it. ``error`` is what ``error_of`` names: the
    objective of a fit, or a typical relative deviation from the reference's values
    (``deviation``), whose largest is ``worst``. Relative costs and errors are over those of
    the setting ``reference``; of a deviation the reference has none, and no ratio.
    """

    varied: str
    setting: str
    reference: str
    cost_of: str
    seconds: Spread | None
    work: float
    work_unit: str
    error_of: str
    error: float
    worst: float | None
    deviation: bool
    relative_seconds: float | None
    relative_work: float | None
    relative_error: float | None


class Setting(NamedTuple):
    """What was measured with one setting."""

    name: str
    seconds: Spread | None
    work: float
    error: float
    worst: float | None = None


def trades(
    varied: str,
    settings: Sequence[Setting],
    *,
    cost_of: str,
    work_unit: str,
    error_of: str,
    deviation: bool,
) -> list[Trade]:
    """Settings as trades against the first of them, which is the reference."""
    first = settings[0]
    return [
        Trade(
            varied=varied,
            setting=s.name,
            reference=first.name,
            cost_of=cost_of,
            seconds=s.seconds,
            work=s.work,
            work_unit=work_unit,
            error_of=error_of,
            error=s.error,
            worst=s.worst,
            deviation=deviation,
            relative_seconds=_ratio(_median(s), _median(first)),
            relative_work=_ratio(s.work, first.work),
            relative_error=None if deviation else _ratio(s.error, first.error),
        )
        for s in settings
    ]


def enough(group: Sequence[Trade], noise: float | None) -> str:
    """Which setting of one group is the cheapest that loses nothing, as a sentence.

    ``noise`` is the relative standard deviation of a value of the data, if known.
    """
    most = _DEVIATION_WITHOUT_NOISE if noise is None else _SHARE_OF_NOISE * noise
    good = [t for t in group if _is_enough(t, most)]
    best = min(good, key=_price)
    if best.setting == best.reference:
        if len(good) > 1:
            return f"{best.varied}: what is as good as {best.reference} costs no less"
        limit = "0.1 %" if noise is None else f"a tenth of the noise, {percent(most)}"
        loses = f"deviates by more than {limit}" if best.deviation else "loses accuracy"
        return f"{best.varied}: nothing replaces {best.reference}: all else {loses}"
    costs: list[str] = []
    if best.relative_work is not None and not _alike(best.relative_work, 1.0):
        costs.append(f"{best.relative_work:.2g} times the {best.work_unit}")
    if best.relative_seconds is not None:
        costs.append(f"{best.relative_seconds:.2g} times the time")
    error = f"{number(best.relative_error, 4)} times the error"
    if best.deviation:
        error = f"off by at most {percent(best.worst or best.error)}"
        if noise is not None:
            error += f", where the noise is {percent(noise)}"
    elif best.relative_error is not None and _alike(best.relative_error, 1.0, 5e-4):
        error = "the same error"
    return (
        f"{best.varied}: {best.setting} will do in place of {best.reference}: "
        f"{' and '.join(costs)}, {error}"
    )


def _is_enough(trade: Trade, most: float) -> bool:
    if trade.setting == trade.reference:
        return True
    if trade.deviation:
        return (trade.error if trade.worst is None else trade.worst) <= most
    return trade.relative_error is not None and trade.relative_error <= _SAME_ERROR


def _price(trade: Trade) -> tuple[float, float]:
    """By what does not depend on the machine; only what is equal in that by the clock."""
    work = 1.0 if trade.relative_work is None else round(trade.relative_work, 2)
    return work, 1.0 if trade.relative_seconds is None else trade.relative_seconds


def _alike(a: float, b: float, within: float = 0.005) -> bool:
    return abs(a - b) < within


def _median(setting: Setting) -> float | None:
    return None if setting.seconds is None else setting.seconds.median


def _ratio(value: float | None, reference: float | None) -> float | None:
    if value is None or not reference:
        return None
    return value / reference
