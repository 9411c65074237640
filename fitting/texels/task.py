"""What all texels have in common: directions, model, unknowns, weights, candidates."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from data_formats import Channel, Measurement, MeasurementError
from fitting import problem as problems
from fitting.expression import ModelError
from fitting.model import Model
from fitting.objectives import OBJECTIVES
from fitting.options import FitOptions
from fitting.reduced import Problem, amplitudes
from fitting.rows import Rows, select_rows, weighted
from fitting.starts import candidates
from fitting.texels.box import Box, make_box
from fitting.unseen import without_unseen

# So that reductions over rows have no remainder.
_ROWS_AT_ONCE = 8
# Candidates of one shape unknown, close enough for polynomials between them.
_EVEN = 49


class Task(eqx.Module):
    """Arrays that all texels share, of the rows that are used (``n``, padded).

    ``problem`` is that of a texel, whose values are not looked at. A residual is ``heavy
    (f - y)``, ``heavy (1 or c, n)`` in the fit's own weights, where the cost is `quadratic`
    in the model's value; else these weights are without ``kappa`` (`fitting.objectives`).
    Penalties have their weights for a texel whose scale is 1. ``points (p, k)`` are shapes
    to begin from, ``even``ly apart if that is one unknown. At these
    the model is ``offset + columns x``, linearised at ``x = 0``: ``columns (d, m, p, n)``
    and ``offset (d, p, n)`` for all channels alike (d = 1) or not; ``moving`` tells which
    columns depend on the shape. Where amplitudes are linear they are ``constant (c, b) +
    mixing x``.
    """

    problem: Problem
    box: Box
    heavy: Float[Array, "w n"]
    points: Float[Array, "p k"]
    columns: Float[Array, "d m p n"]
    offset: Float[Array, "d p n"]
    even: bool = eqx.field(static=True)
    moving: tuple[bool, ...] = eqx.field(static=True)
    shifted: bool = eqx.field(static=True)
    n_basis: int = eqx.field(static=True)
    mixing: tuple[tuple[float, ...], ...] | None = eqx.field(static=True)
    constant: Float[Array, "c b"]
    rows: np.ndarray

    @property
    def quadratic(self) -> bool:
        """Whether the residual is linear in the model's value."""
        return _is_quadratic(self.problem)

    @property
    def used(self) -> Array:
        """How many rows count, ``(1 or c,)``."""
        return jnp.sum(self.heavy > 0, axis=-1)

    @property
    def channels(self) -> int:
        """How many there are."""
        return self.box.low.shape[0]


@dataclass(frozen=True)
class Plan:
    """The tasks of texels, one per channel where each has its own shape, and the options,
    whose objective is settled.

    ``unseen`` are sentences on what no row sees and is therefore held.
    """

    tasks: list[Task]
    options: FitOptions
    unseen: list[str]

    @property
    def takes_sigma(self) -> bool:
        """Whether standard uncertainties of the data count."""
        return OBJECTIVES[self.options.objective].uses_sigma and self.options.noise is None

    @property
    def assumes_noise(self) -> bool:
        """Whether standard uncertainties are assumed."""
        return self.options.noise is not None

    @property
    def may_be_penalised(self) -> bool:
        """Whether there are penalties on what the model can break."""
        reciprocal = self.tasks[0].problem.model.reciprocal
        one_sided = not reciprocal and self.options.reciprocity > 0
        return float(self.options.energy) > 0 or one_sided


def check_options(options: FitOptions) -> None:
    """Raises `ModelError` for what is not done for texels."""
    if options.energy == "hard":
        raise ModelError("texels are fitted with a number as weight energy; found 'hard'")
    if options.material:
        raise ModelError("texels take no material; fix the lobe's parameters instead")
    if options.noise is not None and options.objective != "chi2":
        raise ModelError(
            f"texels take noise with the objective chi2; found {options.objective!r}"
        )


def make_plan(
    angles: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    channels: int,
    model: Model,
    options: FitOptions,
    *,
    with_sigma: bool,
) -> Plan:
    """The plan for directions ``theta_i, phi_i, theta_r, phi_r`` (each ``(n,)``, rad).

    Raises `ModelError` for options that are not for texels and `MeasurementError` if no
    row is left. Call with x64 enabled.
    """
    objective = problems.resolve_objective(options.objective, with_sigma)
    options = dataclasses.replace(options, objective=objective)
    check_options(options)
    measurement = _stand_in(angles, channels)
    rows = select_rows(measurement, options.max_theta_deg, model.ways)
    if isinstance(options.weights, np.ndarray):
        rows = weighted(rows, options.weights)
    options, unseen = without_unseen(rows, model, options)
    # Each texel has standard uncertainties of its own.
    problem = problems.prepare(rows, model, dataclasses.replace(options, noise=None))
    n = rows.index.size
    _check_number(n, 1 if options.per_channel_shape else channels, problem)
    problem = _first_rows(problem, -(-n // _ROWS_AT_ONCE) * _ROWS_AT_ONCE)
    problem = dataclasses.replace(
        problem,
        energy_weight=jnp.asarray(float(options.energy) / channels),
        reciprocity_weight=jnp.asarray(float(options.reciprocity) / channels),
    )
    if OBJECTIVES[objective].scaled:
        # Each texel has its own unit.
        problem = dataclasses.replace(problem, kappa=jnp.abs(problem.geometry.cos_o))
    if options.per_channel_shape:
        each = [problems.for_channel(problem, c) for c in range(channels)]
        return Plan([_task(p, rows) for p in each], options, unseen)
    if problem.unknowns.spectral:
        raise ModelError(
            "texels take one value for all channels of a shape parameter that is fixed"
        )
    return Plan([_task(problem, rows)], options, unseen)


def _check_number(n: int, channels: int, problem: Problem) -> None:
    """Raises `MeasurementError` where no texel can have enough values."""
    m, k = problem.unknowns.n_coefficients, problem.unknowns.n_shape
    least = m + -(-k // channels)
    if n < least:
        raise MeasurementError(
            f"{n} of the directions can be used; expected {least} or more for "
            f"{problem.model.expression}"
        )


def _task(problem: Problem, rows: Rows) -> Task:
    points = candidates(problem)
    even = points.shape[1] == 1
    if even:
        points = np.linspace(points[0], points[-1], _EVEN)
    columns, offset = _linearised(problem, jnp.asarray(points))
    n_basis, mixing, constant = _amplitudes(problem)
    shifted = bool(np.any(np.asarray(offset)))
    moves = np.any(np.asarray(columns) != np.asarray(columns)[:, :, :1], axis=(0, 2, 3))
    return Task(
        problem=problem,
        box=make_box(problem.unknowns),
        heavy=_heavy(problem),
        points=jnp.asarray(points),
        columns=columns,
        offset=offset,
        even=even,
        moving=tuple(moves.tolist()),
        shifted=shifted,
        n_basis=n_basis,
        mixing=mixing,
        constant=constant,
        rows=rows.index,
    )


def with_residuals(task: Task, *, robust: bool, penalised: bool) -> Task:
    """The same task with other residuals."""
    problem = dataclasses.replace(task.problem, robust=robust, penalised=penalised)
    return dataclasses.replace(task, problem=problem, heavy=_heavy(problem))


def _is_quadratic(problem: Problem) -> bool:
    return OBJECTIVES[problem.objective].linear and not problem.robust


def _heavy(problem: Problem) -> Array:
    return problem.weight * problem.kappa if _is_quadratic(problem) else problem.weight


def _stand_in(angles, channels: int) -> Measurement:
    """A measurement in these directions: what rows, weights and unknowns are made from."""
    value = np.ones((np.size(angles[0]), channels))
    return Measurement(
        *angles,
        value=value,
        valid=np.ones(value.shape, dtype=bool),
        channels=tuple(Channel(f"{k}") for k in range(channels)),
        sigma=value,
    )


def _first_rows(problem: Problem, count: int) -> Problem:
    """The problem without most of its padding, which is for files of about equal size."""

    def first(a):
        return a[..., :count]

    return dataclasses.replace(
        problem,
        chunk=count,
        geometry=jax.tree.map(first, problem.geometry),
        angles=None,
        angle_rows=None,
        **{
            name: first(getattr(problem, name))
            for name in ("kappa", "weight", "target", "linear_target", "linear_weight")
        },
    )


def _amplitudes(
    problem: Problem,
) -> tuple[int, tuple[tuple[float, ...], ...] | None, Array]:
    """How many there are, and how they follow from the coefficients if that is linear."""
    unknowns = problem.unknowns
    x0 = jnp.zeros((problem.target.shape[0], unknowns.n_coefficients))
    a, da_dx, _ = amplitudes(problem, jnp.zeros(unknowns.n_shape), x0)
    if not all(lobe.linear for lobe in problem.model.lobes):
        return a.shape[1], None, a
    rows = np.asarray(da_dx[0]).tolist()
    return a.shape[1], tuple(map(tuple, rows)), a


def _linearised(problem: Problem, points: Array) -> tuple[Array, Array]:
    """``columns (d, m, p, n)`` and ``offset (d, p, n)`` of the model at every point."""
    columns, offset = _at_points(problem, points)
    alike = np.all(np.asarray(columns) == columns[:1]) and np.all(
        np.asarray(offset) == offset[:1]
    )
    return (columns[:1], offset[:1]) if alike else (columns, offset)


@eqx.filter_jit
def _at_points(problem: Problem, points: Array) -> tuple[Array, Array]:
    """The same of every channel, ``(c, m, p, n)`` and ``(c, p, n)``."""
    unknowns, channels = problem.unknowns, problem.target.shape[0]
    x0 = jnp.zeros((channels, unknowns.n_coefficients))

    def at(u: Array) -> tuple[Array, Array]:
        basis = problem.model.basis(unknowns.shape(u), problem.geometry)
        wide = jnp.stack([jnp.broadcast_to(b, problem.kappa.shape) for b in basis])
        a, da_dx, _ = amplitudes(problem, u, x0)
        return jnp.einsum("cbm,bn->cmn", da_dx, wide), a @ wide

    columns, offset = jax.lax.map(at, points)
    return jnp.moveaxis(columns, 0, 2), jnp.moveaxis(offset, 0, 1)
