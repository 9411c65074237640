"""Constraints as rows of the least-squares problem: energy and reciprocity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting import albedo

if TYPE_CHECKING:
    from fitting.reduced import Problem

# Where the penalty looks at the directional albedo: Gauss-Legendre nodes in the cosine,
# which reach the grazing directions, where Schlick lobes break the limit first.
_COSINES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(8)[0]
_NODES = 16


class Penalty(NamedTuple):
    """``functions(shape)``, one array per basis function, whose sum is penalised, and the
    ``residual`` of that sum ``(c, n)`` with its slope."""

    functions: Callable[[dict[str, Array]], tuple[Array, ...]]
    residual: Callable[[Array], tuple[Array, Array]]


def of(problem: Problem) -> Iterator[Penalty]:
    """The penalties that a problem may need: none of what its lobes cannot break."""
    yield _energy(problem)
    if not all(lobe.RECIPROCAL for lobe in problem.model.lobes):
        yield _reciprocity(problem)


def _energy(problem: Problem) -> Penalty:
    """The hinge of the directional albedo above 1."""
    model = problem.model
    azimuths = (0.0, 0.5 * math.pi) if model.anisotropic else (0.0,)

    def albedos(shape: dict[str, Array]) -> tuple[Array, ...]:
        out: list[Array] = []
        for i, lobe in enumerate(model.lobes):
            own = model.of_lobe(i, shape)
            there = [
                albedo.albedo_basis(
                    lobe, own, jnp.asarray(_COSINES), nodes=_NODES, azimuth=azimuth
                )
                for azimuth in azimuths
            ]
            out += [jnp.concatenate(parts) for parts in zip(*there, strict=True)]
        return tuple(out)

    def hinge(total: Array) -> tuple[Array, Array]:
        w = jnp.sqrt(problem.energy_weight / total.shape[1])
        return w * jax.nn.relu(total - 1.0), w * (total > 1.0)

    return Penalty(albedos, hinge)


def _reciprocity(problem: Problem) -> Penalty:
    """``f(wi, wo) - f(wo, wi)`` on quasi-random pairs of directions."""

    def differences(shape: dict[str, Array]) -> tuple[Array, ...]:
        there = problem.model.basis(shape, problem.pairs)
        back = problem.model.basis(shape, problem.pairs.swapped)
        return tuple(f - b for f, b in zip(there, back, strict=True))

    def plain(total: Array) -> tuple[Array, Array]:
        w = jnp.sqrt(problem.reciprocity_weight / total.shape[1])
        return w * total, w * jnp.ones_like(total)

    return Penalty(differences, plain)
