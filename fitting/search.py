"""The search for the best minimum of a problem, and of its variations."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np
from jax.typing import ArrayLike

from fitting import ahead, judge, starts
from fitting.model import Model
from fitting.objectives import ROBUST_WIDTH
from fitting.options import FitOptions
from fitting.parameters import from_inside, is_flat
from fitting.predict import predict_geometry
from fitting.problem import for_channel, prepare
from fitting.reduced import Problem
from fitting.rows import Rows
from fitting.side_by_side import side_by_side
from fitting.solve import Solution, refine
from fitting.summary import Found, joined_values

_PULLS = 4
_BETTER = 1e-6


def problems(
    rows: Rows, model: Model, options: FitOptions, **kwargs: Any
) -> Iterator[Problem]:
    """One problem, or one per channel where each has its own shape."""
    whole = prepare(rows, model, options, **kwargs)
    if not options.per_channel_shape:
        yield whole
        return
    for c in range(whole.target.shape[0]):
        yield for_channel(whole, c)


def search(rows: Rows, model: Model, options: FitOptions) -> list[Found]:
    """The best minimum of every problem, each from its own starts.

    Channels with a shape of their own also start from the shape that they share best, so
    that they never end up worse than with it.
    """
    if not options.per_channel_shape:
        return [_search_one(p, options) for p in problems(rows, model, options)]
    together = dataclasses.replace(options, per_channel_shape=False)
    shared = _search_one(prepare(rows, model, together), together, last=False)
    u, x = shared.solution.u, shared.solution.x
    return [
        _search_one(p, options, (u, x[c : c + 1]))
        for c, p in enumerate(problems(rows, model, options))
    ]


def _search_one(
    p: Problem,
    options: FitOptions,
    also: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    last: bool = True,
) -> Found:
    last, whole = last and not options.robust, not options.per_channel_shape
    ahead.begin(p, last=last, whole=whole)
    count = max(1, options.starts) if p.unknowns.n_shape else 1
    points, x = starts.best_starts(p, count)
    begin = [*zip(points, x, strict=True), *([also] if also else [])]
    return _best(p, _each(_pulled_back, p, begin))


def _each(
    descend: Callable[[Problem, ArrayLike, ArrayLike], Solution],
    p: Problem,
    begin: Sequence[tuple[ArrayLike, ArrayLike]],
) -> list[Solution]:
    """Where starts end, the first by itself: what it compiles, the others use."""

    def run(u: ArrayLike, x: ArrayLike) -> Solution:
        # Threads do not inherit it.
        with jax.enable_x64(True):
            return descend(p, u, x)

    first, *others = [functools.partial(run, *start) for start in begin]
    return [first(), *side_by_side(others, p.target.size)]


def refined(p: Problem, u: ArrayLike, x: ArrayLike) -> Solution:
    """The minimum from one start, as numpy."""
    return jax.device_get(refine(p, *jax.device_put((u, x))))


def _pulled_back(p: Problem, u: ArrayLike, x: ArrayLike) -> Solution:
    """The same, and once more from inside if shape parameters ended at their bounds."""
    end = refined(p, u, x)
    for _ in range(_PULLS):
        u = np.asarray(end.u)
        stuck = is_flat(p.unknowns.scales, u)
        if not stuck.any():
            break
        new = refined(p, from_inside(u, stuck), end.x)
        if not float(new.cost) < float(end.cost) * (1.0 - _BETTER):
            break
        end = new
    return end


def _best(p: Problem, ends: list[Solution]) -> Found:
    cost = [float(e.cost) if math.isfinite(e.cost) else math.inf for e in ends]
    return Found(p, ends[int(np.argmin(cost))], tuple(ends))


def again(
    rows: Rows, model: Model, options: FitOptions, found: list[Found], **kwargs: Any
) -> list[Found]:
    """Refit with other residuals, from every end: the order of the minima may change."""
    out: list[Found] = []
    for p, before in zip(problems(rows, model, options, **kwargs), found, strict=True):
        out.append(_best(p, _each(refined, p, [(e.u, e.x) for e in before.ends])))
    return out


def predicted_by(found: list[Found], rows: Rows) -> np.ndarray:
    """Values ``(n, c)`` of the fit at the rows, 1/sr."""
    model = found[0].problem.model
    values = predict_geometry(model, joined_values(found), rows.geometry)
    return np.broadcast_to(values, rows.value.shape)


def robust_width(
    rows: Rows, objective: str, options: FitOptions, found: list[Found]
) -> float:
    """Width of the pseudo-Huber residual: 1.345 robust standard deviations of a fit's."""
    r = judge.residuals(rows, predicted_by(found, rows), objective, options)[rows.valid]
    spread = float(np.median(np.abs(r - np.median(r))))
    return ROBUST_WIDTH * spread if spread > 0 else math.inf
