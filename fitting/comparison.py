"""Several models on the same data, and the one to keep."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from data_formats import Measurement
from fitting.expression import ModelError, Term, parse
from fitting.fitter import Progress, fit
from fitting.model import Model
from fitting.models import lobe_names
from fitting.models.lobe import THROUGH
from fitting.options import FitOptions
from fitting.result import Candidate, Candidates, FitResult
from fitting.rows import ways_of
from fitting.side_by_side import side_by_side

# What is tried when the user names no model: diffuse plus one lobe with long skirts, with
# short ones, or without the 1/(cos cos) of a facet on air (flakes below a clear coat); and
# two lobes, for surfaces of two scales and for flakes below a coat that shines itself.
DEFAULT_MODELS = (
    "lambert + ggx",
    "lambert + ward",
    "lambert + ggx(bare)",
    "lambert + 2*ggx",
    "lambert + ggx + blinn_phong",
)


# The same with transmitted light: what is diffuse, and foils or plates that are clear to a
# degree. A single interface to another medium is no sample between two airs, and left out.
_REFLECTED_AND_TRANSMITTED = (
    "lambert + lambert_transmission",
    "lambert + ggx + lambert_transmission",
    "lambert + lambert_transmission + thin_slab",
    "lambert + lambert_transmission + thin_slab(two_widths)",
    "lambert + ggx + lambert_transmission + thin_slab",
)
_TRANSMITTED = (
    "lambert_transmission",
    "thin_slab",
    "lambert_transmission + thin_slab",
    "lambert_transmission + 2*thin_slab",
)


def default_models(measurement: Measurement) -> tuple[str, ...]:
    """What to compare on these data: models that know the ways of light that were measured.

    For light from the back every lobe that only knows the front gets a twin there.
    """
    found = set(np.unique(ways_of(measurement)[measurement.valid.any(axis=1)]))
    through, reflected = found & set(THROUGH), found - set(THROUGH)
    models = DEFAULT_MODELS
    if through:
        models = _REFLECTED_AND_TRANSMITTED if reflected else _TRANSMITTED
    if "back" not in found:
        return models
    return tuple(_on_both_sides(m, front="front" in found) for m in models)


def _on_both_sides(expression: str, *, front: bool) -> str:
    model = Model(expression)
    out: list[str] = []
    for term, lobe in zip(parse(expression, lobe_names()), model.lobes, strict=True):
        if lobe.ways != ("front",):
            out.append(str(term))
            continue
        out += [str(term)] if front else []
        out.append(str(Term(term.lobe, (*term.options, "back"))))
    return Model(" + ".join(out)).expression


@dataclass(frozen=True)
class Comparison:
    """Results in the order of the models, the index of the one to keep, and why."""

    results: tuple[FitResult, ...]
    best: int
    reason: str

    @property
    def kept(self) -> FitResult:
        """The result to keep; of several it says with which others it was compared."""
        result = self.results[self.best]
        if len(self.results) == 1:
            return result
        models = [candidate(r, kept=r is result) for r in self.results]
        return msgspec.structs.replace(result, candidates=Candidates(models, self.reason))


def candidate(result: FitResult, *, kept: bool) -> Candidate:
    """The figures of a result that others compare with."""
    held_out = result.cross_validation
    return Candidate(
        model=result.model,
        parameters=n_free(result),
        error=objective_error(result),
        held_out=None if held_out is None else held_out.typical,
        max_albedo=result.energy.max_albedo,
        converged=result.solver.converged,
        kept=kept,
    )


def objective_error(result: FitResult) -> float | None:
    """RMS of what was made small; of chi2 the root of its reduced value."""
    if result.settings.objective == "chi2":
        reduced = result.scores.chi2_reduced
        return None if reduced is None else math.sqrt(reduced)
    return getattr(result.scores, result.settings.objective)


def n_free(result: FitResult) -> int:
    """Number of free parameters, one per channel where they differ by channel."""
    return sum(len(p.value) for p in result.parameters if not p.fixed and p.tied_to is None)


def compare(
    measurement: Measurement,
    models: Sequence[str] | str | None = None,
    options: FitOptions | None = None,
    *,
    progress: Progress | None = None,
    **settings: Any,
) -> Comparison:
    """Fit every model and keep the smallest one that predicts as well as the best.

    Without ``models``, those of `default_models`.

    As well means: the ratio of its held-out error to that of the best, angle of incidence
    by angle of incidence, is above 1 by less than one standard error (the rule of Breiman
    et al. 1984, Classification and Regression Trees, sec. 3.4.3, paired). Ratios, because
    the most grazing angle has errors many times those of the others and would decide alone.
    """
    models = default_models(measurement) if models is None else models
    if not models:
        raise ModelError("no model to compare; leave models out for the default ones")
    models = [models] if isinstance(models, str) else models
    say = progress or (lambda _: None)

    def one(model: str) -> FitResult:
        return fit(
            measurement, model, options, progress=lambda s: say(f"{model}: {s}"), **settings
        )

    jobs = [functools.partial(one, model) for model in models]
    results = tuple(side_by_side(jobs, measurement.value.size))
    best, reason = choose(results)
    return Comparison(results, best, reason)


def choose(results: tuple[FitResult, ...]) -> tuple[int, str]:
    """Index of the result to keep, and why, in one sentence."""
    if len(results) == 1:
        return 0, f"{results[0].model} is the only model asked for"
    if len({r.data.rows_used for r in results}) > 1:
        best = int(np.argmax([r.data.rows_used for r in results]))
        return best, (
            f"{results[best].model} describes the most rows; errors on different rows do "
            "not compare (see 'left out' in each result)"
        )
    held = [_held_out(r) for r in results]
    if any(h is None for h in held):
        best = int(np.argmin([r.solver.cost for r in results]))
        return best, (
            f"{results[best].model} is nearest to the data; without held-out angles of "
            "incidence, more parameters always look better"
        )
    errors = np.asarray([h for h in held if h is not None])
    total = np.exp(errors.mean(axis=1))
    top = int(np.argmin(total))
    near = [i for i in range(len(results)) if i == top or as_good(errors[i], errors[top])]
    best = min(near, key=lambda i: (n_free(results[i]), total[i]))
    name, number = results[best].model, n_free(results[best])
    if best == top:
        larger = [i for i in near if i != best and n_free(results[i]) > number]
        why = f"{name} has the smallest typical held-out error ({total[best]:.3g})"
        if larger:
            why += ", and no larger model predicts better"
        return best, why
    gain = 100 * (1 - total[top] / total[best])
    return best, (
        f"{name} with {number} parameters predicts unseen angles as well as "
        f"{results[top].model} with {n_free(results[top])} (whose held-out error is "
        f"typically {gain:.1f} % smaller, within one standard error)"
    )


def _held_out(result: FitResult) -> np.ndarray | None:
    """Logarithms of the held-out error per angle of incidence."""
    if result.cross_validation is None:
        return None
    errors = [a.objective for a in result.cross_validation.by_angle]
    return np.log(np.maximum(errors, 1e-300))


def as_good(errors: np.ndarray, best: np.ndarray) -> bool:
    """Whether logarithms of errors, angle by angle, are above others by chance only.

    By less than one standard error of their mean difference.
    """
    ratio = errors - best
    if ratio.size < 2:
        return bool(ratio.mean() <= 0)
    return bool(ratio.mean() <= ratio.std(ddof=1) / math.sqrt(ratio.size))
