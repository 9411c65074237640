"""A chunk of texels: from starts to ends, in batches of one size, where the finished leave.

Texels descend abreast for a few steps; those that are not finished are gathered into new
batches, so that nobody waits long for the slowest. All batches have one size and every
texel's arithmetic is its own, so that a result does not depend on its neighbours.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fitting.texels.abreast import (
    BATCH,
    Data,
    begun,
    counted,
    finished,
    gone_on,
    scanned,
)
from fitting.texels.descent import State
from fitting.texels.task import Task

_FEW_STEPS = 5
_MAX_STEPS = 200
# A second start is refined where the scan does not tell it from the first by this factor.
_FAR_COSTLIER = 4.0
_SAME_MINIMUM = 1e-6
# Beyond this the map onto a parameter's support is flat: from inside once more.
_FLAT, _INSIDE = 7.6, 2.0


class _How(NamedTuple):
    """Whether texels have weights of their own, and whether float32 comes first."""

    own_weights: bool
    single_first: bool


def fit_chunk(
    task: Task,
    values: np.ndarray,
    sigma: np.ndarray | None = None,
    *,
    single_first: bool = False,
) -> dict[str, np.ndarray]:
    """The fields of `Outcome`, and ``runner_up (t,)``, of texels.

    ``values (t, n, c)`` have all rows of the file, NaN where unknown; so has ``sigma``.
    ``single_first``: descend in float32 and then on in float64, for GPUs that are slow at
    the latter. Call with x64 enabled.
    """
    data = Data(values, sigma)
    used = _in_batches(lambda some: counted(task, some), data)
    complete = np.all(used == np.asarray(task.used), axis=-1)
    alike = complete & (sigma is None)
    out: dict[str, np.ndarray] = {}
    for own_weights in (False, True):
        texels = np.flatnonzero(alike != own_weights)
        if texels.size:
            how = _How(own_weights, single_first)
            part = _fit(task, _taken(data, texels), how, used[texels])
            for name, v in part.items():
                whole = out.setdefault(
                    name, np.zeros((used.shape[0], *v.shape[1:]), v.dtype)
                )
                whole[texels] = v
    return out


def _fit(task: Task, data: Data, how: _How, used: np.ndarray) -> dict[str, np.ndarray]:
    """Texels whose weights are their own, or those of all."""
    starts = _in_batches(lambda some: scanned(task, some, how.own_weights), data)
    # A second start is refined only where it may lead to something better.
    second = np.flatnonzero(starts.cost[:, 1] < _FAR_COSTLIER * starts.cost[:, 0])
    state = _refined(task, data, how, starts.u[:, 0], starts.x[:, 0])
    best = np.where(np.isfinite(state.blocks.cost), state.blocks.cost, np.inf)
    ratio = np.full(best.size, np.nan)
    if second.size:
        other = _refined(
            task,
            _taken(data, second),
            how,
            starts.u[second, 1],
            starts.x[second, 1],
        )
        costs = np.stack([best[second], other.blocks.cost])
        costs = np.where(np.isfinite(costs), costs, np.inf)
        _replaced(state, second, other, costs[1] < costs[0])
        low, high = costs.min(axis=0), costs.max(axis=0)
        apart = np.isfinite(high) & (high > low * (1.0 + _SAME_MINIMUM)) & (low > 0)
        ratio[second[apart]] = high[apart] / low[apart]
    found = _in_batches(
        lambda some, s, n: finished(task, some, s, n, how.own_weights), data, state, used
    )
    return {**found._asdict(), "runner_up": ratio}


def _refined(task: Task, data: Data, how: _How, u: np.ndarray, x: np.ndarray) -> State:
    """The ends of descents from ``u (t, k)`` and ``x (t, c, m)``.

    Once more from inside where a shape ended on the flat part of its support's map.
    """
    state = _descended(task, data, how, u, x)
    periodic = np.array([s == "periodic" for s in task.problem.unknowns.scales], dtype=bool)
    stuck = (np.abs(state.u) > _FLAT) & ~periodic
    again = np.flatnonzero(stuck.any(axis=1))
    if again.size:
        u = np.where(stuck, np.sign(state.u) * _INSIDE, state.u)[again]
        some = _taken(data, again)
        new = _descended(task, some, how, u, state.blocks.x[again])
        _replaced(state, again, new, new.blocks.cost < state.blocks.cost[again])
    return state


def _descended(task: Task, data: Data, how: _How, u: Any, x: Any) -> State:
    """The ends of descents from ``u (t, k)`` and ``x (t, c, m)``."""
    if how.single_first:
        # A few steps, since rounding would hide the end.
        rough = _in_precision(
            task, data, how.own_weights, u, x, kind=jnp.float32, most=_FEW_STEPS
        )
        usable = np.isfinite(rough.blocks.cost)
        u = np.where(usable[:, None], rough.u, u)
        x = np.where(usable[:, None, None], rough.blocks.x, x)
    return _in_precision(
        task, data, how.own_weights, u, x, kind=jnp.float64, most=_MAX_STEPS
    )


def _in_precision(
    task: Task, data: Data, own_weights: bool, u: Any, x: Any, *, kind: Any, most: int
) -> State:
    """Descents in one precision, of as many steps at most."""
    u, x = np.asarray(u, kind), np.asarray(x, kind)
    task = jax.tree.map(lambda v: v.astype(kind) if _is_real(v) else v, task)
    state = _in_batches(lambda u, x: begun(task, u, x), u, x)
    waiting = np.arange(u.shape[0])
    for until in range(_FEW_STEPS, most + 1, _FEW_STEPS):
        limit = jnp.asarray(until)
        part = _in_batches(
            lambda some, s, n=limit: gone_on(task, some, s, own_weights, n),
            _taken(data, waiting),
            _taken(state, waiting),
        )
        _replaced(state, waiting, part, np.ones(waiting.size, dtype=bool))
        waiting = waiting[~part.done]
        if not waiting.size:
            break
    return state


def _is_real(v: Any) -> bool:
    return jnp.issubdtype(v.dtype, jnp.floating)


def _taken(arrays: Any, index: np.ndarray) -> Any:
    return jax.tree.map(lambda v: v[index], arrays)


def _replaced(state: State, index: np.ndarray, new: State, where: Any) -> None:
    """Put the chosen ones of new states in the places of the old ones."""
    for whole, some in zip(jax.tree.leaves(state), jax.tree.leaves(new), strict=True):
        whole[index[where]] = some[where]


def _in_batches(function: Any, *arrays: Any) -> Any:
    """``function(*arrays)`` of batches of one size, as numpy; the last one is filled up."""
    count = jax.tree.leaves(arrays)[0].shape[0]
    parts = []
    for first in range(0, count, BATCH):
        last = min(first + BATCH, count)
        batch = jax.tree.map(lambda v, a=first, b=last: _filled(v[a:b]), arrays)
        out = jax.device_get(function(*batch))
        parts.append(jax.tree.map(lambda v, n=last - first: v[:n], out))
    return jax.tree.map(lambda *v: np.concatenate(v), *parts)


def _filled(v: np.ndarray) -> np.ndarray:
    missing = BATCH - v.shape[0]
    return v if not missing else np.concatenate([v, np.repeat(v[-1:], missing, axis=0)])
