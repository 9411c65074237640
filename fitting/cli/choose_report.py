"""The answer of `brdf choose`: what is enough, what more would change, what is unknown."""

from __future__ import annotations

from rich.console import Console

from fitting.cli import parameter_report
from fitting.cli.flags import Flags
from fitting.cli.terminal import bullet, heading, paragraph, table
from fitting.quantities import count, number
from fitting.scene.choice import Choice
from fitting.scene.choice_words import amount_of, named
from fitting.scene.description import Scene
from fitting.scene.difference import ALBEDO, COLOUR
from fitting.scene.stage import ImageError

_MOST_WAVELENGTHS = 6


def show(out: Console, found: Choice, scene: Scene, flags: Flags) -> None:
    """Print everything, the verdict first, or with ``quiet`` the verdict alone."""
    # A verdict may begin with a model's name, which stays as it is.
    first = found.verdict[:1] if found.met else found.verdict[:1].upper()
    verdict = first + found.verdict[1:]
    if flags.quiet:
        paragraph(out, f"{verdict}.")
        return
    paragraph(out, f"{verdict}.", style="bold")
    if scene.description:
        out.print()
        paragraph(out, f"{found.scene}: {scene.description}", style="dim")
    _candidates(out, found)
    _requires(out, found)
    _others(out, found)
    _list(out, "What the scene cannot see", found.unseen)
    _list(out, "What the data cannot support", found.unsupported)
    if flags.verbose:
        _details(out, found)
        out.print(heading(f"Parameters of {named(found.candidates[found.chosen])}"))
        parameter_report.show(out, found.result, everything=True)
        for sentence in found.result.identifiability:
            bullet(out, sentence)


def _candidates(out: Console, found: Choice) -> None:
    out.print(heading("Candidates, cheapest first"))
    one_number = found.measure == ALBEDO
    errors = ("error",) if one_number else ("error", "95 %")
    rows = table("", "model", "cost", "parameters", *errors, "enough", "change", left=2)
    rows.columns[1].no_wrap = True
    kept = found.candidates[found.chosen]
    for k, c in enumerate(found.candidates):
        e = c.error
        shown = (e.mean,) if one_number else (e.mean, e.percentile_95)
        rows.add_row(
            "*" if k == found.chosen else "",
            named(c),
            f"{c.operations / kept.operations:.2g}",
            str(c.parameters),
            *(amount_of(found.measure, v) for v in shown),
            "yes" if c.within_tolerance else "no",
            "-" if k == found.chosen else amount_of(found.measure, c.change),
            style="bold" if k == found.chosen else "",
        )
    out.print(rows)
    out.print()
    for text in _legend(found):
        bullet(out, text, style="dim")


def _details(out: Console, found: Choice) -> None:
    """How each candidate was fitted, and how well its error is known."""
    out.print(heading("How it was found"))
    rows = table(
        "model", "objective", "precision", "error as it comes", "quadrature", left=3
    )
    rows.columns[0].no_wrap = True
    for c in found.candidates:
        rows.add_row(
            named(c),
            c.objective,
            c.precision,
            amount_of(found.measure, c.error.raw_mean),
            amount_of(found.measure, c.error.quadrature_error),
        )
    out.print(rows)
    out.print()
    paragraph(
        out,
        "objective: the one of several whose fit comes nearest in the picture; error as it "
        "comes: with the noise of the data; quadrature: its standard error",
        style="dim",
    )


def _legend(found: Choice) -> tuple[str, ...]:
    error = {
        COLOUR: "error, 95 %: colour difference CIEDE2000 of the pictures with the model "
        "and with the data, its mean and 95th percentile",
        ALBEDO: "error: largest difference of the albedos of model and data",
    }.get(
        found.measure,
        "error, 95 %: relative difference of radiance in the pictures with the model and "
        "with the data, its mean and 95th percentile",
    )
    return (
        "cost: counted operations of an evaluation, relative to the model that is kept (*)",
        f"{error}; without the data's noise, with what is unknown between the samples",
        "change: the same difference from the model that is kept"
        + ("" if found.measure == ALBEDO else ", in the mean"),
    )


def _requires(out: Console, found: Choice) -> None:
    kept = found.candidates[found.chosen]
    out.print(heading("What the scene requires" if found.met else "What comes nearest"))
    bullet(
        out,
        f"{named(kept)}: {count(kept.parameters, 'free parameter')}, "
        f"{kept.operations:.0f} operations per evaluation in all channels",
    )
    if kept.precision == "float32":
        bullet(out, "single precision (float32): rounding does not show")
    else:
        bullet(out, "double precision (float64): in float32 rounding would show")
    shaped = any(p.kind == "shape" for p in found.result.parameters)
    if shaped and len(found.result.channels) > 1:
        bullet(
            out,
            "a shape for each channel"
            if kept.per_channel_shape
            else "one shape for all channels",
        )
    _wavelengths(out, found)
    if not found.result.solver.converged:
        bullet(out, f"warning: {found.result.solver.sentence}")
    energy = found.result.energy
    if energy.max_albedo > 1:
        bullet(
            out,
            f"warning: the model reflects more than arrives, up to {energy.max_albedo:.3f} "
            f"of it, at {energy.theta_deg:g} deg, {energy.channel}",
        )


def _wavelengths(out: Console, found: Choice) -> None:
    """How many wavelengths coefficients are needed at, and what fewer would do."""
    if not found.wavelengths:
        return
    enough = [w for w in found.wavelengths if w.within_tolerance]
    few = [w for w in found.wavelengths if not w.within_tolerance]
    n = len(found.result.channels)
    text = f"coefficients at all {n} wavelengths"
    if enough:
        least = enough[-1]
        at = f"{len(least.wavelengths_nm)} of {n} wavelengths"
        text = (
            f"coefficients at {at} ({_listed(least.wavelengths_nm)}), linear between them: "
            f"off by {_both(found, least.error)}"
        )
    for w in few[:1]:
        text += (
            f"; at {len(w.wavelengths_nm)} ({_listed(w.wavelengths_nm)}) off by "
            f"{_both(found, w.error)}, too much"
        )
    bullet(out, text)


def _both(found: Choice, error: ImageError) -> str:
    """Mean and 95th percentile, or the one number of an albedo."""
    mean = amount_of(found.measure, error.mean)
    if found.measure == ALBEDO:
        return mean
    high = amount_of(found.measure, error.percentile_95)
    return f"{mean} on average and {high} at the 95th percentile"


def _listed(wavelengths: list[float]) -> str:
    shown = [number(w) for w in wavelengths]
    if len(shown) > _MOST_WAVELENGTHS:
        shown = [*shown[:3], "...", shown[-1]]
    return f"{', '.join(shown)} nm"


def _others(out: Console, found: Choice) -> None:
    """A sentence each on the candidates that are not kept."""
    kept = found.candidates[found.chosen]
    others = [c for k, c in enumerate(found.candidates) if k != found.chosen]
    dearer = [c.sentence for c in others if c.operations >= kept.operations]
    cheaper = [c.sentence for c in others if c.operations < kept.operations]
    _list(out, "What dearer candidates would change and cost", dearer)
    _list(out, "What cheaper candidates would miss", cheaper)


def _list(out: Console, title: str, sentences: list[str]) -> None:
    if not sentences:
        return
    out.print(heading(title))
    for sentence in sentences:
        bullet(out, sentence)
