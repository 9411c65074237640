"""One pass over the directions of one texel: the blocks of the normal equations.

Written for a single texel and mapped over many (`jax.vmap`), so that an item's sums are the
same operations in the same order whatever its neighbours are.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting import penalties
from fitting.reduced import Blocks, amplitudes
from fitting.row_sums import Sums, dependents, of_functions
from fitting.texels import small
from fitting.texels.box import projected_newton
from fitting.texels.seen import Seen, misfit, of_channel, own_problem
from fitting.texels.task import Task

# More operands than these make a loop that the compiler takes long for.
_MOST_SUMS = 160


def evaluate(
    task: Task, seen: Seen, u: Float[Array, " k"], x: Float[Array, "c m"]
) -> Blocks:
    """The blocks at ``(u, x)``, or at the best ``x`` where that follows from the shape."""
    n_basis, m, k = task.n_basis, x.shape[1], u.shape[0]
    a, to_x, to_u = _amplitudes(task, u, x)
    gram, gradient, cost = _sums(task, seen, u, a)
    if task.problem.penalised:
        more = penalty_sums(task, seen, u, jnp.stack(a, axis=-1))
        every = range(len(gradient))
        gram = [[gram[i][j] + more.gram[:, i, j] for j in every] for i in every]
        gradient = [g + more.gradient[:, i] for i, g in enumerate(gradient)]
        cost = cost + more.cost
    if task.problem.resolves and m:
        among = [row[:n_basis] for row in gram[:n_basis]]
        hessian = small.inner(to_x, small.product(among, to_x))
        slope = small.only_column(small.inner(to_x, small.column(gradient[:n_basis])))
        step = projected_newton(task.box, x, hessian, slope)
        moved = small.product(to_x, small.column(step))
        change = small.only_column(small.product([r[:n_basis] for r in gram], moved))
        moved = small.only_column(moved)
        bent = [2.0 * g + d for g, d in zip(gradient, change, strict=True)][:n_basis]
        gained = small.dot(bent, moved)
        # A bound met on the way may make it worse; the step of all unknowns then helps.
        worth = gained < 0
        cost = cost + jnp.sum(jnp.where(worth, gained, 0.0))
        gradient = [
            g + jnp.where(worth, d, 0.0) for g, d in zip(gradient, change, strict=True)
        ]
        a = [p + jnp.where(worth, v, 0.0) for p, v in zip(a, moved, strict=True)]
        x = x + jnp.where(worth[:, None], jnp.stack(step, axis=-1), 0.0)
    # A column of the shape is the derivatives of the basis, weighted by their amplitudes.
    for j, which in dependents(task.problem):
        to_u = [*to_u, [a[j] if i == which else 0.0 for i in range(k)]]
    gram_x = small.product([row[:n_basis] for row in gram[:n_basis]], to_x)
    gram_u = small.product(gram, to_u)
    pull = small.column(gradient)
    like = x[:, 0] if m else seen.values[:, 0]
    return Blocks(
        x=x,
        cost=jnp.maximum(cost, 0.0),
        g_u=jnp.sum(small.stacked(small.inner(to_u, pull), (k, 1), like), axis=0)[:, 0],
        g_x=small.stacked(small.inner(to_x, pull[:n_basis]), (m, 1), like)[:, :, 0],
        h_uu=jnp.sum(small.stacked(small.inner(to_u, gram_u), (k, k), like), axis=0),
        h_xu=small.stacked(small.inner(to_x, gram_u[:n_basis]), (m, k), like),
        h_xx=small.stacked(small.inner(to_x, gram_x), (m, m), like),
    )


def _amplitudes(
    task: Task, u: Array, x: Array
) -> tuple[list[Array], small.Matrix, small.Matrix]:
    """Of the basis functions, with derivatives in ``x`` and ``u``, by element ``(c,)``."""
    m, k, n_basis = x.shape[1], u.shape[0], task.n_basis
    if task.mixing is not None:
        a = [
            task.constant[:, j] + sum(f * x[:, i] for i, f in enumerate(row) if f)
            for j, row in enumerate(task.mixing)
        ]
        return a, task.mixing, [[0.0] * k for _ in range(n_basis)]
    a, da_dx, da_du = amplitudes(task.problem, u, x)
    return (
        [a[:, j] for j in range(n_basis)],
        [[da_dx[:, j, i] for i in range(m)] for j in range(n_basis)],
        [[da_du[:, j, i] for i in range(k)] for j in range(n_basis)],
    )


def _sums(
    task: Task, seen: Seen, u: Array, a: list[Array]
) -> tuple[list[list[Array]], list[Array], Array]:
    """Products ``(1 or c,)`` of weighted features with each other, ``(c,)`` with the
    residual, and the square of that."""
    features = _features(task, u)
    count, channels = len(features), seen.values.shape[0]
    upper = [(i, j) for i in range(count) for j in range(i, count)]
    shared = task.quadratic and seen.heavy.shape[0] == 1
    if len(upper) * (1 if shared else channels) + channels * (count + 1) > _MOST_SUMS:
        gram, gradient, cost = _by_products(task, features, seen, jnp.stack(a, axis=-1))
        rows = [[gram[:, i, j] for j in range(count)] for i in range(count)]
        return rows, [*gradient.T], cost
    products: list[list[Array]] = []
    residuals: list[list[Array]] = []
    for c in range(channels):
        f = sum(a[j][c] * features[j] for j in range(len(a)))
        r, slope = misfit(task, of_channel(seen, c), jnp.asarray(f))
        some = [slope * v for v in features]
        if c == 0 or not shared:
            products.append([some[i] * some[j] for i, j in upper])
        residuals.append([*(v * r for v in some), r * r])
    sums = iter(add_up([term for part in (*products, *residuals) for term in part]))
    half = [[next(sums) for _ in upper] for _ in products]
    own = [[next(sums) for _ in range(count + 1)] for _ in residuals]
    found = dict(zip(upper, map(jnp.stack, zip(*half, strict=True)), strict=True))
    gram = [[found[min(i, j), max(i, j)] for j in range(count)] for i in range(count)]
    *gradient, square = map(jnp.stack, zip(*own, strict=True))
    return gram, gradient, jnp.sum(square)


def _features(task: Task, u: Array) -> list[Array]:
    """Basis functions and their derivatives in the shape, where they depend on it."""
    problem = task.problem
    geometry, like = problem.geometry, problem.kappa

    def basis(v: Array) -> tuple[Array, ...]:
        out = problem.model.basis(problem.unknowns.shape(v), geometry)
        return tuple(jnp.broadcast_to(b, like.shape) for b in out)

    pairs = dependents(problem)
    value, along = basis(u), {}
    for k in range(u.shape[0]):
        unit = jnp.asarray(np.eye(u.shape[0])[k], dtype=u.dtype)
        value, along[k] = jax.jvp(basis, (u,), (unit,))
    return [*value, *(along[k][j] for j, k in pairs)]


def columns(task: Task, u: Array, x: Array) -> list[tuple[Array, list[Array], list[Array]]]:
    """Per channel the model's value ``(n,)`` and its derivatives in ``x[c]`` and ``u``."""
    a, to_x, to_u = _amplitudes(task, u, x)
    features, n_basis = _features(task, u), task.n_basis
    basis = features[:n_basis]
    pairs = dependents(task.problem)
    out = []
    for c in range(x.shape[0]):

        def along(weights: small.Vector, c: int = c) -> Array:
            here = [w if isinstance(w, float) else w[c] for w in weights]
            return small.dot(here, basis)

        in_x = [along([row[i] for row in to_x]) for i in range(x.shape[1])]
        in_u = [
            along([row[q] for row in to_u])
            + sum(
                a[j][c] * f
                for f, (j, p) in zip(features[n_basis:], pairs, strict=True)
                if p == q
            )
            for q in range(u.shape[0])
        ]
        out.append((along(a), in_x, in_u))
    return out


def penalty_sums(task: Task, seen: Seen, u: Array, a: Array) -> Sums:
    """The same sums over what penalties look at, for amplitudes ``a (c, b)``."""
    problem = own_problem(task, seen)
    return functools.reduce(
        lambda p, q: Sums(*map(jnp.add, p, q)),
        [of_functions(problem, u, a, *penalty) for penalty in penalties.of(problem)],
    )


def penalty_cost(task: Task, seen: Seen, u: Array, x: Array) -> Array:
    """What penalties add to the cost."""
    amplitude, _, _ = _amplitudes(task, u, x)
    return penalty_sums(task, seen, u, jnp.stack(amplitude, axis=-1)).cost


def value(task: Task, u: Array, x: Array) -> Float[Array, "c n"]:
    """The model's value at all rows, padded."""
    amplitude, _, _ = _amplitudes(task, u, x)
    return jnp.stack(amplitude, axis=-1) @ jnp.stack(_features(task, u)[: task.n_basis])


def _by_products(
    task: Task, features: list[Array], seen: Seen, a: Array
) -> tuple[Array, Array, Array]:
    """The same sums as matrix products, for many features or channels."""
    f = jnp.stack(features)
    r, slope = misfit(task, seen, a @ f[: a.shape[1]])
    some = slope[:, None] * f
    gram = jnp.einsum("wfn,wgn->wfg", some, some)
    each = "cfn" if slope.shape[0] > 1 else "fn"
    some = some if slope.shape[0] > 1 else some[0]
    return gram, jnp.einsum(f"{each},cn->cf", some, r), jnp.sum(r * r)


def add_up(terms: list[Array]) -> tuple[Array, ...]:
    zeros = tuple(jnp.zeros((), t.dtype) for t in terms)

    def add(left: tuple[Array, ...], right: tuple[Array, ...]) -> tuple[Array, ...]:
        return tuple(p + q for p, q in zip(left, right, strict=True))

    return jax.lax.reduce(tuple(terms), zeros, add, (0,))
