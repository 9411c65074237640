"""A result as text, for notebooks and logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fitting.quantities import channel_span, number, shown_channels, with_uncertainty

if TYPE_CHECKING:
    from fitting.result import FitResult, ParameterResult


def describe(result: FitResult) -> str:
    """Model, parameters with standard uncertainties, errors, and what is left open."""
    names = [c.name for c in result.channels]
    shown = shown_channels(len(names))
    lines = [f"{result.model}, {channel_span(names)}: {result.solver.sentence}"]
    width = max(len(p.name) for p in result.parameters)
    for p in result.parameters:
        if len(p.value) == 1:
            lines.append(f"  {p.name:<{width}}  {_value(p, 0)}")
        else:
            lines += [f"  {p.name:<{width}}  {names[c]:>8}  {_value(p, c)}" for c in shown]
    if len(shown) < len(names):
        lines.append(f"  ({len(shown)} of {len(names)} channels shown)")
    objective = result.settings.objective
    errors = f"l2 {number(result.scores.l2)} 1/sr"
    if objective not in ("l2", "chi2"):
        errors = f"{objective} {number(getattr(result.scores, objective))}, {errors}"
    if result.scores.chi2_reduced is not None:
        errors += f", reduced chi2 {number(result.scores.chi2_reduced)}"
    lines.append(f"  RMS error: {errors}")
    if result.cross_validation is not None:
        held = number(result.cross_validation.typical)
        lines.append(f"  held-out {objective}, typical of an angle of incidence: {held}")
    lines.append(f"  largest albedo: {number(result.energy.max_albedo)}")
    lines += [f"  - {sentence}" for sentence in result.identifiability]
    return "\n".join(lines)


def _value(p: ParameterResult, c: int) -> str:
    text = with_uncertainty(p.value[c], p.standard_uncertainty[c])
    notes = [p.unit] if p.unit != "1" else []
    notes += ["fixed"] if p.fixed else []
    notes += [f"tied to {p.tied_to}"] if p.tied_to else []
    notes += ["at a bound"] if p.at_bound[c] else []
    return f"{text} {', '.join(notes)}".rstrip()
