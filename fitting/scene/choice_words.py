"""A choice in words: what candidates change and cost, what is not seen, what not known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fitting.quantities import count
from fitting.scene.choice import Candidate
from fitting.scene.difference import ALBEDO, COLOUR
from fitting.scene.explain import explain
from fitting.scene.refit import Refit
from fitting.scene.render import render
from fitting.scene.stage import ImageError, Stage, incidences

_UNUSED, _DARK = 0.03, 1e-3
_WORST = 0.1
_LEAST_COLOUR = 0.001


def amount(stage: Stage, value: float) -> str:
    """An error in the measure of the scene."""
    return amount_of(stage.measure.name, value)


def amount_of(measure: str, value: float) -> str:
    """An error in the measure of that name (`fitting.scene.difference`)."""
    if measure == COLOUR:
        if 0 < value < _LEAST_COLOUR:
            return f"<{_LEAST_COLOUR}"
        return f"{value:.2g}" if value < 10 else f"{value:.0f}"
    if measure == ALBEDO:
        return f"{value:.2g}"
    return f"{100 * value:.2g} %"


def named(candidate: Candidate) -> str:
    """The model, and what is special about its parameters."""
    return candidate.model + (
        " with a shape per channel" if candidate.per_channel_shape else ""
    )


def sentence(stage: Stage, one: Candidate, kept: Candidate) -> str:
    """What a candidate changes in the scene, and what it costs."""
    if one == kept or (one.model, one.per_channel_shape) == (
        kept.model,
        kept.per_channel_shape,
    ):
        return "kept"
    ratio = one.operations / max(kept.operations, 1e-300)
    price = f"costs {ratio:.2g} times as much"
    change = f"changes this scene by {amount(stage, one.change)}"
    own, least = amount(stage, one.error.mean), amount(stage, kept.error.mean)
    off = f"off by {own} " + ("as well" if own == least else f"instead of {least}")
    if one.error.mean == 0:
        off = "no further off than the noise of the data"
    if one.within_tolerance:
        return f"{named(one)} {change} and {price}; it is {off}"
    missed = _missed(stage, one.error)
    return f"{named(one)} {change} and {price}; {off}, it misses the tolerance by {missed}"


def verdict(
    stage: Stage,
    candidates: Sequence[Candidate],
    chosen: int,
    met: bool,
    error: ImageError,
    found: Refit,
) -> str:
    """The answer in one sentence."""
    kept = candidates[chosen]
    if met:
        limits = [amount(stage, x) for x in stage.measure.limits]
        allowed = " and ".join(limits) + (" are" if len(limits) > 1 else " is") + " allowed"
        only = ""
        if any(c.operations < kept.operations for c in candidates):
            only = "; no cheaper candidate is"
        elif len(candidates) > 1:
            only = "; it is the cheapest candidate"
        return (
            f"{named(kept)} is enough for {stage.scene.name}: off by "
            f"{_both(stage, (error.mean, error.percentile_95))}, where {allowed} "
            f"({_unit(stage)}){only}"
        )
    return (
        f"no candidate is within the tolerance of {stage.scene.name} ({_unit(stage)}: "
        f"{_both(stage, stage.measure.limits)}); {named(kept)} comes nearest and misses it "
        f"by {_missed(stage, error)}, most {_where(stage, found)}"
    )


def unseen(stage: Stage, found: Refit) -> list[str]:
    """What the scene cannot see, and what is therefore left out."""
    out: list[str] = []
    unused = float(np.mean(stage.importance < _UNUSED))
    if unused > 0.005:
        out.append(
            f"{100 * unused:.0f} % of the measured rows are in directions that this scene "
            "hardly uses; they count for next to nothing in the fit"
        )
    theta, power = incidences(stage.lights)
    reached = np.cumsum(power) / power.sum()
    low, high = np.degrees(np.interp([0.005, 0.995], reached, theta))
    span = f"{low:.0f} to {high:.0f}" if high - low >= 1 else f"about {low:.0f}"
    out.append(
        f"99 % of the light arrives at {span} deg from the normal; what the surface does "
        "at other angles of incidence does not show"
    )
    finest = min(explain(stage.scene).lights, key=lambda light: light.size_deg)
    narrow = [
        f"{label}.{name} = {alpha:.3g}"
        for label, name, alpha in _widths(found)
        if alpha < finest.smallest_alpha
    ]
    if narrow:
        out.append(
            f"no light has details finer than {finest.size_deg:.3g} deg ({finest.name}), "
            f"and lobes much narrower than alpha = {finest.smallest_alpha:.2g} look alike "
            f"but at the edges of highlights: {', '.join(narrow)} might as well be narrower"
        )
    light = sum(np.abs(e.spectrum).sum(axis=0) for e in stage.photometry.emitters)
    light = np.asarray(light) * stage.photometry.counts
    seen = light * np.abs(stage.photometry.tristimulus).sum(axis=1)
    dark = seen < _DARK * seen.max()
    if dark.any():
        names = [c.name for c, d in zip(stage.measurement.channels, dark, strict=True) if d]
        listed = ", ".join(names[:4]) + (", ..." if len(names) > 4 else "")
        out.append(
            f"{count(len(names), 'channel')} ({listed}) without light or without weight "
            "for this observer"
        )
    return out


def unsupported(stage: Stage, kept: Candidate) -> list[str]:
    """What the data cannot support."""
    out: list[str] = []
    share = stage.extrapolated_share
    if share >= 0.0005:
        out.append(
            f"{100 * share:.1f} % of the light in the picture comes by pairs of directions "
            "without data near them; there the model is an extrapolation, and no "
            "difference is judged"
        )
    left = 1.0 - float(stage.picture.weight @ (stage.extrapolated <= 0.5))
    if left >= 0.005:
        out.append(
            f"{100 * left:.0f} % of the picture is lit mostly by such directions and not "
            "judged at all"
        )
    noise = kept.error.noise
    out.append(
        f"the noise of the data alone makes {amount(stage, noise)} in this scene (mean); "
        "half of it is taken off the errors, in quadrature"
        if noise > 0
        else "no noise of the data was found to take off the errors"
    )
    between = kept.error.interpolation
    if between > 0:
        out.append(
            f"another interpolation of the data differs by {amount(stage, between)} "
            "(mean), which is added to the errors, in quadrature"
        )
    if between > stage.measure.limits[0]:
        out.append(
            "that is more than the tolerance: the samples are too far apart for this scene"
        )
    if noise > stage.measure.limits[0]:
        out.append("the noise is more than the tolerance: repeat the measurement")
    through = int(np.sum(stage.measurement.transmitted))
    if through:
        out.append(
            f"{count(through, 'row')} of transmitted light are left out: a scene shows "
            "what is reflected at the front"
        )
    return out


def _unit(stage: Stage) -> str:
    """What the scene's errors are."""
    return "CIEDE2000" if stage.measure.name == COLOUR else stage.measure.name


def _both(stage: Stage, errors: Sequence[float]) -> str:
    """Mean and 95th percentile, or the one number of an albedo."""
    if stage.measure.name == ALBEDO:
        return f"{amount(stage, errors[0])} at most"
    return (
        f"{amount(stage, errors[0])} on average and {amount(stage, errors[1])} at the 95th "
        "percentile"
    )


def _missed(stage: Stage, error: ImageError) -> str:
    limits = stage.measure.limits
    if error.mean > limits[0] or len(limits) == 1:
        return f"{amount(stage, max(error.mean - limits[0], 0.0))} on average"
    return (
        f"{amount(stage, max(error.percentile_95 - limits[1], 0.0))} at the 95th percentile"
    )


def _where(stage: Stage, found: Refit) -> str:
    """The directions behind the tenth of the picture that is worst."""
    if stage.measure.name == ALBEDO:
        return "as an albedo"
    image = render(found.model, found.values, stage.judged).radiance
    each = stage.measure.between(image, stage.of_data.radiance).mean(axis=1)
    each = np.where(stage.weight > 0, each, -1.0)
    worst = np.argsort(-each)[: max(1, int(_WORST * np.sum(stage.weight > 0)))]
    there = np.isin(np.arange(stage.picture.size), worst)
    angles: list[np.ndarray] = []
    powers: list[np.ndarray] = []
    for light in stage.judged:
        chosen = there[light.sum % light.pixels]
        g = light.geometry
        value = np.abs(stage.reference.value(g)).sum(axis=1)
        powers.append((light.weight.sum(axis=0) * value)[chosen])
        cosines = np.stack([g.cos_i, g.cos_o, g.hz])[:, chosen]
        angles.append(np.degrees(np.arccos(np.clip(cosines, -1, 1))))
    power = np.concatenate(powers)
    theta_i, theta_r, theta_h = np.concatenate(angles, axis=1) @ power / power.sum()
    return (
        f"where light arrives at about {theta_i:.0f} deg and is seen at {theta_r:.0f} deg, "
        f"half vectors {theta_h:.0f} deg off the normal"
    )


def _widths(found: Refit) -> list[tuple[str, str, float]]:
    """Widths of facet lobes, by name."""
    out: list[tuple[str, str, float]] = []
    for i, (label, lobe) in enumerate(
        zip(found.model.labels, found.model.lobes, strict=True)
    ):
        own = found.model.of_lobe(i, found.values)
        shape = {p.name: own[p.name] for p in lobe.parameters() if not p.coefficient}
        for name in ("alpha", "alpha_x", "alpha_y"):
            if name in shape:
                out.append((label, name, float(np.min(shape[name]))))
    return out
