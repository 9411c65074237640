"""The answer of `brdf tradeoff`: tables, and sentences on what is worth its price."""

from __future__ import annotations

import itertools

from rich.console import Console

from fitting.cli.flags import Flags
from fitting.cli.terminal import bullet, heading, table
from fitting.quantities import channel_span, number, percent
from fitting.tradeoff.fit_cost import MEMORY
from fitting.tradeoff.table import COST_WORDS, Candidate, ErrorAxis, Tradeoff
from fitting.tradeoff.timing import Spread
from fitting.tradeoff.trade import Trade

# What is computed once per call is worth a word if it costs as much as so many pairs.
_MANY = 100

_ERROR_WORDS: dict[ErrorAxis, str] = {
    "held-out": "held-out {objective}: typical RMS at an angle of incidence not fitted",
    "fitted": "{objective}: RMS over the rows that were fitted",
    "albedo": "albedo: RMS difference of the sums over the rows, fit and data",
    "image": "mean difference of the image from that of the data",
}


def show(out: Console, found: Tradeoff, flags: Flags) -> None:
    """Print everything, or with ``quiet`` the models on the front, cheapest first."""
    if flags.quiet:
        for c in _by_cost(found):
            if not c.on_front:
                continue
            error = number(c.error(found.error_axis, found.objective), 3)
            out.print(f"{c.model}: cost {c.cost(found.cost_axis):.4g}, error {error}")
        return
    out.print(heading(f"What an evaluation costs, {channel_span(found.channels)}"))
    _evaluation(out, found)
    _fitting(out, found)
    _errors(out, found)
    _front(out, found)
    if flags.verbose:
        _objectives(out, found)
    if found.trades:
        _inside(out, found)
    if found.left_out:
        out.print(heading("Not measured"))
        for text in found.left_out:
            bullet(out, text)
    out.print(
        "\nMedians; ± is half of the distance of the quartiles. Operations, flops, "
        "transcendentals and steps are counted and the same on every machine; times are of "
        "this one.",
        style="dim",
    )


def _evaluation(out: Console, found: Tradeoff) -> None:
    heads = ("ops", "flops", "transc.", "f32, ns", "f64, ns", "one, us")
    rows = table("", "model", *heads, left=2)
    rows.columns[1].no_wrap = True
    for c in _by_cost(found):
        e = c.evaluation
        single, double = e.of("float32"), e.of("float64")
        rows.add_row(
            "*" if c.on_front else "",
            c.model,
            f"{e.operations:.0f}",
            f"{e.count.flops:.0f}",
            f"{e.count.transcendentals:g}",
            "-" if single is None else _spread(single.batched_ns),
            "-" if double is None else _spread(double.batched_ns),
            "-" if single is None else _spread(single.single_ns.scaled(1e-3)),
            style="bold" if c.on_front else "",
        )
    out.print(rows)
    out.print(
        "\nper pair of directions in all channels, many at once; ops: operations, flops "
        "+ 30 transcendentals; one: a single evaluation in float32, with the dispatch of "
        "the call",
        style="dim",
    )
    for c in _by_cost(found):
        if c.evaluation.count.flops_once > c.evaluation.count.flops * _MANY:
            bullet(
                out,
                f"{c.model} makes tables once per call, whatever the number of pairs: "
                f"{c.evaluation.count.flops_once:.2g} flops",
            )


def _fitting(out: Console, found: Tradeoff) -> None:
    out.print(heading("What fitting costs"))
    rows = table(
        "", "model", "parameters", "s", "steps", "starts", "MB", "first, s", left=2
    )
    rows.columns[1].no_wrap = True
    for c in _by_cost(found):
        f = c.fit
        rows.add_row(
            "*" if c.on_front else "",
            c.model,
            str(c.parameters),
            _spread(f.seconds),
            str(f.steps),
            str(f.starts),
            "-" if f.memory_bytes is None else f"{f.memory_bytes / 1e6:.2g}",
            f"+ {f.compile_seconds:.2g}",
            style="bold" if c.on_front else "",
        )
    out.print(rows)
    out.print(
        f"\nMB: {MEMORY}; first: what the first fit took longer, to compile the model or "
        "to load what an earlier run compiled",
        style="dim",
    )


def _errors(out: Console, found: Tradeoff) -> None:
    out.print(heading("How far off"))
    rows = table(
        "", "model", f"{found.objective}", "held-out", "albedo", "image", "95 %", "",
        left=2,
    )  # fmt: skip
    rows.columns[-1].justify = "left"
    for c in _by_cost(found):
        e = c.errors
        rows.add_row(
            "*" if c.on_front else "",
            c.model,
            number(c.error("fitted", found.objective), 3),
            number(e.typical, 3),
            "-" if e.albedo is None else f"{e.albedo.rms:.2g}",
            "-" if e.image is None else f"{e.image.mean:.2g}",
            "-" if e.image is None else f"{e.image.percentile_95:.2g}",
            _remark(c, found),
            style="bold" if c.on_front else "",
        )
    out.print(rows)
    out.print(
        "\nheld-out: typical RMS at an angle of incidence that was not fitted; albedo: RMS "
        "difference from the data's over angles and channels; image, 95 %: "
        + _image_words(found),
        style="dim",
    )


def _image_words(found: Tradeoff) -> str:
    images = [c.errors.image for c in found.candidates if c.errors.image is not None]
    if not images:
        return "no image was made"
    return (
        f"{images[0].measure} in the scene {images[0].scene}, mean and 95th percentile, "
        f"without the noise of the data, which makes {images[0].noise:.2g}"
    )


def _remark(c: Candidate, found: Tradeoff) -> str:
    if not c.converged:
        return "did not converge"
    usual = max(other.rows_used for other in found.candidates)
    return "" if c.rows_used == usual else f"{c.rows_used} rows only"


def _front(out: Console, found: Tradeoff) -> None:
    out.print(heading("What accuracy costs"))
    bullet(out, f"cost: {COST_WORDS[found.cost_axis]}")
    words = _ERROR_WORDS[found.error_axis].format(objective=found.objective)
    bullet(out, f"error: {words}")
    bullet(out, "* marks what no other candidate beats in both")
    for text in found.findings:
        bullet(out, text)
    for floor in found.noise_floors:
        bullet(
            out,
            f"noise of the data: {percent(floor.relative)} of a value, which makes a "
            f"typical {found.objective} of {number(floor.typical, 3)}; by {floor.sentence}",
        )


def _objectives(out: Console, found: Tradeoff) -> None:
    """Every objective on held-out angles."""
    names = ("l2", "l2cos", "log1p", "asinh", "cbrt", "chi2_reduced")
    out.print(heading("Held-out, all objectives"))
    rows = table("model", *names)
    for c in _by_cost(found):
        scores = c.errors.held_out
        rows.add_row(
            c.model,
            *("-" if scores is None else number(getattr(scores, n), 3) for n in names),
        )
    out.print(rows)


def _inside(out: Console, found: Tradeoff) -> None:
    out.print(heading(f"Inside {found.inside}"))
    for text in found.trade_findings:
        bullet(out, text)
    for _, group in itertools.groupby(found.trades, key=lambda t: t.varied):
        out.print()
        _group(out, list(group))


def _group(out: Console, group: list[Trade]) -> None:
    first = group[0]
    rows = table(
        first.varied, f"time of {first.cost_of}", "times", first.work_unit, "times",
        "deviation" if first.deviation else "error",
        "largest" if first.worst is not None else "",
        "" if first.deviation else "times",
    )  # fmt: skip
    for t in group:
        rows.add_row(
            t.setting,
            "-" if t.seconds is None else _duration(t.seconds),
            number(t.relative_seconds, 2),
            f"{t.work:.0f}",
            number(t.relative_work, 2),
            number(t.error, 3),
            "" if t.worst is None else number(t.worst, 3),
            "" if t.deviation else number(t.relative_error, 4),
        )
    out.print(rows)


def _by_cost(found: Tradeoff) -> list[Candidate]:
    return sorted(found.candidates, key=lambda c: c.cost(found.cost_axis))


def _spread(s: Spread) -> str:
    """A median and half of the distance of the quartiles, to its first digit."""
    half = 0.5 * (s.high - s.low)
    if not half > 0:
        return number(s.median, 3)
    digits = -int(f"{half:.0e}".partition("e")[2])
    shown = max(digits, 0)
    # What spreads by less than one in a hundred needs no more digits than that.
    if half < 0.01 * s.median:
        return f"{number(s.median, 3)} ± {number(half, 1)}"
    return f"{round(s.median, digits):.{shown}f} ± {round(half, digits):.{shown}f}"


def _duration(s: Spread) -> str:
    """The same with the unit that suits it."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")):
        if s.median * factor >= 1.0 or unit == "ns":
            return f"{_spread(s.scaled(factor))} {unit}"
    return _spread(s)
