"""`fit_many`: arrays in, arrays out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from data_formats import MeasurementError
from fitting.expression import ModelError
from fitting.model import Model
from fitting.options import FitOptions
from fitting.problem import resolve_objective
from fitting.texels.abreast import lanes
from fitting.texels.rounds import fit_chunk
from fitting.texels.task import Plan, make_plan

if TYPE_CHECKING:
    from fitting.texels.source import Source

# Of measured values in one chunk, and the most texels: what is in memory at a time.
_CHUNK_BYTES = 48_000_000
_CHUNK_TEXELS = 14336
OBJECTIVE = "l2cos"


@dataclass(frozen=True)
class TexelFits:
    """Fits of texels, arrays of their leading shape ``(t,)`` or ``(h, w)``.

    - ``parameters``: by name, shape parameters ``(t,)`` and coefficients ``(t, c)``; all
      ``(t, c)`` where each channel has its own shape.
    - ``uncertainties``: the same, standard (k = 1), those of `fitting.uncertainty`; NaN
      for what is fixed, held by a bound or of no influence.
    - ``cost``: the sum of squares that was made small.
    - ``converged``, ``steps``, ``used``: whether and in how many steps, and of how many
      values.
    - ``runner_up``: cost of another minimum over that of this one, NaN if none came near.

    All parameters are NaN where too few values are known in one of the channels; where each
    has its own shape, those of that channel, which then counts for nothing.
    """

    parameters: dict[str, np.ndarray]
    uncertainties: dict[str, np.ndarray]
    cost: np.ndarray
    converged: np.ndarray
    steps: np.ndarray
    used: np.ndarray
    runner_up: np.ndarray


def texel_options(settings: Mapping[str, Any]) -> FitOptions:
    """Options for texels: `FitOptions` with other defaults, the objective `OBJECTIVE`."""
    known = {f.name for f in dataclasses.fields(FitOptions)}
    if unknown := set(settings) - known:
        raise ModelError(f"there is no option {', '.join(sorted(unknown))}; see FitOptions")
    own: dict[str, Any] = {"objective": OBJECTIVE, "energy": 0.0, "reciprocity": 0.0}
    return FitOptions(**(own | dict(settings)))


def fit_many(
    values: Any,
    directions: tuple[Any, Any, Any, Any],
    model: Model | str,
    *,
    sigma: Any = None,
    valid: Any = None,
    progress: Callable[[int], None] | None = None,
    single_first: bool = False,
    **settings: Any,
) -> TexelFits:
    """Fit a model to every texel of a sample, all measured in the same directions.

    ``values (t, n, c)`` or ``(h, w, n, c)``, 1/sr without cosine, are an array or a data
    set of HDF5 that is read in chunks; what is NaN, or where ``valid`` of the same shape is
    false, is left out. ``directions`` are ``theta_i, phi_i, theta_r, phi_r (n,)`` in rad.
    ``sigma``, standard uncertainties for ``chi2``, has the shape of the values.
    ``settings`` are fields of `FitOptions`, whose defaults here are the quickest: the
    objective ``l2cos``, in which the residual is linear in the model's value, and no
    penalties. Others take several times as long. Solid angles are those of all directions,
    also for texels that lack some. ``progress`` is called with texels done.
    ``single_first``: float32 as far as it goes and then float64, for GPUs that are slow at
    the latter.

    Every texel's result is the same, bit for bit, whatever its neighbours are. Raises
    `MeasurementError` for arrays that do not fit together and `ModelError` for a senseless
    model or option.
    """
    options = texel_options(settings)
    model = model if isinstance(model, Model) else Model(model)
    _check(values, directions, options, sigma=sigma, valid=valid)
    leading, (n, channels) = values.shape[:-2], values.shape[-2:]
    angles = tuple(np.asarray(a, dtype=np.float64) for a in directions)
    parts: list[dict[str, np.ndarray]] = []
    with jax.enable_x64(True):
        plan = make_plan(
            angles,  # pyright: ignore[reportArgumentType]
            channels, model, options, with_sigma=sigma is not None,
        )  # fmt: skip
        lines = lines_per_chunk(values.shape)
        for first in range(0, leading[0], lines):
            here = slice(first, first + lines)
            block = [
                None if v is None else np.asarray(v[here]).reshape(-1, n, channels)
                for v in (values, sigma, valid)
            ]
            parts.append(fit_block(plan, *block, single_first=single_first))  # pyright: ignore
            if progress is not None:
                progress(min(first + lines, leading[0]) * math.prod(leading[1:]))
    whole = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
    return _named(plan, whole, leading)


def plan_of(source: Source, model: Model, settings: Mapping[str, Any]) -> Plan:
    """The plan for a file. Raises as `make_plan`; call with x64 enabled."""
    return make_plan(
        source.directions, source.shape[-1], model, texel_options(settings),
        with_sigma=source.has_sigma,
    )  # fmt: skip


def lines_per_chunk(shape: tuple[int, ...]) -> int:
    """How many indices of the first axis of values of this shape a chunk has."""
    *others, n, channels = shape[1:]
    texels = min(_CHUNK_TEXELS, _CHUNK_BYTES // (8 * n * channels))
    batch = lanes().batch
    texels = max(batch, texels // batch * batch)
    return max(1, min(shape[0], texels // max(1, math.prod(others))))


def fit_block(
    plan: Plan,
    values: np.ndarray,
    sigma: np.ndarray | None,
    valid: np.ndarray | None,
    *,
    single_first: bool = False,
) -> dict[str, np.ndarray]:
    """`fit_chunk` of values ``(t, n, c)`` that count where ``valid`` is not 0."""
    if valid is not None:
        values = np.where(valid != 0, values, np.nan)
    return fit_chunk(plan, values, sigma, single_first=single_first)


def named(
    plan: Plan, found: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Parameters and uncertainties by name, in the model's order."""
    problem = plan.tasks[0].problem
    unknowns = problem.unknowns
    parameters: dict[str, np.ndarray] = {}
    uncertainties: dict[str, np.ndarray] = {}
    for kind, names in (
        ("shape", unknowns.shape_names),
        ("coefficient", unknowns.coefficient_names),
    ):
        plural = "coefficients" if kind == "coefficient" else kind
        for i, name in enumerate(names):
            parameters[name] = found[plural][:, i]
            uncertainties[name] = found[f"{kind}_uncertainty"][:, i]
    order = problem.model.parameters()
    for name, declared in order.items():
        if declared.scale == "periodic":
            first, last = declared.support
            parameters[name] = np.mod(parameters[name] - first, last - first)
    return {n: parameters[n] for n in order}, {n: uncertainties[n] for n in order}


def _named(plan: Plan, found: dict[str, np.ndarray], leading: tuple[int, ...]) -> TexelFits:
    def shaped(v: np.ndarray) -> np.ndarray:
        return v.reshape(*leading, *v.shape[1:])

    parameters, uncertainties = named(plan, found)
    plain = ("cost", "converged", "steps", "used", "runner_up")
    return TexelFits(
        {k: shaped(v) for k, v in parameters.items()},
        {k: shaped(v) for k, v in uncertainties.items()},
        **{k: shaped(found[k]) for k in plain},
    )


def _check(
    values: Any, directions: Any, options: FitOptions, *, sigma: Any, valid: Any
) -> None:
    shape: tuple[int, ...] = tuple(getattr(values, "shape", ()))
    if len(shape) not in (3, 4) or 0 in shape:
        raise MeasurementError(
            f"values have the shape {shape}; expected (t, n, c) or (h, w, n, c): texels, "
            "directions, channels"
        )
    if np.dtype(values.dtype).kind not in "fiu":
        raise MeasurementError(f"values are of type {values.dtype}; expected numbers")
    rows = shape[len(shape) - 2]
    sizes = [np.shape(a) for a in directions]
    if len(sizes) != 4 or any(s != (rows,) for s in sizes):
        raise MeasurementError(
            f"directions have the shapes {sizes}; expected theta_i, phi_i, theta_r, phi_r, "
            f"each ({rows},), as many as the values' last axis but one"
        )
    for name, other in (("sigma", sigma), ("valid", valid)):
        if other is not None and tuple(other.shape) != shape:
            raise MeasurementError(
                f"{name} has the shape {tuple(other.shape)}; expected that of the values, "
                f"{shape}"
            )
    chi2 = resolve_objective(options.objective, sigma is not None) == "chi2"
    if chi2 != (sigma is not None or options.noise is not None):
        raise ModelError(
            "the objective chi2 and standard uncertainties (sigma or noise) go together: "
            "give both or neither"
        )
