"""Constraints as rows of the least-squares problem: energy and reciprocity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting import albedo

if TYPE_CHECKING:
    from fitting.geometry import Geometry
    from fitting.model import Model
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
    if not problem.model.reciprocal:
        yield _reciprocity(problem)


def _energy(problem: Problem) -> Penalty:
    """The hinge of the directional albedo above 1, for light from either side: what is
    reflected and transmitted together."""
    model = problem.model
    azimuths = (0.0, 0.5 * math.pi) if model.anisotropic else (0.0,)

    def albedos(shape: dict[str, Array]) -> tuple[Array, ...]:
        there = [
            albedo.basis_albedo(
                model,
                shape,
                jnp.asarray(_COSINES),
                nodes=_NODES,
                azimuth=azimuth,
                ways=albedo.LEAVING[side],
            )
            for azimuth in azimuths
            for side in albedo.lit_sides(model)
        ]
        return tuple(jnp.concatenate(parts) for parts in zip(*there, strict=True))

    def hinge(total: Array) -> tuple[Array, Array]:
        w = jnp.sqrt(problem.energy_weight / total.shape[1])
        return w * jax.nn.relu(total - 1.0), w * (total > 1.0)

    return Penalty(albedos, hinge)


def _reciprocity(problem: Problem) -> Penalty:
    """``f(wi, wo) / n_o^2 - f(wo, wi) / n_i^2`` on quasi-random pairs of directions."""
    there, back = problem.pairs, problem.pairs.swapped

    def differences(shape: dict[str, Array]) -> tuple[Array, ...]:
        return tuple(
            f - b
            for f, b in zip(
                invariants(problem.model, shape, there),
                invariants(problem.model, shape, back),
                strict=True,
            )
        )

    def plain(total: Array) -> tuple[Array, Array]:
        w = jnp.sqrt(problem.reciprocity_weight / total.shape[1])
        return w * total, w * jnp.ones_like(total)

    return Penalty(differences, plain)


def invariants(
    model: Model, shape: Mapping[str, Array], geometry: Geometry
) -> tuple[Array, ...]:
    """Basis functions over the squared index on the detector's side, 1/sr.

    The index in front is 1. These stay the same when source and detector are exchanged, by
    generalised reciprocity (Walter et al. 2007, sec. 4.2), and for reflected light by
    Helmholtz's.
    """
    leaves_behind = (geometry.cos_i > 0) & (geometry.cos_o < 0)
    index = jnp.where(leaves_behind, model.relative_index(shape), 1.0)
    return tuple(basis / (index * index) for basis in model.basis(shape, geometry))
