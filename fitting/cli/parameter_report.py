"""Parameters with their uncertainties, as tables."""

from __future__ import annotations

from rich.console import Console

from fitting.cli.terminal import table
from fitting.quantities import number, shown_channels, with_uncertainty
from fitting.result import FitResult, ParameterResult

_COLUMN = 19


def show(out: Console, result: FitResult, everything: bool = False) -> None:
    """One table of what all channels share, one of what each has, by channel."""
    shared = [p for p in result.parameters if _is_shared(p, result)]
    each = [p for p in result.parameters if not _is_shared(p, result)]
    if shared:
        rows = table("parameter", "value", "unit", "meaning", left=4)
        for p in shared:
            rows.add_row(p.name, _cell(p, 0), p.unit, p.meaning)
        out.print(rows)
    if not each:
        return
    if shared:
        out.print()
    channels = [c.name for c in result.channels]
    shown = shown_channels(len(channels), everything)
    at_once = max(1, (out.width - 10) // _COLUMN)
    for first in range(0, len(each), at_once):
        part = each[first : first + at_once]
        rows = table("channel", *(p.name for p in part))
        for c in shown:
            rows.add_row(channels[c], *(_cell(p, c) for p in part))
        if first:
            out.print()
        out.print(rows)
    units = sorted({p.unit for p in each if p.unit != "1"})
    said = "value ± standard uncertainty (k = 1)"
    if units:
        said += f"; {', '.join(f'{p.name} in {p.unit}' for p in each if p.unit != '1')}"
    if len(shown) < len(channels):
        said += f"; {len(shown)} of {len(channels)} channels, all are in the JSON (or -v)"
    out.print(said, style="dim")


def _is_shared(p: ParameterResult, result: FitResult) -> bool:
    return p.kind == "shape" and (len(p.value) == 1 < len(result.channels) or (
        len(p.value) == 1 and not result.settings.per_channel_shape
    ))  # fmt: skip


def _cell(p: ParameterResult, channel: int) -> str:
    c = channel if len(p.value) > 1 else 0
    value = p.value[c]
    if p.fixed:
        return f"{number(value)} fixed"
    if p.at_bound[c]:
        return f"{number(value)} at bound"
    text = with_uncertainty(value, p.standard_uncertainty[c])
    return f"{text} tied" if p.tied_to else text
