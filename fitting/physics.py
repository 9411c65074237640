"""Energy and reciprocity, of a fit and of the data that it was fitted to, in sentences."""

from __future__ import annotations

from fitting.quantities import count, percent
from fitting.result import DataAlbedo, FitResult


def of_fit(result: FitResult) -> list[str]:
    """The largest albedo, what was done about it, and the exchange of directions."""
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
    out = [f"{text} ({how[e.constraint]})"]
    if r.by_construction:
        return [*out, "the model is reciprocal by construction"]
    changed = percent(r.max_relative_difference)
    return [*out, f"exchanging source and detector changes the model by up to {changed}"]


def of_data(result: FitResult) -> list[str]:
    """The same of the measurement, as far as its directions tell."""
    out: list[str] = []
    through = result.data.reciprocity_transmitted
    for measured, light in ((result.data.reciprocity, ""), (through, " in transmission")):
        if measured is not None:
            index = measured.relative_index
            over = f", over the squared index, {index:.4g} behind" if index != 1.0 else ""
            out.append(
                f"exchanging source and detector changes the data{light} by "
                f"{percent(measured.median_relative_difference)} (median of "
                f"{count(measured.pairs, 'pair')}{over})"
            )
    if not out:
        out.append("the directions measured do not allow to test reciprocity")
    if result.data.albedo:
        worst = max(result.data.albedo, key=lambda a: a.albedo)
        out.append(
            f"the data sum to an albedo of at most {worst.albedo:.3f}, at theta_i = "
            f"{worst.theta_i_deg:.1f} deg (rows for {_covered(worst)})"
        )
    return out


def _covered(albedo: DataAlbedo) -> str:
    if albedo.transmitted is None or albedo.transmitted_covered is None:
        return f"{percent(albedo.covered)} of the projected hemisphere"
    return (
        f"{percent(albedo.covered)} of the projected hemisphere of reflection and "
        f"{percent(albedo.transmitted_covered)} of that of transmission, which has "
        f"{albedo.transmitted:.3f} of it"
    )
