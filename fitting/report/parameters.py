"""Parameters with their uncertainties, as tables."""

from __future__ import annotations

from collections.abc import Sequence

from fitting.quantities import number, with_uncertainty
from fitting.report.blocks import Block, Table, Words
from fitting.result import FitResult, ParameterResult

# Columns of values per channel that fit on a page.
_AT_ONCE = 5


def tables(result: FitResult, prefix: str) -> list[Block]:
    """What all parameters are; those of one value; then those of each channel.

    ``prefix`` makes the ids of the tables those of this result.
    """
    one = [p for p in result.parameters if len(p.value) == 1]
    each = [p for p in result.parameters if len(p.value) > 1]
    channels = [c.name for c in result.channels]
    where = "for all channels" if len(channels) > 1 else f"at {channels[0]}"
    out: list[Block] = [
        Words(
            "Value ± standard uncertainty (k = 1), "
            f"by {result.uncertainty_method}. Intervals are of 95 %."
        )
    ]
    if one:
        rows = [
            (p.name, cell(p, 0), _interval(p), p.unit, _range(p), p.meaning) for p in one
        ]
        columns = ("parameter", "value", "interval", "unit", "range", "meaning")
        out.append(Table(f"{prefix}one", f"Parameters {where}", columns, rows, columns[2:]))
    for first in range(0, len(each), _AT_ONCE):
        part = each[first : first + _AT_ONCE]
        rows = [(name, *(cell(p, c) for p in part)) for c, name in enumerate(channels)]
        names = ("channel", *(_head(p) for p in part))
        title = f"Parameters of each channel: {', '.join(p.name for p in part)}"
        out.append(Table(f"{prefix}each{first}", title, names, rows))
    if each:
        rows = [(p.name, p.unit, _range(p), _state(p), p.meaning) for p in each]
        columns = ("parameter", "unit", "range", "state", "meaning")
        title = "What the parameters of each channel are"
        out.append(Table(f"{prefix}are", title, columns, rows, columns))
    return out


def cell(p: ParameterResult, channel: int) -> str:
    """``0.1234 ± 0.0012``, or the value and why it has no uncertainty."""
    value = p.value[channel]
    if p.fixed:
        return f"{number(value)} (fixed)"
    if p.at_bound[channel]:
        return f"{number(value)} (at bound)"
    uncertainty = p.standard_uncertainty[channel]
    text = with_uncertainty(value, uncertainty)
    if p.tied_to:
        return f"{text} (tied to {p.tied_to})"
    return text if uncertainty is not None else f"{text} (not determined)"


def _head(p: ParameterResult) -> str:
    return p.name if p.unit == "1" else f"{p.name} / {p.unit}"


def _interval(p: ParameterResult) -> str:
    found = p.interval_95[0]
    return "-" if found is None else f"{number(found[0])} to {number(found[1])}"


def _range(p: ParameterResult) -> str:
    low, high = p.support
    if low is None or high is None:
        ends = [f"from {number(low)}"] if low is not None else []
        ends += [f"to {number(high)}"] if high is not None else []
        return " ".join(ends) or "any"
    return f"{number(low)} to {number(high)}"


def _state(p: ParameterResult) -> str:
    if p.fixed:
        return "fixed"
    if p.tied_to:
        return f"tied to {p.tied_to}"
    return "free" + _at_bound(p.at_bound)


def _at_bound(at_bound: Sequence[bool]) -> str:
    n = sum(at_bound)
    if not n:
        return ""
    return ", at bound in " + ("every channel" if n == len(at_bound) else f"{n} channels")
