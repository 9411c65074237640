"""Bounds of the coefficients, and the best coefficients of a quadratic within them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from fitting.reduced import Unknowns
from fitting.texels import small

_MOST_CHOICES = 81


class Box(eqx.Module):
    """Bounds ``low, high (c, m)``, infinite where there is none.

    ``signs`` tells by unknown which of its ends are finite: 1 the low one, -1 the high one.
    """

    signs: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    low: Float[Array, "c m"]
    high: Float[Array, "c m"]

    @property
    def choices(self) -> int:
        """In how many ways every unknown can be free or at one of its ends."""
        return math.prod(1 + len(s) for s in self.signs)

    @property
    def is_small(self) -> bool:
        """Whether all those ways can be tried."""
        return self.choices <= _MOST_CHOICES

    def ends(self, i: int) -> list[tuple[int, Array]]:
        """Sign and value ``(c,)`` of the finite ends of an unknown."""
        return [(s, (self.low if s > 0 else self.high)[:, i]) for s in self.signs[i]]


def make_box(unknowns: Unknowns) -> Box:
    """The box of unknowns whose constraints are bounds only."""
    low, high = np.asarray(unknowns.low), np.asarray(unknowns.high)
    finite = zip(np.isfinite(low[0]), np.isfinite(high[0]), strict=True)
    signs = tuple((1,) * int(a) + (-1,) * int(b) for a, b in finite)
    return Box(signs, unknowns.low, unknowns.high)


def held_at(box: Box, x: Array, slope: Array) -> Bool[Array, "c m"]:
    """Coefficients at a bound that the slope of the cost pushes against."""
    return ((x <= box.low) & (slope >= 0)) | ((x >= box.high) & (slope <= 0))


def projected_newton(
    box: Box, x: Array, hessian: small.Matrix, slope: small.Vector
) -> list[Array]:
    """A step of the coefficients ``x (c, m)`` towards the minimum within the box.

    Those that a bound holds stay (Bertsekas 1982, SIAM J. Control Optim. 20, 221). It is
    the exact minimum where the others end within their bounds. By element, each ``(c,)``.
    """
    m = len(slope)
    held = held_at(box, x, jnp.stack(jnp.broadcast_arrays(*slope), axis=-1))
    masked = [
        [jnp.where(held[:, i] | held[:, j], float(i == j), v) for j, v in enumerate(row)]
        for i, row in enumerate(hessian)
    ]
    pull = [jnp.where(held[:, i], 0.0, g) for i, g in enumerate(slope)]
    (along,) = small.solve(masked, [pull])
    return [
        jnp.clip(x[:, i] - along[i], box.low[:, i], box.high[:, i]) - x[:, i]
        for i in range(m)
    ]


def best_of_choices(
    hessian: small.Matrix, linear: small.Vector, ends: Sequence[Sequence[tuple[int, Array]]]
) -> tuple[list[Array], Array]:
    """The minimiser, element by element, and ``b' x - x' H x / 2`` there.

    Every choice of unknowns held at an end, whose other unknowns are inside, is a point of
    the box, and the minimiser is one of these: the best of them.
    """
    m = len(linear)
    best: list[Array] = []
    most = jnp.asarray(-jnp.inf)
    for choice in itertools.product(*(range(1 + len(e)) for e in ends)):
        held = {i: ends[i][k - 1][1] for i, k in enumerate(choice) if k}
        free = [i for i in range(m) if i not in held]
        pull = [linear[i] - sum(hessian[i][j] * held[j] for j in held) for i in free]
        # Divided once where it is the same for many: compilers do it again for each.
        lower, pivots = small.factored([[hessian[i][j] for j in free] for i in free])
        lower, inverse = jax.lax.optimization_barrier((lower, [1.0 / d for d in pivots]))
        inner = small.solved(lower, inverse, pull)
        found = held | dict(zip(free, inner, strict=True))
        x = [found[i] for i in range(m)]
        gain = 0.5 * small.dot(pull, inner) + sum(
            held[i] * (linear[i] - 0.5 * sum(hessian[i][j] * held[j] for j in held))
            for i in held
        )
        for i in free:
            for sign, value in ends[i]:
                gain = jnp.where(sign * (x[i] - value) >= 0, gain, -jnp.inf)
        better = gain > most
        best = [jnp.where(better, v, w) for v, w in zip(x, best or x, strict=True)]
        most = jnp.where(better, gain, most)
    return best, jnp.asarray(most)
