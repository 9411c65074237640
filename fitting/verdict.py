"""What a result means, in plain words, and what to do next."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from data_formats import Measurement
from fitting import judge as distances
from fitting.model import Model
from fitting.quantities import degrees, percent
from fitting.result import FitResult
from fitting.rows import select_rows

Level = Literal["good", "fair", "poor", "unknown"]

# Deviations below this are at the level of any goniometer, whatever the data say.
_ALWAYS_GOOD = 0.01
_FEW_TIMES = 3.0
# Without a yardstick in the data.
_GOOD, _FAIR = 0.03, 0.10
_ABOVE_ONE = 1.005
_HELD_OUT_WORSE = 2.0


@dataclass(frozen=True)
class Verdict:
    """A first sentence and what to watch or to do."""

    level: Level
    headline: str
    advice: tuple[str, ...]


def judge(result: FitResult, measurement: Measurement | None) -> Verdict:
    """How good the fit is relative to what the data are worth, and what is wrong.

    Without the measurement by what the result says of itself.
    """
    deviation = result.typical_deviation
    if measurement is not None:
        deviation = typical_deviation(result, measurement)
    level, headline = _headline(result, deviation)
    advice = [
        *_search(result),
        *_misfit(result, level),
        *_unseen(result),
        *_parameters(result),
        *_physics(result),
    ]
    return Verdict(level, headline, tuple(advice))


def typical_deviation(result: FitResult, measurement: Measurement) -> float:
    """Median relative difference of fit and these data, both averaged over channels."""
    m = measurement
    limit = result.settings.max_theta_deg
    at = select_rows(m, limit, Model(result.model).ways).index
    fitted = result.evaluate(m.theta_i[at], m.phi_i[at], m.theta_r[at], m.phi_r[at])
    valid = m.valid[at]
    fitted = np.broadcast_to(fitted.reshape(at.size, -1), valid.shape)
    return distances.typical_deviation(fitted, m.value[at], valid)


def _headline(result: FitResult, deviation: float | None) -> tuple[Level, str]:
    if not result.solver.converged:
        return "poor", f"Not a fit yet: the search {result.solver.sentence}."
    if deviation is None:
        return "unknown", (
            f"No verdict: how far {result.model} is from the data is not in this result, "
            "and the measurement is not at hand."
        )
    name, off = result.model, percent(deviation)
    measured = result.data.reciprocity or result.data.reciprocity_transmitted
    if measured is None:
        level: Level = (
            "good" if deviation <= _GOOD else "fair" if deviation <= _FAIR else "poor"
        )
        word = {"good": "Good", "fair": "Usable", "poor": "Poor"}[level]
        return level, (
            f"{word}: {name} is typically {off} off the data (median); the data offer no "
            "yardstick, since no exchanged directions were measured."
        )
    yardstick = measured.median_relative_difference
    own = percent(yardstick)
    if deviation <= max(yardstick, 1e-12):
        return "good", (
            f"Good: {name} is typically {off} off the data (median), less than the "
            f"{own} by which the data contradict themselves when source and detector are "
            "exchanged."
        )
    if deviation <= _ALWAYS_GOOD:
        return "good", (
            f"Good: {name} is typically {off} off the data (median); exchanging source and "
            f"detector changes the data by {own}."
        )
    times = deviation / yardstick if yardstick > 0 else math.inf
    if times <= _FEW_TIMES:
        return "fair", (
            f"Close: {name} is typically {off} off the data (median), {times:.1f} times "
            f"the {own} by which the data contradict themselves under reciprocity."
        )
    often = f"{times:.2g} times" if math.isfinite(times) else "far more than"
    return "poor", (
        f"The model misses something: {name} is typically {off} off the data (median), "
        f"{often} the {own} by which the data contradict themselves under reciprocity."
    )


def _search(result: FitResult) -> list[str]:
    s = result.solver
    if not s.converged:
        return [
            f"try more starts (--starts {max(16, 4 * s.starts)}), fewer lobes, or fix a "
            "parameter that the data do not determine (--fix NAME=VALUE)"
        ]
    if s.starts > 1 and s.starts_agreeing == 1:
        return [
            f"only one of {s.starts} starts found this minimum; --starts {4 * s.starts} "
            "tells whether there is a better one"
        ]
    return []


def _misfit(result: FitResult, level: Level) -> list[str]:
    if level != "poor" or not result.solver.converged:
        return []
    worst = max(result.by_angle, key=lambda a: a.objective)
    at, steep = worst.theta_i_deg, min(worst.theta_i_deg, 180.0 - worst.theta_i_deg)
    out = (
        f"another model may do better: try {_richer(result)}, see `brdf models`; the "
        f"error is largest at theta_i = {degrees(at)} deg"
    )
    if steep > 60:
        out += (
            f", so a cut-off (--max-theta {degrees(steep - 5)}) tells whether grazing "
            "light is the reason"
        )
    return [out]


def _richer(result: FitResult) -> str:
    """A lobe more, for light that was measured and that the model knows."""
    model = Model(result.model)
    if len(model.labels) > 2:
        return "other lobes than these"
    also = "ggx" if "front" in model.ways else "ggx(back)"
    if not {"front", "back"} & set(model.ways):
        also = "thin_slab"
    return f"-m '{Model(f'{result.model} + {also}').expression}'"


def _unseen(result: FitResult) -> list[str]:
    validation = result.cross_validation
    if len({round(a.theta_i_deg, 1) for a in result.by_angle}) < 2:
        return [
            "a single angle of incidence was measured: nothing tells what the model is "
            "worth at any other"
        ]
    if validation is None:
        return []
    squares = sum(a.rows * a.objective**2 for a in result.by_angle)
    fitted = math.sqrt(squares / max(sum(a.rows for a in result.by_angle), 1))
    if fitted <= 0 or validation.objective < _HELD_OUT_WORSE * fitted:
        return []
    worst = max(validation.by_angle, key=lambda a: a.objective)
    return [
        "angles that the fit has not seen are predicted "
        f"{validation.objective / fitted:.1f} times worse than those it has, worst "
        f"at {degrees(worst.theta_i_deg)} deg: do not "
        "rely on the model beyond the angles measured"
    ]


def _parameters(result: FitResult) -> list[str]:
    free = [p for p in result.parameters if not p.fixed and p.tied_to is None]
    out: list[str] = []
    for p in free:
        if all(p.at_bound):
            if p.kind == "coefficient" and p.value[0] == p.support[0]:
                out.append(
                    f"{p.name} is {p.value[0]:g} in every channel: the model does without "
                    f"it (--fix {p.name}={p.value[0]:g})"
                )
            else:
                out.append(
                    f"{p.name} is at the end of its range ({p.value[0]:.4g}): it has no "
                    "uncertainty, and the surface may be beyond what this model describes"
                )
        pairs = zip(p.value, p.standard_uncertainty, p.at_bound, strict=True)
        loose = [s is None or s > abs(v) for v, s, bound in pairs if not bound]
        if loose and all(loose):
            out.append(
                f"{p.name} is not determined by these data: fix it (--fix {p.name}=VALUE) "
                "or leave its lobe out"
            )
    return out


def _physics(result: FitResult) -> list[str]:
    out: list[str] = []
    e = result.energy
    if e.max_albedo > _ABOVE_ONE:
        out.append(
            f"the fit reflects {'and transmits ' if e.transmitted else ''}"
            f"{percent(e.max_albedo)} of the light at theta_i = "
            f"{e.theta_deg:g} deg ({e.channel}), more than it receives: --energy hard "
            "forbids it, a larger --energy discourages it"
        )
    bright = [a for a in result.data.albedo if a.albedo > _ABOVE_ONE]
    if bright:
        worst = max(bright, key=lambda a: a.albedo)
        out.append(
            f"the data themselves sum to {percent(worst.albedo)} at theta_i = "
            f"{degrees(worst.theta_i_deg)} deg: check the calibration, or whether the "
            "values are reflectance factors (--reader quantity=brf for tables)"
        )
    r = result.reciprocity
    if not r.by_construction and r.max_relative_difference > 0.05:
        out.append(
            "the model changes by up to "
            f"{percent(r.max_relative_difference)} when source and detector are exchanged; "
            "a larger --reciprocity holds it back"
        )
    return out
