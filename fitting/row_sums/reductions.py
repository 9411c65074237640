"""The sums as operands of reductions: loops that write nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.row_sums.features import listed, n_basis, number
from fitting.row_sums.rows import (
    Data,
    alike,
    cut,
    data_of,
    geometry_of,
    residual,
    slope_is_shared,
    sum_blocks,
)
from fitting.row_sums.sums import Sums, pairs, symmetric

if TYPE_CHECKING:
    from fitting.reduced import Problem

# Lets XLA add in another order, without which its reductions are scalar loops on CPUs.
# NaN and infinities still propagate. Where there are wide registers, there are more of
# them: enough for all the sums of a loop.
FAST = {"xla_cpu_enable_fast_math": True, "xla_cpu_prefer_vector_width": 512}


class Most(NamedTuple):
    """Channels in one loop for which features are inlined, and for which they are read; and
    sums: more accumulators gain nothing, and take long to compile."""

    inlined: int
    held: int
    sums: int


_OF_MANY_ROWS = Most(8, 4, 170)
# Compiling takes longer than all that is gained.
_OF_FEW_ROWS, _FEW = Most(8, 2, 60), 2048


def all_at_once(problem: Problem) -> bool:
    """Whether the sums of all channels are not too many for one loop."""
    channels, most = problem.target.shape[0], _most(problem)
    return channels <= most.inlined and _sums(problem, channels) <= most.sums


def some_at_once(problem: Problem) -> bool:
    """Whether those of the channels are not for which features are `held` in a loop."""
    return _sums(problem, _channels_held(problem)) <= _most(problem).sums


def _most(problem: Problem) -> Most:
    return _OF_FEW_ROWS if problem.kappa.size <= _FEW else _OF_MANY_ROWS


def _channels_held(problem: Problem) -> int:
    return min(problem.target.shape[0], _most(problem).held)


def _sums(problem: Problem, channels: int) -> int:
    n = number(problem)
    products = 0 if slope_is_shared(problem) else n * (n + 1) // 2
    return channels * (products + n + 1)


def inlined(
    problem: Problem, features: Callable[[Geometry], list[Array]], a: Array
) -> Sums:
    """All sums of all channels as one reduction over all rows."""
    f, data = features(problem.geometry), data_of(problem)
    common = _common(problem, f, data)
    sums = add_up([*common, *_of_channels(problem, f, data, a)])
    by_channel = sums[len(common) :].reshape(a.shape[0], -1)
    return _assembled(problem, sums[: len(common)], by_channel)


def held(problem: Problem, u: Array, a: Array) -> Sums:
    """Sums of a few channels at a time, over a block of rows after the other.

    The features of the block are written, once for all channels.
    """
    n_channels, size = a.shape[0], _channels_held(problem)
    count = math.ceil(n_channels / size)
    # The last channels overlap those before: no copy of the data to fill them up.
    begin = np.minimum(np.arange(count) * size, n_channels - size)

    def of_block(first: Array | int) -> tuple[Array, Array]:
        f = jax.lax.optimization_barrier(listed(problem, u, geometry_of(problem, first)))

        def some(channel: Array | int) -> Array:
            def own(v: Array) -> Array:
                if v.shape[0] == 1:
                    return v
                return jax.lax.dynamic_slice_in_dim(v, channel, size, axis=0)

            # Of the data as a whole, for the loops to read them where they are.
            kappa, weight, target = data_of(problem)
            parts = (cut(problem, v, first) for v in (kappa, own(weight), own(target)))
            sums = add_up(_of_channels(problem, f, Data(*parts), own(a)))
            return sums.reshape(size, -1)

        data = Data(*(cut(problem, v, first) for v in data_of(problem)))
        common = add_up(_common(problem, f, data))
        if count == 1:
            return some(0)[None], common
        return jax.lax.map(some, jnp.asarray(begin)), common

    groups, common = sum_blocks(problem, of_block)
    c = np.arange(n_channels)
    which = np.minimum(c // size, count - 1)
    return _assembled(problem, common, groups[which, c - begin[which]])


def _assembled(problem: Problem, common: Array, by_channel: Array) -> Sums:
    n = number(problem)
    half = common[None] if slope_is_shared(problem) else by_channel[:, : -n - 1]
    return Sums(symmetric(half, n), by_channel[:, -n - 1 : -1], jnp.sum(by_channel[:, -1]))


def _common(problem: Problem, features: Sequence[Array], data: Data) -> list[Array]:
    """What is summed once for all channels, ``(n,)`` each."""
    if not slope_is_shared(problem):
        return []
    return _products(features, data.weight[0] * data.kappa)


def _of_channels(
    problem: Problem, features: Sequence[Array], data: Data, a: Array
) -> list[Array]:
    """What is summed for every channel, one after the other, ``(n,)`` each."""
    terms: list[Array] = []
    for c in range(a.shape[0]):
        f = sum(a[c, j] * features[j] for j in range(a.shape[1]))
        weight = data.weight[min(c, data.weight.shape[0] - 1)]
        here = Data(data.kappa, weight, data.target[c])
        r, d = residual(problem, jnp.asarray(f), here)
        if not slope_is_shared(problem):
            terms += _products(features, d)
        terms += [(d * r) * f for f in features] + [r * r]
    return terms


def _products(features: Iterable[Array], slope: Array) -> list[Array]:
    steep = [slope * f for f in features]
    return [steep[i] * steep[j] for i, j in zip(*pairs(len(steep)), strict=True)]


def few_moments(problem: Problem) -> bool:
    """Whether what `moments` adds up is not too much for one loop."""
    channels, count, most = problem.target.shape[0], n_basis(problem), _most(problem)
    sums = count * (count + 1) // 2 + channels * (count + 1)
    return alike(problem) and channels <= most.inlined and sums <= most.sums


def moments(basis: Array, weight: Array, value: Array) -> tuple[Array, Array, Array]:
    """Upper half ``(1, h)`` of the Gram matrix of a weighted basis, its products ``(c, b)``
    with weighted values ``(c, n)``, and the square of these."""
    heavy = [weight * f for f in basis]
    squares = _products(basis, weight)
    own = [f * (weight * v) for v in value for f in heavy]
    square = sum((weight * v) ** 2 for v in value)
    sums = add_up([*squares, *own, jnp.asarray(square)])
    count = len(squares)
    return sums[None, :count], sums[count:-1].reshape(len(value), -1), sums[-1]


def half_gram(basis: Array, weight: Array) -> Array:
    """Upper half ``(1, h)`` of the Gram matrix of a weighted basis."""
    return add_up(_products(basis, weight))[None]


def add_up(terms: Sequence[Array]) -> Array:
    """The sums over all axes of arrays, ``(terms,)``, in one pass."""
    if not terms:
        return jnp.zeros(0)
    terms = jnp.broadcast_arrays(*terms)
    zeros = tuple(jnp.zeros((), t.dtype) for t in terms)

    def add(left: tuple[Array, ...], right: tuple[Array, ...]) -> tuple[Array, ...]:
        return tuple(p + q for p, q in zip(left, right, strict=True))

    return jnp.stack(jax.lax.reduce(tuple(terms), zeros, add, range(terms[0].ndim)))
