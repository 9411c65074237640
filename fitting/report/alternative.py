"""The main number of every figure, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fitting import physics
from fitting.quantities import channel_span, degrees, number, percent, with_uncertainty
from fitting.result import FitResult

_MOST = 6


def in_words(figure: str, label: str, result: FitResult) -> str:
    """What somebody who sees the figure takes home; ``label`` is the figure's own."""
    if figure == "slices":
        off = result.typical_deviation
        text = f"{result.model} in the plane of incidence"
        return text if off is None else f"{text}, typically {percent(off)} off the data"
    if figure == "residuals":
        return _residuals(result)
    if figure == "albedo":
        return _capital(physics.of_fit(result)[0])
    if figure == "spectrum":
        return _spectrum(result)
    if figure == "correlations":
        return _correlation(result)
    if figure == "starts":
        return f"The search {result.solver.sentence}"
    if figure in ("sphere", "patch"):
        return label
    if figure in ("lobe", "beta"):
        return _widths(result)
    return (
        f"The RMS difference of {result.model} and the data is {number(result.scores.l2)} "
        "per sr"
    )


def _residuals(result: FitResult) -> str:
    worst = max(result.by_angle, key=lambda a: a.objective)
    text = (
        f"The error is largest at theta_i = {degrees(worst.theta_i_deg)} deg, with an RMS "
        f"of {number(worst.objective, 3)} ({result.settings.objective})"
    )
    shares = [(c.relative_rms, c.channel) for c in result.by_channel if c.relative_rms]
    if len(result.channels) > 1 and shares:
        share, channel = max(shares)
        text += f"; by channel at {channel}, with {percent(share)} of the data's RMS"
    return text


def _spectrum(result: FitResult) -> str:
    spans = [
        f"{p.name} lies between {number(min(p.value), 3)} and {number(max(p.value), 3)}"
        for p in result.parameters
        if len(p.value) > 1 and not p.fixed
    ]
    what = channel_span([c.name for c in result.channels])
    return _few(f"Over {what}", spans)


def _widths(result: FitResult) -> str:
    widths = [
        f"{p.name} is {with_uncertainty(p.value[0], p.standard_uncertainty[0])}"
        for p in result.parameters
        if p.kind == "shape" and len(p.value) == 1
    ]
    return _few(f"The lobes of {result.model}", widths)


def _few(begin: str, items: list[str]) -> str:
    more = f", and {len(items) - _MOST} more" if len(items) > _MOST else ""
    return begin + (": " if items else "") + ", ".join(items[:_MOST]) + more


def _correlation(result: FitResult) -> str:
    largest = max(_pairs(result), key=lambda found: abs(found[0]), default=None)
    if largest is None:
        return "There are no two free parameters that could be correlated"
    r, one, other, channel = largest
    return f"The strongest correlation is {r:.3f}, of {one} with {other} ({channel})"


def _pairs(result: FitResult) -> Iterator[tuple[float, str, str, str]]:
    names = result.correlations.names
    # One matrix may stand for all channels.
    channels = zip(result.channels, result.correlations.matrices, strict=False)
    for channel, matrix in channels:
        for i, row in enumerate(matrix):
            for j, r in enumerate(row[:i]):
                if r is not None and math.isfinite(r):
                    yield r, names[i], names[j], channel.name


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
