"""Batches of texels in compiled code: all of one size, each texel's arithmetic its own."""

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
_STARTS = 2
_LARGEST = 1e100


def _compiled(function: Callable) -> Callable[..., Any]:
    """Compiled with sums reassociated: in another order, the same for every texel."""
    return eqx.filter_jit(function, compiler_options=row_sums.FAST)  # pyright: ignore


class Data(NamedTuple):
    """Of texels: ``values (t, n, c)`` of all rows as in the file, and ``sigma`` if any."""

    values: np.ndarray
    sigma: np.ndarray | None


def _known(data: Any) -> Array:
    """Which values are, and have an uncertainty if there are any."""

    def is_usable(v: Array) -> Array:
        return jnp.abs(v.astype(jnp.float64)) < _LARGEST

    known = is_usable(data.values)
    if data.sigma is not None:
        known = known & (data.sigma > 0) & is_usable(data.sigma)
    return known


@_compiled
def counted(task: Task, data: Data) -> Array:
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
def scanned(task: Task, data: Data, own_weights: bool) -> Starts:
    def some(part: Data) -> Starts:
        return scan(task, *_arranged(task, part, own_weights), _STARTS)

    return _abreast(some, data)


@_compiled
def begun(task: Task, u: Array, x: Array) -> State:
    return jax.vmap(functools.partial(begin, task))(u, x)


@_compiled
def gone_on(task: Task, data: Data, state: State, own_weights: bool, until: Array) -> State:
    one = functools.partial(descend, task, until=until)
    return _each(one, task, data, own_weights, state)


@_compiled
def finished(
    task: Task, data: Data, state: State, used: Array, own_weights: bool
) -> Outcome:
    return _each(functools.partial(outcome, task), task, data, own_weights, state, used)


def _each(function: Any, task: Task, data: Data, own_weights: bool, *others: Any) -> Any:
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
