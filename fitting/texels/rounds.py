"""All fits of a chunk of texels: the first, and those again with other residuals.

The rounds are those of `fitting.fit`: assumed noise follows the fit, robust residuals take
their width from it, and penalties count where it breaks what they stand for. Each begins
at the ends of the one before.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from fitting.objectives import OBJECTIVES, ROBUST_WIDTH, transform
from fitting.problem import NOISE_ROUNDS, TINY, assumed_noise
from fitting.texels import many
from fitting.texels.abreast import LARGEST, Data
from fitting.texels.many import Found
from fitting.texels.task import Plan, Task, with_residuals


def fit_chunk(
    plan: Plan,
    values: np.ndarray,
    sigma: np.ndarray | None = None,
    *,
    single_first: bool = False,
) -> dict[str, np.ndarray]:
    """The fields of `Outcome`, and ``runner_up (t,)``, of texels.

    ``values (t, n, c)`` have all rows of the file, NaN where unknown; so has ``sigma``,
    which counts where the objective takes it. Shapes have an axis of channels, the last
    one, where each has its own. Call with x64 enabled.
    """
    options, tasks = plan.options, plan.tasks
    objective = OBJECTIVES[options.objective]
    rows = _Rows(plan, values)
    data = Data(values, sigma if plan.takes_sigma else None)
    if plan.assumes_noise:
        data = data._replace(sigma=rows.sigma(rows.values))
    if objective.scaled:
        data = data._replace(unit=rows.unit())
    alone = options.per_channel_shape
    parts = [*enumerate(tasks)] if alone else [(None, tasks[0])]
    found = [
        many.first(task, _of_channel(data, c), single_first=single_first)
        for c, task in parts
    ]
    every = np.arange(len(values))

    def once_more(data: Data, tasks: Sequence[Task], which: np.ndarray) -> None:
        for (c, _), task, part in zip(parts, tasks, found, strict=True):
            many.again(task, _of_channel(data, c), part, which)

    if plan.assumes_noise:
        for _ in range(NOISE_ROUNDS):
            data = data._replace(sigma=rows.sigma(_predicted(tasks, found)))
            once_more(data, tasks, every)
    if options.robust:
        data = data._replace(width=rows.width(data, _predicted(tasks, found)))
        tasks = [with_residuals(t, robust=True, penalised=False) for t in tasks]
        once_more(data, tasks, every)
    if plan.may_be_penalised:
        data = data._replace(scale=rows.scale(data))
        tasks = [with_residuals(t, robust=options.robust, penalised=True) for t in tasks]
        more = [many.penalties_of(t, data, f) for t, f in zip(tasks, found, strict=True)]
        once_more(data, tasks, np.flatnonzero(np.sum(more, axis=0) > 0))
    each = [{**f.outcome._asdict(), "runner_up": f.runner_up} for f in found]
    return _joined(each) if alone else each[0]


class _Rows:
    """The rows of a chunk that are used, for what belongs to a texel as a whole."""

    def __init__(self, plan: Plan, values: np.ndarray):
        self._plan, self._all = plan, values
        self._task, self._objective = plan.tasks[0], plan.options.objective
        self._n = self._task.rows.size

    @functools.cached_property
    def values(self) -> np.ndarray:
        """``(t, n, c)``, NaN where unknown; made when first needed, mostly never."""
        used = self._all[:, self._task.rows].astype(np.float64)
        return np.where(np.abs(used) < LARGEST, used, np.nan)

    def sigma(self, fitted: np.ndarray) -> np.ndarray:
        """Standard uncertainties that are assumed if the values are as ``fitted``; of all
        rows of the file."""
        values = self.values
        magnitude = np.abs(np.where(np.isfinite(fitted), fitted, values))
        size = np.abs(values)
        count = np.maximum(np.sum(np.isfinite(size), axis=(1, 2)), 1)
        mean = np.nansum(size, axis=(1, 2)) / count
        median, mean = (v[:, None, None] for v in (_median(size), mean))
        out = np.ones(self._all.shape)
        noise = self._plan.options.noise
        out[:, self._task.rows] = assumed_noise(magnitude, median, mean, noise)
        return out

    def unit(self) -> np.ndarray:
        """1 over the median of the values times cosine, ``(t,)``."""
        median = _median(np.abs(self.values * self._kappa(None)))
        return 1.0 / np.where(median > TINY, median, 1.0)

    def width(self, data: Data, fitted: np.ndarray) -> np.ndarray:
        """That of the robust residual, ``(t,)``; infinite where a fit leaves nothing."""
        kappa, weight = self._kappa(data.unit), self._weight(data)
        target = transform(self._objective, self.values * kappa)
        r = weight * (transform(self._objective, fitted * kappa) - target)
        spread = _median(np.abs(r - _median(r)[:, None, None]))
        return np.where(spread > 0, ROBUST_WIDTH * spread, np.inf)

    def scale(self, data: Data) -> np.ndarray:
        """The sum of squares of the weighted target, ``(t,)``."""
        kappa, weight = self._kappa(data.unit), self._weight(data)
        target = transform(self._objective, self.values * kappa)
        return np.nansum((weight * target) ** 2, axis=(1, 2))

    def _kappa(self, unit: np.ndarray | None) -> np.ndarray:
        kappa = np.asarray(self._task.problem.kappa)[: self._n, None]
        return kappa if unit is None else kappa * unit[:, None, None]

    def _weight(self, data: Data) -> np.ndarray:
        weight = np.asarray(self._task.problem.weight)[0, : self._n, None]
        if data.sigma is None:
            return weight
        sigma = data.sigma[:, self._task.rows]
        usable = (sigma > 0) & (sigma < LARGEST)
        return np.where(usable, weight / np.where(usable, sigma, 1.0), np.nan)


def _median(v: np.ndarray) -> np.ndarray:
    """Of ``(t, n, c)`` the median of every texel, without NaN; NaN of nothing."""
    ordered = np.sort(v.reshape(v.shape[0], -1), axis=1)
    count = np.sum(~np.isnan(ordered), axis=1)
    middle = np.stack([np.maximum(count - 1, 0) // 2, count // 2], axis=1)
    middle = np.minimum(middle, ordered.shape[1] - 1)
    return np.mean(np.take_along_axis(ordered, middle, axis=1), axis=1)


def _of_channel(data: Data, c: int | None) -> Data:
    if c is None:
        return data
    sigma = None if data.sigma is None else data.sigma[:, :, c : c + 1]
    return data._replace(values=data.values[:, :, c : c + 1], sigma=sigma)


def _predicted(tasks: Sequence[Task], found: Sequence[Found]) -> np.ndarray:
    each = [many.predicted(t, f) for t, f in zip(tasks, found, strict=True)]
    return np.concatenate(each, axis=2)


def _joined(each: Sequence[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The fields of the whole from those of every channel.

    Channels with too few values, whose cost is NaN, count for nothing.
    """
    whole = {n: np.stack([e[n] for e in each], axis=-1) for n in each[0]}
    known = np.isfinite(whole["cost"])
    cost = np.sum(whole["cost"], axis=-1, where=known)
    runner_up = np.where(np.isnan(whole["runner_up"]), np.inf, whole["runner_up"])
    least = np.min(runner_up, axis=-1)
    return whole | {
        "coefficients": whole["coefficients"][:, :, 0],
        "coefficient_uncertainty": whole["coefficient_uncertainty"][:, :, 0],
        "cost": np.where(known.any(axis=-1), cost, np.nan),
        "converged": np.all(whole["converged"] | ~known, axis=-1) & known.any(axis=-1),
        "steps": np.max(whole["steps"], axis=-1),
        "used": np.sum(whole["used"], axis=-1),
        "as_promised": np.all(whole["as_promised"], axis=-1),
        "runner_up": np.where(np.isfinite(least), least, np.nan),
    }
