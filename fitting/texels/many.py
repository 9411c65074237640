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
from jaxtyping import Array

from fitting.texels.abreast import (
    Data,
    Texels,
    arranged,
    begun,
    finished,
    gone_on,
    lanes,
    scanned,
)
from fitting.texels.descent import State
from fitting.texels.outcome import Outcome
from fitting.texels.scan import Starts
from fitting.texels.task import Task

# Where starts are good, and else.
_FIRST_STEPS, _FEW_STEPS = 1, 5
_MAX_STEPS = 200
# A second start is refined where the scan does not tell it from the first by this factor.
_FAR_COSTLIER = 4.0
_SAME_MINIMUM = 1e-6
# Beyond this the map onto a parameter's support is flat: from inside once more.
_FLAT, _INSIDE = 7.6, 2.0


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
    out, complete = _fit(task, data, own_weights=sigma is not None, single=single_first)
    other = np.flatnonzero(~complete)
    if other.size and sigma is None:
        some = _taken(data, other)
        found, _ = _fit(task, some, own_weights=True, single=single_first)
        for name, v in found.items():
            out[name][other] = v
    return out


def _fit(
    task: Task, data: Data, *, own_weights: bool, single: bool
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Of texels whose weights are their own, or those of all; and which are complete, as
    the latter have to be."""
    few = np.asarray(_FIRST_STEPS if task.even else _FEW_STEPS)

    def first(count: Any, some: Data) -> tuple[Outcome, State, Starts, Array]:
        texels = arranged(task, some, count, own_weights=own_weights)
        starts, state = scanned(task, texels)
        if single:
            state = _roughly(task, texels, state, few)
        state = gone_on(task, texels, state, few)
        return finished(task, texels, state), state, starts, texels.used

    outcome, state, starts, used = _in_batches(first, data)
    state.done[:] &= outcome.as_promised
    complete = np.all(used == np.asarray(task.used), axis=-1)
    ratio = np.full(complete.size, np.nan)
    # A second start is refined only where it may lead to something better.
    second = starts.cost[:, 1] < _FAR_COSTLIER * starts.cost[:, 0]
    left = ~state.done | second | _flat(task, state).any(axis=1)
    rest = np.flatnonzero(left if own_weights else left & complete)
    if rest.size:
        some = _Rest(task, _taken(data, rest), own_weights)
        new = some.refined(_taken(state, rest))
        ratio[rest] = some.best_of_two(new, _taken(starts, rest), second[rest])
        _replace(outcome, rest, some.finished(new))
    return {**outcome._asdict(), "runner_up": ratio}, complete


class _Rest(NamedTuple):
    """Texels that take longer than most."""

    task: Task
    data: Data
    own_weights: bool

    def refined(self, state: State) -> State:
        """The ends of descents; once more from inside where a shape ended on the flat part
        of its support's map."""
        state = self._descended(state)
        flat = _flat(self.task, state)
        again = np.flatnonzero(flat.any(axis=1))
        if again.size:
            u = np.where(flat, np.sign(state.u) * _INSIDE, state.u)[again]
            some = self._replace(data=_taken(self.data, again))
            new = some._descended(_begun(self.task, u, state.blocks.x[again]))
            _replace(state, again, new, new.blocks.cost < state.blocks.cost[again])
        return state

    def best_of_two(self, state: State, starts: Starts, where: np.ndarray) -> np.ndarray:
        """Put the ends from second starts in where they are better; gives the costs of
        what was found besides, over those of the best."""
        ratio = np.full(where.size, np.nan)
        index = np.flatnonzero(where)
        if index.size:
            some = self._replace(data=_taken(self.data, index))
            u, x = starts.u[index, 1], starts.x[index, 1]
            other = some.refined(_begun(self.task, u, x))
            costs = np.stack([state.blocks.cost[index], other.blocks.cost])
            costs = np.where(np.isfinite(costs), costs, np.inf)
            _replace(state, index, other, costs[1] < costs[0])
            low, high = costs.min(axis=0), costs.max(axis=0)
            apart = np.isfinite(high) & (high > low * (1.0 + _SAME_MINIMUM)) & (low > 0)
            ratio[index[apart]] = high[apart] / low[apart]
        return ratio

    def finished(self, state: State) -> Outcome:
        """What is known of them at the end."""

        def finish(count: Any, data: Data, some: State) -> Outcome:
            texels = arranged(self.task, data, count, own_weights=self.own_weights)
            return finished(self.task, texels, some)

        return _in_batches(finish, self.data, state)

    def _descended(self, state: State) -> State:
        waiting = np.flatnonzero(~state.done)
        for until in range(_FEW_STEPS, _MAX_STEPS + 1, _FEW_STEPS):
            if not waiting.size:
                break

            def go_on(count: Any, data: Data, some: State, until: int = until) -> State:
                texels = arranged(self.task, data, count, own_weights=self.own_weights)
                return gone_on(self.task, texels, some, np.asarray(until))

            some = _taken(self.data, waiting), _taken(state, waiting)
            new = _in_batches(go_on, *some)
            _replace(state, waiting, new)
            waiting = waiting[~new.done]
        return state


def _flat(task: Task, state: State) -> np.ndarray:
    """Which shapes ``(t, k)`` are where a map onto a support is flat."""
    periodic = np.array([s == "periodic" for s in task.problem.unknowns.scales], dtype=bool)
    return (np.abs(state.u) > _FLAT) & ~periodic


def _roughly(task: Task, texels: Texels, state: State, few: Any) -> State:
    """The beginning of a descent in float64 where one in float32 ended.

    That has few steps, since rounding would hide the end.
    """
    single = jax.tree.map(_single, task)
    some, at = jax.tree.map(_single, (texels, state))
    rough = gone_on(single, some, at, few)
    usable = jnp.isfinite(rough.blocks.cost)
    u = jnp.where(usable[:, None], rough.u, state.u)
    x = jnp.where(usable[:, None, None], rough.blocks.x, state.blocks.x)
    return begun(task, u.astype(state.u.dtype), x.astype(state.u.dtype))


def _single(v: Any) -> Any:
    return v.astype(jnp.float32) if jnp.issubdtype(v.dtype, jnp.floating) else v


def _begun(task: Task, u: Any, x: Any) -> State:
    """The states before descents from ``u (t, k)`` and ``x (t, c, m)``."""
    return _in_batches(lambda _, *some: begun(task, *some), u, x)


def _taken(arrays: Any, index: np.ndarray) -> Any:
    return jax.tree.map(lambda v: v[index], arrays)


def _replace(whole: Any, index: np.ndarray, new: Any, where: Any = ...) -> None:
    """Put new arrays, or the chosen ones of them, in the places of the old ones."""
    for old, some in zip(jax.tree.leaves(whole), jax.tree.leaves(new), strict=True):
        old[index[where]] = some[where]


def _in_batches(function: Any, *arrays: Any) -> Any:
    """``function(count, *arrays)`` of batches of one size, as numpy; the last one, of which
    fewer count, is filled up."""
    count = jax.tree.leaves(arrays)[0].shape[0]
    parts = []
    batch_size = lanes().batch
    for first in range(0, count, batch_size):
        last = min(first + batch_size, count)
        batch = jax.tree.map(lambda v, a=first, b=last: _filled(v[a:b]), arrays)
        out = function(np.asarray(last - first), *batch)
        parts.append(jax.tree.map(lambda v, n=last - first: np.asarray(v)[:n], out))
    return jax.tree.map(lambda *v: np.concatenate(v), *parts)


def _filled(v: np.ndarray) -> np.ndarray:
    missing = lanes().batch - v.shape[0]
    return v if not missing else np.concatenate([v, np.repeat(v[-1:], missing, axis=0)])
