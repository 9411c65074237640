"""The answer of `brdf fit`: tables, sentences and a verdict."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from data_formats import Measurement
from fitting import physics
from fitting.cli import comparison_report, error_report, parameter_report
from fitting.cli.flags import Flags
from fitting.cli.terminal import bullet, heading
from fitting.comparison import Comparison
from fitting.quantities import channel_span, number
from fitting.result import FitResult
from fitting.verdict import Verdict, judge

_STYLES = {"good": "green", "fair": "yellow", "poor": "red", "unknown": "yellow"}


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
    for sentence in physics.of_fit(result) + physics.of_data(result):
        bullet(out, sentence)


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
    style = _STYLES[verdict.level]
    out.print(heading("Verdict"))
    out.print(Text(verdict.headline, style=style))
    for advice in verdict.advice:
        bullet(out, advice)
