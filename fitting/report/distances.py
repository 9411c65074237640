"""How far the fit is from the data, as tables."""

from __future__ import annotations

from fitting.judge import MEANING
from fitting.quantities import degrees, number, percent
from fitting.report.blocks import Block, Folded, Table, Words
from fitting.result import AngleError, FitResult


def tables(result: FitResult, prefix: str) -> list[Block]:
    """By objective, by angle of incidence, and by channel; ``prefix`` begins all ids."""
    objective = result.settings.objective
    scores = [(name, getattr(result.scores, name), text) for name, text in MEANING.items()]
    minimised = [
        name.removesuffix("_reduced") == objective for name, _, v in scores if v is not None
    ]
    rows = [(name, number(v), text) for name, v, text in scores if v is not None]
    title = f"Distance of fit and data in every objective; the fit makes {objective} small"
    out: list[Block] = [
        Table(
            f"{prefix}scores", title, ("objective", "value", "meaning"), rows, ("meaning",),
            marked=minimised.index(True) if any(minimised) else None,
        )
    ]  # fmt: skip
    out += _angles(result, prefix)
    if result.colour is not None:
        out.append(Words(_colour(result)))
    if len(result.by_channel) > 1:
        rows = [
            (c.channel, number(c.rms, 3),
             "-" if c.relative_rms is None else percent(c.relative_rms))
            for c in result.by_channel
        ]  # fmt: skip
        columns = ("channel", "RMS / (1/sr)", "of the data's RMS")
        table = Table(f"{prefix}channels", "Errors by channel", columns, rows)
        out.append(Folded(f"Errors by channel ({len(rows)})", [table]))
    return out


def _angles(result: FitResult, prefix: str) -> list[Block]:
    objective, validation = result.settings.objective, result.cross_validation
    held = {} if validation is None else {_key(a): a for a in validation.by_angle}
    # Many angles are held out in groups, which are no angles of the fit.
    same = held.keys() == {_key(a) for a in result.by_angle}
    columns = ["theta_i / deg", "rows", objective, "l2 / (1/sr)"]
    columns += [f"held-out {objective}", "held-out l2"] if same else []
    rows = [
        (degrees(a.theta_i_deg), str(a.rows), number(a.objective, 3), number(a.l2, 3),
         *(_held_out(held[_key(a)]) if same else ()))
        for a in result.by_angle
    ]  # fmt: skip
    title = "Errors by angle of incidence"
    title += "; held-out: when fitted without that angle" if same else ""
    out: list[Block] = [Table(f"{prefix}angles", title, columns, rows)]
    if validation is None:
        out.append(Words("Angles of incidence were not left out to see how they are met."))
        return out
    if not same:
        rows = [
            (degrees(a.theta_i_deg), str(a.rows), *_held_out(a))
            for a in validation.by_angle
        ]
        columns = ["around theta_i / deg", "rows", objective, "l2 / (1/sr)"]
        title = "Errors of groups of angles when fitted without them"
        out.append(Table(f"{prefix}held-out", title, columns, rows))
    out.append(
        Words(
            f"Over all held-out angles {objective} is {number(validation.objective)}, "
            f"typically {number(validation.typical)} (geometric mean), and l2 is "
            f"{number(validation.l2)} per sr."
        )
    )
    return out


def _key(a: AngleError) -> float:
    return round(a.theta_i_deg, 3)


def _held_out(a: AngleError) -> tuple[str, str]:
    return number(a.objective, 3), number(a.l2, 3)


def _colour(result: FitResult) -> str:
    c = result.colour
    if c is None:
        return ""
    low, high = c.range_nm
    return (
        f"Colour difference CIEDE2000, row by row: mean {c.mean:.2f}, 95 % below "
        f"{c.percentile_95:.2f}, largest {c.maximum:.2f} ({c.illuminant}, {c.observer}, "
        f"{low:g} to {high:g} nm)."
    )
