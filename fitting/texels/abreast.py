"""Batches of texels in compiled code: all of one size, each texel's arithmetic its own."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting import row_sums
from fitting.compiled import compiled
from fitting.texels.arrow import penalty_cost, value
from fitting.texels.descent import State, begin, descend
from fitting.texels.outcome import Outcome, outcome
from fitting.texels.scan import Starts, scan
from fitting.texels.seen import Seen
from fitting.texels.task import Task

_STARTS = 2
# Values beyond this are no values.
LARGEST = 1e100


class Lanes(NamedTuple):
    """How many texels go in lockstep, and how many such blocks make a batch.

    Loops in vector registers may leave their last elements to scalar code, which rounds
    differently: there are ``spare`` ones, never looked at.
    """

    own: int
    blocks: int
    spare: int = 16

    @property
    def batch(self) -> int:
        """Texels in one call."""
        return self.own * self.blocks


@functools.cache
def lanes() -> Lanes:
    """Those of this process's device."""
    if jax.default_backend() == "cpu":
        return Lanes(112, 16)
    # A GPU is idle between small blocks: with this one it takes half the time.
    return Lanes(16_368, 1)


class Data(NamedTuple):
    """Of texels: ``values (t, n, c)`` of all rows as in the file, and ``sigma`` if any.

    ``unit, width, scale (t,)`` are those of `Seen`.
    """

    values: np.ndarray
    sigma: np.ndarray | None
    unit: np.ndarray | None = None
    width: np.ndarray | None = None
    scale: np.ndarray | None = None


class Texels(NamedTuple):
    """A batch as descents take it, of the rows that count, padded.

    What is ``seen`` has two axes in front, ``(blocks, abreast)``, so many texels at a time
    with the spare ones; but weights may be ``(w, n)`` for all texels. ``used (t, c)`` tells
    how many values are known. Texels after the first ``size`` are not looked at.
    """

    seen: Seen
    used: Array
    size: Array


@compiled(row_sums.FAST, quickly=False)
def arranged(task: Task, data: Data, count: Array, *, own_weights: bool) -> Texels:
    """With weights of their own where not every value of a texel is known."""
    padding = ((0, 0), (0, 0), (0, task.heavy.shape[-1] - task.rows.size))

    def rows_last(v: Any) -> Array:
        rows = jnp.swapaxes(v[:, task.rows], 1, 2)
        return jnp.pad(rows.astype(task.heavy.dtype), padding)

    def is_usable(v: Array) -> Array:
        return jnp.abs(v) < LARGEST

    values, heavy = rows_last(data.values), task.heavy
    known = is_usable(values)
    if data.sigma is not None:
        sigma = rows_last(data.sigma)
        known = known & (sigma > 0) & is_usable(sigma)
        heavy = heavy / jnp.where(known, sigma, 1.0)
    known = known & (task.heavy > 0)
    used = jnp.sum(known, axis=-1, dtype=jnp.int32)
    if own_weights:
        heavy = _split(jnp.where(known, heavy, 0.0))
        values = jnp.where(known, values, 0.0)
    of_texels = jax.tree.map(_split, (data.unit, data.width, data.scale))
    return Texels(Seen(heavy, _split(values), *of_texels), used, count)


@compiled(row_sums.FAST, quickly=False)
def scanned(task: Task, texels: Texels) -> tuple[Starts, State]:
    """Where they begin, and the states there."""

    def some(seen: Seen) -> tuple[Starts, State]:
        starts = scan(task, seen, _STARTS)
        return starts, begun(task, starts.u[:, 0], starts.x[:, 0])

    return _abreast(some, texels)


@compiled(row_sums.FAST, quickly=False)
def begun(task: Task, u: Array, x: Array) -> State:
    """States before descents from ``u (t, k)`` and ``x (t, c, m)``."""
    return jax.vmap(functools.partial(begin, task))(u, x)


@compiled(row_sums.FAST, quickly=False)
def gone_on(task: Task, texels: Texels, state: State, until: Array | np.ndarray) -> State:
    """After ``until`` steps in all, or at the end."""
    return _each(functools.partial(descend, task, until=until), texels, state)


@compiled(row_sums.FAST, quickly=False)
def finished(task: Task, texels: Texels, state: State) -> Outcome:
    """What is known at the ends."""
    return _each(functools.partial(outcome, task), texels, state, texels.used)


@compiled(row_sums.FAST, quickly=False)
def predicted(task: Task, u: Array, x: Array) -> Array:
    """The models' values ``(t, n, c)`` at the rows that are used."""
    values = jax.vmap(functools.partial(value, task))(u, x)
    return jnp.swapaxes(values[:, :, : task.rows.size], 1, 2)


@compiled(row_sums.FAST, quickly=False)
def penalties_of(task: Task, scale: Array, u: Array, x: Array) -> Array:
    """What penalties add to the costs, ``(t,)``."""

    def one(at: tuple[Array, Array, Array]) -> Array:
        nothing = jnp.zeros((1, 0))
        return penalty_cost(task, Seen(nothing, nothing, None, None, at[0]), *at[1:])

    # So many directions of light for each that memory would grow with a batch.
    return jax.lax.map(one, (scale, u, x), batch_size=lanes().own)


def _each(function: Any, texels: Texels, *others: Any) -> Any:
    """``function(seen, *others)`` of every texel."""

    def some(seen: Seen, *others: Any) -> Any:
        if seen.heavy.shape[0] > 1:
            return jax.vmap(function)(seen, *others)
        axes = Seen(None, 0, 0, 0, 0)  # pyright: ignore[reportArgumentType]
        seen = seen._replace(heavy=seen.heavy[0])
        return jax.vmap(function, in_axes=(axes, *(0 for _ in others)))(seen, *others)

    return _abreast(some, texels, *others)


def _abreast(function: Any, texels: Texels, *others: Any) -> Any:
    """``function(seen, *others)`` of the first texels, for so many at a time.

    Weights have a leading 1 where they are those of all.
    """
    others = jax.tree.map(_split, others)
    seen, heavy = texels.seen._replace(heavy=None), texels.seen.heavy  # pyright: ignore
    shared = heavy.ndim == 2

    def part(i: Any) -> Any:
        here, own = jax.tree.map(lambda v: v[i], (seen, others))
        return function(here._replace(heavy=heavy[None] if shared else heavy[i]), *own)

    def add(i: Array, out: Any) -> Any:
        return jax.tree.map(lambda v, new: v.at[i].set(new), out, part(i))

    own, blocks, _ = lanes()
    like = jax.eval_shape(lambda: part(0))
    empty = jax.tree.map(lambda v: jnp.zeros((blocks, *v.shape), v.dtype), like)
    out = jax.lax.fori_loop(0, (texels.size + own - 1) // own, add, empty)
    return jax.tree.map(lambda v: v[:, :own].reshape(own * blocks, *v.shape[2:]), out)


def _split(v: Any) -> Array:
    """``(t, ...)`` as ``(blocks, abreast, ...)``."""
    own, blocks, more = lanes()
    parts = jnp.asarray(v).reshape(blocks, own, *jnp.shape(v)[1:])
    spare = [(0, 0), (0, more)] + [(0, 0)] * (parts.ndim - 2)
    return jnp.pad(parts, spare, mode="edge")
