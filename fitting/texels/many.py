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
from fitting.texels.scan import scan
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
    """Of a chunk: ``values (t, n, c)`` of all rows as in the file, and ``sigma`` if any."""

    values: Array
    sigma: Array | None


def fit_chunk(
    task: Task, values: np.ndarray, sigma: np.ndarray | None = None, *, count: int
) -> dict[str, np.ndarray]:
    """The fields of `Outcome`, and ``runner_up (t,)``, of the first ``count`` texels.

    ``values (t, n, c)`` have all rows of the file, NaN where unknown; so has ``sigma``.
    Chunks of one size ``t`` share compiled code. Call with x64 enabled.
    """
    data = _Data(jnp.asarray(values), None if sigma is None else jnp.asarray(sigma))
    used = _counted(task, data)
    complete = np.all(np.asarray(used) == np.asarray(task.used), axis=-1)[:count]
    alike = complete & (sigma is None)
    out: dict[str, np.ndarray] = {}
    for own_weights in (False, True):
        texels = np.flatnonzero(alike != own_weights)
        if texels.size:
            for name, part in _fit(task, data, texels, own_weights, used).items():
                whole = out.setdefault(name, np.zeros((count, *part.shape[1:]), part.dtype))
                whole[texels] = part
    return out


def _fit(
    task: Task, data: _Data, texels: np.ndarray, own_weights: bool, used: Array
) -> dict[str, np.ndarray]:
    """All of some texels whose weights are their own, or those of all."""
    starts = _in_batches(lambda t: _scanned(task, data, t, own_weights), texels, (texels,))
    second = starts.cost[:, 1] < _FAR_COSTLIER * starts.cost[:, 0]
    job = np.concatenate([np.arange(texels.size), np.flatnonzero(second)])
    which = np.repeat([0, 1], [texels.size, int(second.sum())])
    state = _descended(
        task, data, texels[job], own_weights,
        starts.u[job, which], starts.x[job, which],
    )  # fmt: skip
    state = _pulled_back(task, data, texels[job], own_weights, state)
    end = jax.tree.map(lambda v: v[: texels.size].copy(), state)
    cost = np.full((2, texels.size), np.inf)
    cost[which, job] = np.where(np.isfinite(state.blocks.cost), state.blocks.cost, np.inf)
    better = np.flatnonzero(cost[1, second] < cost[0, second])
    for whole, every in zip(jax.tree.leaves(end), jax.tree.leaves(state), strict=True):
        whole[np.flatnonzero(second)[better]] = every[texels.size + better]
    found = _in_batches(
        lambda t, s: _finished(task, data, used, t, s, own_weights), texels, (texels, end)
    )
    best, other = cost.min(axis=0), cost.max(axis=0)
    apart = np.isfinite(other) & (other > best * (1.0 + _SAME_MINIMUM)) & (best > 0)
    ratio = np.divide(other, best, out=np.full(best.size, np.nan), where=apart)
    return {**found._asdict(), "runner_up": ratio}


def _descended(
    task: Task, data: _Data, texels: np.ndarray, own_weights: bool, u: Any, x: Any
) -> State:
    """The ends of descents of texels from ``u (t, k)`` and ``x (t, c, m)``."""
    state = _in_batches(lambda u, x: _begun(task, u, x), texels, (u, x))
    state = jax.tree.map(np.array, state)
    waiting = np.arange(texels.size)
    for until in range(_FEW_STEPS, _MAX_STEPS + 1, _FEW_STEPS):
        part = jax.tree.map(lambda v, w=waiting: v[w], state)
        part = _in_batches(
            lambda t, s, n=until: _gone_on(task, data, t, s, own_weights, jnp.asarray(n)),
            waiting, (texels[waiting], part),
        )  # fmt: skip
        for whole, some in zip(jax.tree.leaves(state), jax.tree.leaves(part), strict=True):
            whole[waiting] = some
        waiting = waiting[~part.done]
        if not waiting.size:
            break
    return state


def _pulled_back(
    task: Task, data: _Data, texels: np.ndarray, own_weights: bool, state: State
) -> State:
    """Once more from inside where a shape ended on the flat part of its support's map."""
    periodic = np.array([s == "periodic" for s in task.problem.unknowns.scales], dtype=bool)
    stuck = (np.abs(state.u) > _FLAT) & ~periodic
    again = np.flatnonzero(stuck.any(axis=1))
    if not again.size:
        return state
    u = np.where(stuck, np.sign(state.u) * _INSIDE, state.u)[again]
    new = _descended(task, data, texels[again], own_weights, u, state.blocks.x[again])
    better = new.blocks.cost < state.blocks.cost[again]
    for whole, some in zip(jax.tree.leaves(state), jax.tree.leaves(new), strict=True):
        whole[again[better]] = some[better]
    return state


def _in_batches(function: Any, items: np.ndarray, arrays: Any) -> Any:
    """``function(*arrays)`` of batches of one size, as numpy; the last one is filled up."""
    parts = []
    for first in range(0, items.size, BATCH):
        index = np.minimum(np.arange(first, first + BATCH), items.size - 1)
        batch = jax.tree.map(lambda v, i=index: np.asarray(v)[i], arrays)
        count = min(BATCH, items.size - first)
        out = jax.device_get(function(*batch))
        parts.append(jax.tree.map(lambda v, n=count: v[:n], out))
    return jax.tree.map(lambda *v: np.concatenate(v), *parts)


# ---------------------------------------------------------------- compiled


def _known(data: _Data) -> Array:
    known = jnp.abs(data.values) < _LARGEST
    if data.sigma is not None:
        known = known & (data.sigma > 0) & (data.sigma < _LARGEST)
    return known


@_compiled
def _counted(task: Task, data: _Data) -> Array:
    """How many values of every texel are known and count, ``(t, c)``."""
    counts = (task.heavy > 0)[:, : task.rows.size].T
    return jnp.sum(_known(data)[:, task.rows] & counts, axis=1)


def _of(task: Task, data: _Data, texels: Array, own_weights: bool) -> tuple[Array, Array]:
    """Weights and values ``(t, c, n)`` of some texels; of weights, a leading 1 for all."""
    some = jax.tree.map(lambda v: v[texels], data)
    padding = ((0, 0), (0, 0), (0, task.heavy.shape[-1] - task.rows.size))

    def arranged(v: Array) -> Array:
        rows = jnp.swapaxes(v[:, task.rows], 1, 2).astype(task.heavy.dtype)
        return jnp.pad(rows, padding)

    if not own_weights:
        return task.heavy[None], arranged(some.values)
    known = _known(some)
    heavy = task.heavy * arranged(known)
    if some.sigma is not None:
        heavy = heavy / (arranged(jnp.where(known, some.sigma, 1.0)) + (heavy == 0))
    return heavy, arranged(jnp.where(known, some.values, 0.0))


@_compiled
def _scanned(task: Task, data: _Data, texels: Array, own_weights: bool):
    return _abreast(lambda t: scan(task, *_of(task, data, t, own_weights), _STARTS), texels)


@_compiled
def _begun(task: Task, u: Array, x: Array) -> State:
    return jax.vmap(functools.partial(begin, task))(u, x)


@_compiled
def _gone_on(
    task: Task, data: _Data, texels: Array, state: State, own_weights: bool, until: Array
) -> State:
    def some(part: tuple[Array, State]) -> State:
        heavy, values = _of(task, data, part[0], own_weights)
        one = functools.partial(descend, task, until=until)
        if own_weights:
            return jax.vmap(one)(heavy, values, part[1])
        return jax.vmap(functools.partial(one, heavy[0]))(values, part[1])

    return _abreast(some, (texels, state))


@_compiled
def _finished(
    task: Task, data: _Data, used: Array, texels: Array, state: State, own_weights: bool
) -> Outcome:
    def some(part: tuple[Array, State]) -> Outcome:
        texels, state = part
        heavy, values = _of(task, data, texels, own_weights)
        one = functools.partial(outcome, task)
        if own_weights:
            return jax.vmap(one)(heavy, values, state, used[texels])
        return jax.vmap(functools.partial(one, heavy[0]))(values, state, used[texels])

    return _abreast(some, (texels, state))


def _abreast(function: Any, arrays: Any) -> Any:
    """``function`` of a batch, for so many at a time."""
    own = _ABREAST - _SPARE

    def split(v: Array) -> Array:
        parts = jnp.asarray(v).reshape(-1, own, *jnp.shape(v)[1:])
        spare = [(0, 0), (0, _SPARE)] + [(0, 0)] * (parts.ndim - 2)
        return jnp.pad(parts, spare, mode="edge")

    out = jax.lax.map(function, jax.tree.map(split, arrays))
    return jax.tree.map(lambda v: v[:, :own].reshape(-1, *v.shape[2:]), out)
