"""A chunk of texels: from starts to ends, in batches of one size, where the finished leave.

Texels descend abreast for a few steps; those that are not finished are gathered into new
batches, so that nobody waits long for the slowest. All batches have one size and every
texel's arithmetic is its own, so that a result does not depend on its neighbours.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting import row_sums
from fitting.texels.descent import State, begin, descend
from fitting.texels.outcome import Outcome, outcome
from fitting.texels.scan import Starts, scan
from fitting.texels.task import Task

# Texels in lockstep, and in one call. Loops in vector registers may leave their last
# elements to scalar code, which rounds differently: there are spare ones, never looked at.
_ABREAST, _SPARE = 128, 16
BATCH = 8 * (_ABREAST - _SPARE)
_FEW_STEPS = 5
_MAX_STEPS = 200
_STARTS = 2
# A second start is refined where the scan does not tell it from the first by this factor.
_FAR_COSTLIER = 4.0
_SAME_MINIMUM = 1e-6
# Beyond this the map onto a parameter's support is flat: from inside once more.
_FLAT, _INSIDE = 7.6, 2.0
_LARGEST = 1e100


def _compiled(function: Callable) -> Callable[..., Any]:
    """Compiled with sums reassociated: in another order, the same for every texel."""
    return eqx.filter_jit(function, compiler_options=row_sums.FAST)  # pyright: ignore


class _Data(NamedTuple):
    """Of texels: ``values (t, n, c)`` of all rows as in the file, and ``sigma`` if any."""

    values: np.ndarray
    sigma: np.ndarray | None


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
    data = _Data(values, sigma)
    used = _in_batches(lambda some: _counted(task, some), data)
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


def _fit(task: Task, data: _Data, how: _How, used: np.ndarray) -> dict[str, np.ndarray]:
    """Texels whose weights are their own, or those of all."""
    starts = _in_batches(lambda some: _scanned(task, some, how.own_weights), data)
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
        lambda some, s, n: _finished(task, some, s, n, how.own_weights), data, state, used
    )
    return {**found._asdict(), "runner_up": ratio}


def _refined(task: Task, data: _Data, how: _How, u: np.ndarray, x: np.ndarray) -> State:
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


def _descended(task: Task, data: _Data, how: _How, u: Any, x: Any) -> State:
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
    task: Task, data: _Data, own_weights: bool, u: Any, x: Any, *, kind: Any, most: int
) -> State:
    """Descents in one precision, of as many steps at most."""
    u, x = np.asarray(u, kind), np.asarray(x, kind)
    task = jax.tree.map(lambda v: v.astype(kind) if _is_real(v) else v, task)
    state = _in_batches(lambda u, x: _begun(task, u, x), u, x)
    waiting = np.arange(u.shape[0])
    for until in range(_FEW_STEPS, most + 1, _FEW_STEPS):
        limit = jnp.asarray(until)
        part = _in_batches(
            lambda some, s, n=limit: _gone_on(task, some, s, own_weights, n),
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


# ---------------------------------------------------------------- compiled


def _known(data: Any) -> Array:
    """Which values are, and have an uncertainty if there are any."""

    def is_usable(v: Array) -> Array:
        return jnp.abs(v.astype(jnp.float64)) < _LARGEST

    known = is_usable(data.values)
    if data.sigma is not None:
        known = known & (data.sigma > 0) & is_usable(data.sigma)
    return known


@_compiled
def _counted(task: Task, data: _Data) -> Array:
    """How many values of every texel are known and count, ``(t, c)``."""
    counts = (task.heavy > 0)[:, : task.rows.size].T
    return jnp.sum(_known(data)[:, task.rows] & counts, axis=1)


def _arranged(task: Task, data: Any, own_weights: bool) -> tuple[Array, Array]:
    """Weights and values ``(t, c, n)``; of weights, a leading 1 for all texels."""
    padding = ((0, 0), (0, 0), (0, task.heavy.shape[-1] - task.rows.size))

    def rows_last(v: Array) -> Array:
        rows = jnp.swapaxes(v[:, task.rows], 1, 2).astype(task.heavy.dtype)
        return jnp.pad(rows, padding)

    if not own_weights:
        return task.heavy[None], rows_last(data.values)
    known = _known(data)
    heavy = task.heavy * rows_last(known)
    if data.sigma is not None:
        heavy = heavy / (rows_last(jnp.where(known, data.sigma, 1.0)) + (heavy == 0))
    return heavy, rows_last(jnp.where(known, data.values, 0.0))


@_compiled
def _scanned(task: Task, data: _Data, own_weights: bool) -> Starts:
    def some(part: _Data) -> Starts:
        return scan(task, *_arranged(task, part, own_weights), _STARTS)

    return _abreast(some, data)


@_compiled
def _begun(task: Task, u: Array, x: Array) -> State:
    return jax.vmap(functools.partial(begin, task))(u, x)


@_compiled
def _gone_on(
    task: Task, data: _Data, state: State, own_weights: bool, until: Array
) -> State:
    one = functools.partial(descend, task, until=until)
    return _each(one, task, data, own_weights, state)


@_compiled
def _finished(
    task: Task, data: _Data, state: State, used: Array, own_weights: bool
) -> Outcome:
    return _each(functools.partial(outcome, task), task, data, own_weights, state, used)


def _each(function: Any, task: Task, data: _Data, own_weights: bool, *others: Any) -> Any:
    """``function(heavy, values, *others)`` of every texel."""

    def some(part: tuple) -> Any:
        heavy, values = _arranged(task, part[0], own_weights)
        if own_weights:
            return jax.vmap(function)(heavy, values, *part[1:])
        return jax.vmap(functools.partial(function, heavy[0]))(values, *part[1:])

    return _abreast(some, (data, *others))


def _abreast(function: Any, arrays: Any) -> Any:
    """``function`` of a batch, for so many at a time."""
    own = _ABREAST - _SPARE

    def split(v: Array) -> Array:
        parts = jnp.asarray(v).reshape(BATCH // own, own, *jnp.shape(v)[1:])
        spare = [(0, 0), (0, _SPARE)] + [(0, 0)] * (parts.ndim - 2)
        return jnp.pad(parts, spare, mode="edge")

    out = jax.lax.map(function, jax.tree.map(split, arrays))
    return jax.tree.map(lambda v: v[:, :own].reshape(BATCH, *v.shape[2:]), out)
