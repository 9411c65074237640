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

from fitting.parameters import from_inside, is_flat
from fitting.texels import abreast
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


class Found(NamedTuple):
    """Of texels: what is known at the end, and the one or two ``ends`` of descents, the
    better one first."""

    outcome: Outcome
    ends: Starts

    @property
    def runner_up(self) -> np.ndarray:
        """Cost of another minimum over that of the best, NaN if there is none."""
        low, high = np.asarray(self.ends.cost).T
        apart = np.isfinite(high) & (high > low * (1.0 + _SAME_MINIMUM)) & (low > 0)
        return np.where(apart, high, np.nan) / np.where(apart, low, 1.0)


def first(task: Task, data: Data, *, single_first: bool = False) -> Found:
    """From the scan to the ends.

    ``data.values (t, n, c)`` have all rows of the file, NaN where unknown.
    ``single_first``: descend in float32 and then on in float64, for GPUs that are slow at
    the latter. Call with x64 enabled.
    """
    own_weights = data.sigma is not None
    found = _first(task, data, own_weights=own_weights, single=single_first)
    other = np.flatnonzero(~_complete(task, found))
    if other.size and not own_weights:
        some = _first(task, _taken(data, other), own_weights=True, single=single_first)
        _replace(found, other, some)
    return found


def again(task: Task, data: Data, found: Found, which: np.ndarray) -> None:
    """Refit some texels with other residuals from all ends: their order may change."""
    complete = _complete(task, found)[which] & (data.sigma is None)
    for own_weights, index in ((False, which[complete]), (True, which[~complete])):
        if not index.size:
            continue
        rest = _Rest(task, _taken(data, index), own_weights)
        ends = _taken(found.ends, index)
        state = rest.refined(_begun(task, ends.u[:, 0], ends.x[:, 0]))
        ends = rest.best_of_two(state, ends, np.isfinite(ends.cost[:, 1]))
        _replace(found, index, Found(rest.finished(state), ends))


def predicted(task: Task, found: Found) -> np.ndarray:
    """The models' values ``(t, n, c)`` at the rows that are used."""
    u, x = found.ends.u[:, 0], found.ends.x[:, 0]
    return _in_batches(lambda _, *some: abreast.predicted(task, *some), u, x)


def penalties_of(task: Task, data: Data, found: Found) -> np.ndarray:
    """What penalties would add to the costs, ``(t,)``."""
    at = data.scale, found.ends.u[:, 0], found.ends.x[:, 0]
    return _in_batches(lambda _, *some: abreast.penalties_of(task, *some), *at)


def _complete(task: Task, found: Found) -> np.ndarray:
    """Texels of which every value is known."""
    channels = task.channels
    return found.outcome.used == np.sum(np.broadcast_to(task.used, channels))


def _first(task: Task, data: Data, *, own_weights: bool, single: bool) -> Found:
    """Of texels whose weights are their own, or those of all, which have to be complete."""
    few = np.asarray(_FIRST_STEPS if task.even and task.quadratic else _FEW_STEPS)

    def begin(count: Any, some: Data) -> tuple[Outcome, State, Starts]:
        texels = arranged(task, some, count, own_weights=own_weights)
        starts, state = scanned(task, texels)
        if single:
            state = _roughly(task, texels, state, few)
        state = gone_on(task, texels, state, few)
        return finished(task, texels, state), state, starts

    outcome, state, starts = _in_batches(begin, data)
    state.done[:] &= outcome.as_promised
    # A second start is refined only where it may lead to something better.
    second = starts.cost[:, 1] < _FAR_COSTLIER * starts.cost[:, 0]
    left = ~state.done | second | _flat(task, state).any(axis=1)
    found = Found(outcome, _ends(state))
    rest = np.flatnonzero(left if own_weights else left & _complete(task, found))
    if rest.size:
        some = _Rest(task, _taken(data, rest), own_weights)
        new = some.refined(_taken(state, rest))
        ends = some.best_of_two(new, _taken(starts, rest), second[rest])
        _replace(found, rest, Found(some.finished(new), ends))
    return found


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
        stuck = np.flatnonzero(flat.any(axis=1))
        if stuck.size:
            u = from_inside(np.asarray(state.u), flat)[stuck]
            some = self._replace(data=_taken(self.data, stuck))
            new = some._descended(_begun(self.task, u, state.blocks.x[stuck]))
            _replace(state, stuck, new, new.blocks.cost < state.blocks.cost[stuck])
        return state

    def best_of_two(self, state: State, starts: Starts, where: np.ndarray) -> Starts:
        """Put the ends from second starts in where they are better; gives both ends."""
        index = np.flatnonzero(where)
        ends = _ends(state)
        if index.size:
            some = self._replace(data=_taken(self.data, index))
            other = some.refined(_begun(self.task, starts.u[index, 1], starts.x[index, 1]))
            costs = np.stack([state.blocks.cost[index], other.blocks.cost])
            costs = np.where(np.isfinite(costs), costs, np.inf)
            better = costs[1] < costs[0]
            two = [_taken(ends, index), _ends(other)]
            for both, mine, theirs in zip(ends, *two, strict=True):
                wide = better.reshape(-1, *(1,) * (both.ndim - 2))
                both[index, 0] = np.where(wide, theirs[:, 0], mine[:, 0])
                both[index, 1] = np.where(wide, mine[:, 0], theirs[:, 0])
            _replace(state, index, other, better)
        return ends

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


def _ends(state: State) -> Starts:
    """Ends with room for a second one, whose cost is infinite."""
    cost = np.where(np.isfinite(state.blocks.cost), state.blocks.cost, np.inf)
    none = np.full_like(cost, np.inf)
    u, x = (np.stack([v, v], axis=1) for v in (state.next_u, state.next_x))
    return Starts(u, np.stack([cost, none], axis=1), x)  # pyright: ignore


def _flat(task: Task, state: State) -> np.ndarray:
    """Which shapes ``(t, k)`` are where a map onto a support is flat."""
    return is_flat(task.problem.unknowns.scales, np.asarray(state.u))


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
