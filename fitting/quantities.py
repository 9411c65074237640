"""Numbers for people."""

from __future__ import annotations

import math
from collections.abc import Sequence

_FEW_CHANNELS = 6
_EVERY = 5
_MOST_LINES = 12


def with_uncertainty(value: float, uncertainty: float | None) -> str:
    """``0.1234 ± 0.0012``, rounded to the second digit of the uncertainty."""
    if uncertainty is None or not uncertainty > 0 or not math.isfinite(uncertainty):
        return number(value)
    exponent = int(f"{uncertainty:.1e}".partition("e")[2])
    top = math.floor(math.log10(max(abs(value), uncertainty)))
    if exponent > 4 or exponent < -6:
        digits = max(top - exponent + 1, 0)
        scale = 10.0**top
        return f"({value / scale:.{digits}f} ± {uncertainty / scale:.{digits}f})e{top:+03d}"
    digits = 1 - exponent
    shown = max(digits, 0)
    return f"{round(value, digits):.{shown}f} ± {round(uncertainty, digits):.{shown}f}"


def number(value: float | None, digits: int = 4) -> str:
    """A number to some digits; a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}g}"


def percent(share: float) -> str:
    """``12.3 %``, to two digits below 10 %."""
    value = 100.0 * share
    if abs(value) >= 1000:
        return f"{value:.3g} %"
    return f"{value:.0f} %" if abs(value) >= 10 else f"{value:.2g} %"


def valid_share(share: float) -> str:
    """A share of valid values, which is 100 % only if not one is missing."""
    if 0.99 < share < 1.0:
        return "99 %" if share < 0.995 else f"{min(100.0 * share, 99.99):.2f} %"
    return percent(share)


def degrees(value: float) -> str:
    """An angle in degrees with at most one decimal, and no ``-0``."""
    return f"{round(value, 1) + 0.0:g}"


def count(n: int, noun: str) -> str:
    """``1 row``, ``2 rows``."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def shown_channels(n: int, everything: bool = False) -> list[int]:
    """Which channels a table shows: all of a few, or else every fifth and the last."""
    if everything or n <= _FEW_CHANNELS + 1:
        return list(range(n))
    step = max(_EVERY, math.ceil(n / _MOST_LINES))
    return sorted({*range(0, n, step), n - 1})


def channel_span(names: Sequence[str]) -> str:
    """``7 channels (400 nm ... 700 nm)``, or all names of a few."""
    listed = ", ".join(names) if len(names) <= 4 else f"{names[0]} ... {names[-1]}"
    return f"{count(len(names), 'channel')} ({listed})"
