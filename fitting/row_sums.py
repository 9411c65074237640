"""Sums over the rows of a problem: what costs time, and nothing of which is kept.

Everything that a step needs of the rows are products of *features*, the basis functions
and their derivatives in the shape, with each other and with the residual. Two ways lead to
the same sums:

- *fused*: all sums are operands of one reduction, a few channels at a time, in which the
  compiler inlines the features. Nothing of the size of the data is ever written, and with
  sums reassociated (`FAST`) the loop runs in vector registers. Features are evaluated
  again for every few channels.
- *in blocks*: features of a block of rows are written, and matrix products make the sums.
  For features that cost more than all that is done with them, that differ by channel, or
  that are many.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.extend.core as jex
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting import objectives, qp
from fitting.geometry import Geometry, PolarAngles

if TYPE_CHECKING:
    from fitting.reduced import Problem

# Lets XLA add in another order, without which its reductions are scalar loops on CPUs.
# NaN and infinities still propagate.
FAST = {"xla_cpu_enable_fast_math": True}
_MOST_CHANNELS, _MOST_SHARED, _MOST_SUMS = 4, 8, 160
_MOST_BLOCKS = 8
# Operations on a row, in all the times that features are evaluated.
_LIGHT = 2000
# What cannot be inlined into a loop over rows, or had better not be.
_HEAVY = frozenset(
    ("gather", "dot_general", "scan", "while", "cond", "sort", "cumsum", "reduce_sum",
     "reduce_max", "reduce_min", "conv_general_dilated", "scatter", "scatter-add")
)  # fmt: skip

Functions = Callable[[Array], tuple[Array, ...]]


class Sums(NamedTuple):
    """Over all rows: ``gram (1 or c, f, f)`` of the features times the residual's slope,
    their product with the residual ``gradient (c, f)``, and ``cost``, its square."""

    gram: Float[Array, "d f f"]
    gradient: Float[Array, "c f"]
    cost: Float[Array, ""]


class _Data(NamedTuple):
    """Of rows: ``kappa (n,)``, ``target (c, n)``, ``weight`` as well, or ``(1, n)``."""

    kappa: Array
    weight: Array
    target: Array


def dependents(problem: Problem) -> tuple[tuple[int, int], ...]:
    """Pairs (basis function, shape unknown) where the one depends on the other."""
    unknowns, model = problem.unknowns, problem.model
    out: list[tuple[int, int]] = []
    first = 0
    for i, lobe in enumerate(model.lobes):
        declared = {f"{model.labels[i]}.{p.name}" for p in lobe.parameters()}
        own = {
            index
            for name, (index, _) in zip(
                unknowns.shape_names, unknowns.shape_source, strict=True
            )
            if name in declared and index >= 0
        }
        count = model.n_basis(i)
        out += [(first + j, k) for j in range(count) for k in sorted(own)]
        first += count
    return tuple(sorted(out, key=lambda jk: (jk[1], jk[0])))


def over_rows(problem: Problem, u: Array, a: Array) -> Sums:
    """The sums at a shape ``u``, for amplitudes ``a (c, b)`` of the basis functions."""
    # Else what does not depend on u is moved out of the solver's loop, written, and read
    # again: 140 bytes a row, at twice the time.
    data = problem.geometry, problem.kappa, problem.weight, problem.target
    u, (geometry, kappa, weight, target) = jax.lax.optimization_barrier((u, data))
    problem = dataclasses.replace(
        problem, geometry=geometry, kappa=kappa, weight=weight, target=target
    )
    listed = _listed_features(problem, u)
    if listed is None:
        return _in_blocks(problem, u, a)
    return _fused(problem, listed, a)


def of_functions(
    problem: Problem,
    u: Array,
    a: Array,
    functions: Callable[[dict[str, Array]], tuple[Array, ...]],
    residual: Callable[[Array], tuple[Array, Array]],
) -> Sums:
    """The same sums over what penalties look at instead of rows."""
    features = _features(problem, u, functions)
    return _contract(features, *residual(_weighted(a, features[..., : a.shape[1], :])))


def by_function(
    problem: Problem,
    u: Array,
    a: Array,
    columns: tuple[Array, Array],
    function: Callable[..., tuple[Array, ...]],
) -> tuple[Array, ...]:
    """Sum over blocks of rows of ``function(f, r, d, columns_x, columns_u)``.

    ``f, r, d (c, n)`` are value, residual and slope; ``columns_x (c, m, n)`` and
    ``columns_u (c, k, n)`` the derivatives of the value in the unknowns, which follow from
    the features by ``columns (c, f, m), (c, f, k)``.
    """

    def block(rows):
        geometry, data = _located(problem, rows)
        features = _features(problem, u, lambda s: problem.model.basis(s, geometry))
        f = _weighted(a, features[..., : a.shape[1], :])
        r, d = _residual(problem, f, data)
        axes = "fn" if features.ndim == 2 else "cfn"
        return function(
            f,
            r,
            jnp.broadcast_to(d, r.shape),
            jnp.einsum(f"cfm,{axes}->cmn", columns[0], features),
            jnp.einsum(f"cfk,{axes}->ckn", columns[1], features),
        )

    return _sum_blocks(problem, _rows(problem), block)


def linear_moments(problem: Problem, u: Array) -> tuple[Array, Array, Array]:
    """Of the residual linearised at the data, ``w (f - y)``: ``gram (1 or c, b, b)`` of the
    basis functions times ``w``, their products ``(c, b)`` with ``w y``, and its square."""
    data = _Data(problem.kappa, problem.linear_weight, problem.linear_target)

    def block(rows):
        geometry, (_, weight, value) = _located(problem, rows)
        basis = _functions(problem, u, lambda s: problem.model.basis(s, geometry))
        heavy = weight * weight
        return (
            _half_gram(basis, heavy),
            _weighted(heavy * value, jnp.swapaxes(basis, -1, -2)),
            jnp.sum(heavy * value * value),
        )

    rows = problem.geometry, problem.angle_rows, data
    half, moment, square = _sum_blocks(problem, rows, block)
    return _symmetric(half, _pairs(moment.shape[-1])), moment, square


# ---------------------------------------------------------------- features


def _with_tangents(problem: Problem, functions: Functions, u: Array) -> list[Array]:
    """Functions of ``u`` (a tuple of arrays) and their needed derivatives."""
    pairs = dependents(problem)
    value, derivatives = functions(u), {}
    for k in range(problem.unknowns.n_shape):
        unit = jnp.asarray(np.eye(u.shape[0])[k], dtype=u.dtype)
        value, derivatives[k] = jax.jvp(functions, (u,), (unit,))
    return [*value, *(derivatives[k][j] for j, k in pairs)]


def _features(problem: Problem, u: Array, functions: Callable) -> Array:
    """Basis functions and their needed derivatives, ``(f, n)``, or ``(c, f, n)``.

    ``functions(shape)`` gives one array per basis function.
    """

    def stacked(of: Functions) -> Array:
        return jnp.stack(_with_tangents(problem, of, u))

    return _per_shape(problem, functions, stacked)


def _functions(problem: Problem, u: Array, functions: Callable) -> Array:
    """The basis functions alone, ``(b, n)`` or ``(c, b, n)``."""
    return _per_shape(problem, functions, lambda of: jnp.stack(of(u)))


def _per_shape(
    problem: Problem, functions: Callable, made: Callable[[Functions], Array]
) -> Array:
    """What is made of functions of ``u``, for every channel where shapes are spectral."""
    unknowns = problem.unknowns

    def of(constant: Array) -> Array:
        return made(lambda v: functions(unknowns.shape(v, constant)))

    if unknowns.spectral:
        return jax.vmap(of)(unknowns.shape_constant.T)
    return of(unknowns.shape_constant[:, 0])


def _listed_features(
    problem: Problem, u: Array
) -> Callable[[Geometry], list[Array]] | None:
    """A function that lists the features of the rows that are fused, if that is cheap:
    elementwise operations, and few sums to be made of them."""
    unknowns = problem.unknowns
    if unknowns.spectral or problem.angles is not None:
        return None
    size = _channels_at_once(problem)
    if not size:
        return None
    times = math.ceil(problem.target.shape[0] / size)
    constant = unknowns.shape_constant[:, 0]

    def features(u: Array, constant: Array, geometry) -> list[Array]:
        def functions(v: Array) -> tuple[Array, ...]:
            return problem.model.basis(unknowns.shape(v, constant), geometry)

        return _with_tangents(problem, functions, u)

    n = problem.kappa.size if times == 1 else _blocks_at_once(problem) * problem.chunk
    some = jax.tree.map(lambda v: jax.ShapeDtypeStruct((n,), v.dtype), problem.geometry)
    closed = jax.make_jaxpr(features)(u, constant, some)
    names = list(_operations(closed.jaxpr, n))
    if len(names) * times > _LIGHT or _HEAVY.intersection(names):
        return None
    return lambda g: jex.jaxpr_as_fun(closed)(*jax.tree.leaves((u, constant, g)))


def _operations(jaxpr: jex.Jaxpr, n_rows: int) -> Iterator[str]:
    """Names of the operations on arrays as long as the rows; one on more counts as more."""
    for equation in jaxpr.eqns:
        inner = [
            p.jaxpr if isinstance(p, jex.ClosedJaxpr) else p
            for p in equation.params.values()
            if isinstance(p, jex.ClosedJaxpr | jex.Jaxpr)
        ]
        name = equation.primitive.name
        if inner and name not in _HEAVY:
            for one in inner:
                yield from _operations(one, n_rows)
            continue
        variables = (*equation.invars, *equation.outvars)
        size = max((getattr(v.aval, "size", 1) for v in variables), default=0)
        for _ in range(size // n_rows):
            yield name


# ---------------------------------------------------------------- residuals


def _residual(problem: Problem, f: Array, data: _Data) -> tuple[Array, Array]:
    """Residual ``(c, n)`` and its slope in ``f``, which may be one for all channels."""
    v = f * data.kappa
    r = data.weight * (objectives.transform(problem.objective, v) - data.target)
    d = data.weight * data.kappa
    if not objectives.OBJECTIVES[problem.objective].linear:
        d = d * objectives.slope(problem.objective, v)
    if problem.robust:
        r, inner = objectives.pseudo_huber(r, problem.robust_width)
        d = d * inner
    return r, d


def _slope_is_shared(problem: Problem) -> bool:
    """Whether the residual's slope is the same for all channels, whatever the values."""
    linear = objectives.OBJECTIVES[problem.objective].linear
    return linear and not problem.robust and problem.weight.shape[0] == 1


def _rows(problem: Problem) -> tuple:
    data = _Data(problem.kappa, problem.weight, problem.target)
    return problem.geometry, problem.angle_rows, data


def _located(problem: Problem, rows: tuple):
    """Geometry, which now knows the table of the polar angles, and data of rows."""
    geometry, angle_rows, data = rows
    if problem.angles is not None:
        polar = PolarAngles(*problem.angles, *angle_rows)
        geometry = dataclasses.replace(geometry, polar=polar)
    return geometry, data


# ---------------------------------------------------------------- fused


def _channels_at_once(problem: Problem) -> int:
    """So many that their sums are not too many for one loop; 0 if one's are."""
    shared = _slope_is_shared(problem)
    n_features, n_channels = _n_features(problem), problem.target.shape[0]
    each = _sums_per_channel(n_features, shared=shared)
    common = _sums_per_channel(n_features, shared=False) - each
    most = _MOST_SHARED if shared else _MOST_CHANNELS
    return min(n_channels, most, (_MOST_SUMS - common) // each)


def _blocks_at_once(problem: Problem) -> int:
    """Of blocks of rows: the largest part of all of them that is not more than a few."""
    blocks = problem.kappa.size // problem.chunk
    return max(k for k in range(1, _MOST_BLOCKS + 1) if blocks % k == 0)


def _n_features(problem: Problem) -> int:
    model = problem.model
    basis = sum(model.n_basis(i) for i in range(len(model.lobes)))
    return basis + len(dependents(problem))


def _sums_per_channel(n_features: int, *, shared: bool) -> int:
    products = 0 if shared else n_features * (n_features + 1) // 2
    return products + n_features + 1


def _fused(problem: Problem, listed: Callable[[Geometry], list[Array]], a: Array) -> Sums:
    """All sums as one reduction over the rows, for a few channels at a time.

    Where that is more than once, it is done for a block of rows after the other: what the
    compiler writes of features once for all channels then stays in the cache.
    """
    n_channels = a.shape[0]
    size = _channels_at_once(problem)
    count = math.ceil(n_channels / size)
    # The last channels overlap those before: no copy of the data to fill them up.
    begin = np.minimum(np.arange(count) * size, n_channels - size)

    def of_rows(rows) -> tuple[Array, Array]:
        geometry, data = _located(problem, rows)

        def some(first: Array | int) -> tuple[Array, Array]:
            def own(v: Array) -> Array:
                if v.shape[0] == 1:
                    return v
                return jax.lax.dynamic_slice_in_dim(v, first, size, axis=0)

            own_data = _Data(data.kappa, own(data.weight), own(data.target))
            return _sums_of_some(problem, listed(geometry), own_data, own(a))

        if count == 1:
            by_channel, common = some(0)
            return by_channel[None], common[None]
        return jax.lax.map(some, jnp.asarray(begin))

    rows = _rows(problem)
    if count == 1:
        blocks, commons = of_rows(rows)
    else:
        at_once = _blocks_at_once(problem)
        blocks, commons = _sum_blocks(problem, rows, of_rows, at_once)
    c = np.arange(n_channels)
    which = np.minimum(c // size, count - 1)
    by_channel, common = blocks[which, c - begin[which]], commons[0]
    n_features = _n_features(problem)
    upper = _pairs(n_features)
    shared = _slope_is_shared(problem)
    half = common[None] if shared else by_channel[:, : len(upper[0])]
    gradient = by_channel[:, -n_features - 1 : -1]
    return Sums(_symmetric(half, upper), gradient, jnp.sum(by_channel[:, -1]))


def _sums_of_some(
    problem: Problem, features: list[Array], data: _Data, a: Array
) -> tuple[Array, Array]:
    """Sums of a few channels ``(c, each)``, and those that all of them share."""
    shared = _slope_is_shared(problem)
    upper = _pairs(len(features))

    def products(slope: Array) -> list[Array]:
        steep = [slope * f for f in features]
        return [steep[i] * steep[j] for i, j in zip(*upper, strict=True)]

    terms: list[Array] = []
    for c in range(a.shape[0]):
        f = sum(a[c, j] * features[j] for j in range(a.shape[1]))
        weight = data.weight[min(c, data.weight.shape[0] - 1)]
        here = _Data(data.kappa, weight, data.target[c])
        r, d = _residual(problem, jnp.asarray(f), here)
        if c == 0 or not shared:
            terms += products(d)
        terms += [(d * r) * f for f in features] + [r * r]
    each = _sums_per_channel(len(features), shared=shared)
    sums = jnp.stack(_add_up(terms))
    common = len(terms) - a.shape[0] * each
    return sums[common:].reshape(a.shape[0], each), sums[:common]


def _add_up(terms: Sequence[Array]) -> tuple[Array, ...]:
    """The sums over the only axis of arrays, in one pass."""
    terms = jnp.broadcast_arrays(*terms)
    zeros = tuple(jnp.zeros((), t.dtype) for t in terms)

    def add(left: tuple[Array, ...], right: tuple[Array, ...]) -> tuple[Array, ...]:
        return tuple(p + q for p, q in zip(left, right, strict=True))

    return jax.lax.reduce(tuple(terms), zeros, add, (0,))


def _pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Row and column of the upper half of a matrix."""
    rows, columns = np.triu_indices(count)
    return rows, columns


def _symmetric(half: Array, upper: tuple[np.ndarray, np.ndarray]) -> Array:
    size = int(upper[0].max()) + 1 if upper[0].size else 0
    where = np.zeros((size, size), dtype=int)
    where[upper] = where[upper[::-1]] = np.arange(upper[0].size)
    return half[:, where]


# ---------------------------------------------------------------- in blocks


def _weighted(weights: Array, features: Array) -> Array:
    """``(c, n)`` from weights ``(c, f)`` of features that channels share, or do not."""
    if features.ndim == 2:
        return weights @ features
    return qp.product(jnp.swapaxes(features, 1, 2), weights)


def _contract(features: Array, r: Array, d: Array) -> Sums:
    half = _half_gram(features, d * d)
    gradient = _weighted(d * r, jnp.swapaxes(features, -1, -2))
    upper = _pairs(features.shape[-2])
    return Sums(_symmetric(half, upper), gradient, jnp.sum(r * r))


def _half_gram(features: Array, weights: Array) -> Array:
    upper = _pairs(features.shape[-2])
    products = features[..., upper[0], :] * features[..., upper[1], :]
    return _weighted(weights, jnp.swapaxes(products, -1, -2))


def _in_blocks(problem: Problem, u: Array, a: Array) -> Sums:
    def block(rows) -> Sums:
        geometry, data = _located(problem, rows)
        features = _features(problem, u, lambda s: problem.model.basis(s, geometry))
        f = _weighted(a, features[..., : a.shape[1], :])
        return _contract(features, *_residual(problem, f, data))

    return _sum_blocks(problem, _rows(problem), block)


def _sum_blocks(problem: Problem, rows: tuple, block: Callable, times: int = 1):
    """Sum of ``block(rows)`` over blocks of rows: memory does not grow with them.

    A block has ``times`` the rows that are usual.
    """
    size = times * problem.chunk
    blocks = problem.kappa.shape[0] // size
    if blocks == 1:
        return block(rows)

    def part(i: Array | int):
        return jax.tree.map(
            lambda v: jax.lax.dynamic_slice_in_dim(v, i * size, size, -1), rows
        )

    def add(carry, i: Array):
        return jax.tree.map(jnp.add, carry, block(part(i))), None

    zero = jax.tree.map(
        lambda s: jnp.zeros(s.shape, s.dtype), jax.eval_shape(lambda: block(part(0)))
    )
    return jax.lax.scan(add, zero, jnp.arange(blocks))[0]
