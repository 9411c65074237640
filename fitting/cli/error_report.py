"""How far a fit is from the data: by objective, by angle of incidence, by channel."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.console import Console

from fitting.cli.terminal import heading, table
from fitting.judge import MEANING
from fitting.quantities import degrees, number, percent, shown_channels
from fitting.result import AngleError, ChannelError, Colour, FitResult, Scores

_MOST_ANGLES = 12
_BIN_DEG = 10.0
_LAST_BIN = int(180.0 / _BIN_DEG) - 1


def show(out: Console, result: FitResult, everything: bool = False) -> None:
    """All errors of a result."""
    scores(out, result.scores, result.settings.objective)
    validation = result.cross_validation
    held = validation.by_angle if validation else []
    angles(out, result.by_angle, held, result.settings.objective)
    if validation:
        out.print(
            f"held-out {result.settings.objective} over all angles: "
            f"{number(validation.objective)}, held-out l2: {number(validation.l2)}",
            style="dim",
        )
    channels(out, result.by_channel, everything)
    if result.colour:
        colour(out, result.colour)


def scores(out: Console, found: Scores, objective: str) -> None:
    """The distance in every objective, the one that the fit makes small marked."""
    out.print(heading("Distance from the data"))
    rows = table("score", "value", "meaning", left=1)
    rows.columns[2].justify = "left"
    for name, meaning in MEANING.items():
        value = getattr(found, name)
        if value is not None:
            minimised = name.removesuffix("_reduced") == objective
            mark = "  <- what the fit makes small" if minimised else ""
            rows.add_row(name, number(value), meaning + mark)
    out.print(rows)


def angles(
    out: Console, fitted: Sequence[AngleError], held: Sequence[AngleError], objective: str
) -> None:
    """Errors by angle of incidence, fitted and held out."""
    out.print(heading("Errors by angle of incidence"))
    fitted_lines, held_lines = _lines(fitted), _lines(held)
    names = [objective, "l2"] + ([f"held-out {objective}", "held-out l2"] if held else [])
    rows = table("theta_i / deg", "rows", *names)
    # Many angles are held out in groups, whose means are no angles of the other list.
    same = fitted_lines.keys() == held_lines.keys()
    for name, e in fitted_lines.items():
        cells = [number(e.objective, 3), number(e.l2, 3)]
        if held and same:
            h = held_lines[name]
            cells += [number(h.objective, 3), number(h.l2, 3)]
        rows.add_row(name, str(e.rows), *cells)
    if held and not same:
        for name, h in held_lines.items():
            cells = ["", "", number(h.objective, 3), number(h.l2, 3)]
            rows.add_row(f"around {name}", str(h.rows), *cells)
    out.print(rows)


def channels(out: Console, found: Sequence[ChannelError], everything: bool = False) -> None:
    """RMS errors by channel; nothing for a single one."""
    if len(found) < 2:
        return
    out.print(heading("Errors by channel"))
    rows = table("channel", "RMS / (1/sr)", "of the data's RMS")
    shown = shown_channels(len(found), everything)
    for c in shown:
        e = found[c]
        share = e.relative_rms
        rows.add_row(e.channel, number(e.rms, 3), "-" if share is None else percent(share))
    out.print(rows)
    if len(shown) < len(found):
        share, worst = max((e.relative_rms or 0.0, e.channel) for e in found)
        out.print(
            f"{len(shown)} of {len(found)} channels; worst {worst} with {percent(share)}",
            style="dim",
        )


def colour(out: Console, found: Colour) -> None:
    """The colour difference, with what it refers to."""
    low, high = found.range_nm
    out.print(heading("Colour difference"))
    out.print(
        f"Delta E 2000 between measured and fitted: mean {found.mean:.2f}, 95 % below "
        f"{found.percentile_95:.2f}, largest {found.maximum:.2f} ({found.illuminant}, "
        f"{found.observer}, {low:g} to {high:g} nm)"
    )


def _lines(errors: Sequence[AngleError]) -> dict[str, AngleError]:
    """By name of the line: every angle, or bins of 10 deg where there are many."""
    if len(errors) <= _MOST_ANGLES:
        return {degrees(e.theta_i_deg): e for e in errors}
    bins: dict[int, list[AngleError]] = {}
    for e in errors:
        bins.setdefault(min(int(e.theta_i_deg // _BIN_DEG), _LAST_BIN), []).append(e)
    return {
        f"{k * _BIN_DEG:g} to {(k + 1) * _BIN_DEG:g}": _joined(group)
        for k, group in sorted(bins.items())
    }


def _joined(group: Sequence[AngleError]) -> AngleError:
    rows = sum(e.rows for e in group)

    def rms(values: Sequence[float]) -> float:
        squares = [e.rows * v * v for e, v in zip(group, values, strict=True)]
        return math.sqrt(sum(squares) / max(rows, 1))

    mean = sum(e.rows * e.theta_i_deg for e in group) / max(rows, 1)
    return AngleError(
        mean, rows, rms([e.objective for e in group]), rms([e.l2 for e in group])
    )
