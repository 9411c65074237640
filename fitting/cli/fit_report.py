"""The answer of `brdf fit`: tables, sentences and a verdict."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from data_formats import Measurement
from fitting.cli import comparison_report, error_report, parameter_report
from fitting.cli.flags import Flags
from fitting.cli.terminal import bullet, heading
from fitting.cli.verdict import Verdict, judge
from fitting.comparison import Comparison
from fitting.quantities import channel_span, count, number, percent
from fitting.result import DataAlbedo, FitResult


def show(out: Console, done: Comparison, measurement: Measurement, flags: Flags) -> None:
    """Print everything, or with ``quiet`` the first sentence of the verdict."""
    result = done.results[done.best]
    verdict = judge(result, measurement)
    if flags.quiet:
        out.print(verdict.headline)
        return
    if len(done.results) > 1:
        comparison_report.show(out, done)
    names = [c.name for c in result.channels]
    out.print(heading(f"{result.model}, {channel_span(names)}"))
    parameter_report.show(out, result, flags.verbose)
    error_report.show(out, result, flags.verbose)
    _physics(out, result)
    out.print(heading("What the data determine"))
    for sentence in result.identifiability:
        bullet(out, sentence)
    _data(out, result)
    if flags.verbose:
        _settings(out, result)
    _verdict(out, verdict)


def _physics(out: Console, result: FitResult) -> None:
    out.print(heading("Energy and reciprocity"))
    e, r = result.energy, result.reciprocity
    text = (
        f"largest albedo of the fit {e.max_albedo:.3f}, at theta_i = {e.theta_deg:g} deg "
        f"{'from the back, ' if e.side == 'back' else ''}".rstrip(" ,")
        + f", {e.channel}"
    )
    if e.transmitted:
        text += f", of which {e.transmitted:.3f} is transmitted"
    how = {
        "hard": "cannot exceed 1",
        "penalty": "the penalty above 1 was " + ("active" if e.active else "not needed"),
        "none": "not constrained",
    }
    bullet(out, f"{text} ({how[e.constraint]})")
    if r.by_construction:
        bullet(out, "the model is reciprocal by construction")
    else:
        bullet(
            out,
            "exchanging source and detector changes the model by up to "
            f"{percent(r.max_relative_difference)}",
        )
    through = result.data.reciprocity_transmitted
    for measured, light in ((result.data.reciprocity, ""), (through, " in transmission")):
        if measured is not None:
            index = measured.relative_index
            over = f", over the squared index, {index:.4g} behind" if index != 1.0 else ""
            bullet(
                out,
                f"exchanging source and detector changes the data{light} by "
                f"{percent(measured.median_relative_difference)} (median of "
                f"{count(measured.pairs, 'pair')}{over})",
            )
    if result.data.reciprocity is None and through is None:
        bullet(out, "the directions measured do not allow to test reciprocity")
    if result.data.albedo:
        worst = max(result.data.albedo, key=lambda a: a.albedo)
        bullet(
            out,
            f"the data sum to an albedo of at most {worst.albedo:.3f}, at theta_i = "
            f"{worst.theta_i_deg:.1f} deg (rows for {_covered(worst)})",
        )


def _covered(albedo: DataAlbedo) -> str:
    if albedo.transmitted is None or albedo.transmitted_covered is None:
        return f"{percent(albedo.covered)} of the projected hemisphere"
    return (
        f"{percent(albedo.covered)} of the projected hemisphere of reflection and "
        f"{percent(albedo.transmitted_covered)} of that of transmission, which has "
        f"{albedo.transmitted:.3f} of it"
    )


def _data(out: Console, result: FitResult) -> None:
    said = list(result.data.left_out) + [n.sentence for n in result.data.notes]
    if not said:
        return
    out.print(heading("About the data"))
    for text in result.data.left_out:
        bullet(out, f"left out: {text}")
    for note in result.data.notes:
        bullet(out, note.sentence)


def _settings(out: Console, result: FitResult) -> None:
    s = result.settings
    out.print(heading("Settings, sources, versions"))
    chosen = (
        f"objective {s.objective}, weights {s.weights}, max-theta {s.max_theta_deg:g}, "
        f"robust {'yes' if s.robust else 'no'}, starts {s.starts}"
    )
    if s.noise:
        chosen += f", noise {number(s.noise[0])},{number(s.noise[1])}"
    bullet(out, chosen)
    bullet(out, f"uncertainties: {result.uncertainty_method}, k = 1")
    for reference in result.references:
        bullet(out, reference)
    versions = ", ".join(f"{k} {v}" for k, v in result.versions.items())
    bullet(out, versions)


def _verdict(out: Console, verdict: Verdict) -> None:
    style = {"good": "green", "fair": "yellow", "poor": "red"}[verdict.level]
    out.print(heading("Verdict"))
    out.print(Text(verdict.headline, style=style))
    for advice in verdict.advice:
        bullet(out, advice)
