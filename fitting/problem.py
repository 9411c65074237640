"""From rows, a model and options to the arrays that the solver works on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from fitting import geometry, objectives
from fitting.model import Model
from fitting.models import Way
from fitting.objectives import OBJECTIVES
from fitting.options import FitOptions
from fitting.reduced import Problem
from fitting.rows import Rows
from fitting.unknowns import make_unknowns

_BUCKETS = (128, 256, 512, 1024, 1536, 2048, 3072, 4096)
_CHUNK = 4096
_RECIPROCITY_PAIRS = 256
_SAME_ANGLE = 1e-10
_MOST_ANGLES = 512


def resolve_objective(name: str, has_sigma: bool) -> str:
    """The objective that ``auto`` stands for."""
    if name == "auto":
        return "chi2" if has_sigma else "log1p"
    return name


@dataclass(frozen=True)
class Terms:
    """The residual's constituents for one objective: factor, weight, target, all numpy."""

    kappa: np.ndarray
    weight: np.ndarray
    target: np.ndarray
    value: np.ndarray


def residual_terms(rows: Rows, objective: str, options: FitOptions) -> Terms:
    """``kappa (n,)``, ``weight (1 or c, n)`` and ``target (c, n)`` of an objective."""
    spec = OBJECTIVES[objective]
    value = np.where(rows.valid, rows.value, 0.0).T
    valid = rows.valid.T
    kappa = (
        np.abs(np.asarray(rows.geometry.cos_o)) if spec.cosine else np.ones(value.shape[1])
    )
    if spec.scaled:
        size = np.median(np.abs(value * kappa)[valid])
        kappa = kappa / (size if size > 0 else 1.0)
    per_row = np.ones(value.shape[1])
    if spec.solid_angle and not _is_named(options.weights, "rows"):
        per_row = np.sqrt(rows.solid_angle)
    weight = per_row[None] * valid
    if spec.uses_sigma:
        weight = weight / np.where(valid, standard_uncertainty(rows, options).T, 1.0)
    if np.all(weight == weight[:1]):
        weight = weight[:1]
    target = objectives.transform(objective, value * kappa)
    return Terms(kappa, weight, target, value)


def _is_named(weights: object, name: str) -> bool:
    return isinstance(weights, str) and weights == name


def standard_uncertainty(rows: Rows, options: FitOptions) -> np.ndarray:
    """``sigma (n, c)``: the data's own, or ``sqrt((a y)^2 + b^2)`` from ``noise``.

    Without either, a = 0.02 and b = 0.02 times the median of the values. ``y`` is the
    fitted value where there is one already (`with_noise_of`), the measured one before.
    """
    if rows.sigma is not None and options.noise is None:
        return rows.sigma
    value = rows.value if rows.fitted is None else rows.fitted
    magnitude = np.abs(np.where(rows.valid, value, 0.0))
    typical = np.median(np.abs(rows.value[rows.valid]))
    relative, absolute = options.noise or (0.02, 0.02 * typical)
    # A relative noise alone leaves nothing where the value is 0.
    floor = 1e-6 * typical + 1e-300
    return np.sqrt((relative * magnitude) ** 2 + absolute**2 + floor**2)


def prepare(
    rows: Rows,
    model: Model,
    options: FitOptions,
    *,
    penalised: bool = False,
    robust_width: float = math.inf,
    row_weights: np.ndarray | None = None,
) -> Problem:
    """The padded problem. ``row_weights`` of 0 hold rows out; call with x64 enabled."""
    objective = resolve_objective(options.objective, rows.sigma is not None)
    terms = residual_terms(rows, objective, options)
    weight = terms.weight if row_weights is None else terms.weight * row_weights
    n_channels, n = terms.target.shape
    size = bucket(n)

    def pad(a: np.ndarray, fill: float = 0.0) -> jax.Array:
        width = [(0, 0)] * (a.ndim - 1) + [(0, size - n)]
        return _float64(np.pad(a, width, constant_values=fill))

    # Padded rows look along the normal, where every lobe is finite.
    normal = geometry.from_angles(0.0, 0.0, 0.0, 0.0)
    padded = jax.tree.map(
        lambda a, z: pad(np.asarray(a), float(np.asarray(z))), rows.geometry, normal
    )
    angles, angle_rows = _polar_angles(rows.geometry, size, model)
    target, padded_weight = pad(terms.target), pad(weight)
    if not OBJECTIVES[objective].linear:
        slope = objectives.slope(objective, terms.value * terms.kappa) * terms.kappa
        linear_target, linear_weight = pad(terms.value), pad(weight * slope)
    elif np.all(terms.kappa == 1.0):
        linear_target, linear_weight = target, padded_weight
    else:
        linear_target, linear_weight = pad(terms.value), pad(weight * terms.kappa)
    scale = float(np.sum((weight * terms.target) ** 2))
    energy = 0.0 if options.energy == "hard" else float(options.energy)
    return Problem(
        model=model,
        unknowns=make_unknowns(model, n_channels, options),
        objective=objective,
        robust=math.isfinite(robust_width),
        chunk=min(size, _CHUNK),
        penalised=penalised,
        geometry=padded,
        angles=angles,
        angle_rows=angle_rows,
        kappa=pad(terms.kappa, 1.0),
        weight=padded_weight,
        target=target,
        linear_target=linear_target,
        linear_weight=linear_weight,
        robust_width=_float64(robust_width),
        energy_weight=_float64(energy * scale / n_channels),
        reciprocity_weight=_float64(options.reciprocity * scale / n_channels),
        scale=_float64(scale),
        pairs=jax.tree.map(_float64, reciprocity_pairs(model.ways)),
    )


def _polar_angles(g: geometry.Geometry, size: int, model: Model):
    """The polar angles that occur and which of them every row has, or twice None.

    Only where a lobe evaluates costly functions of one angle, and where the angles are few
    as on a goniometer. Angles within 1e-10 rad are one.
    """
    if not any(lobe.PER_ANGLE for lobe in model.lobes):
        return None, None
    n = np.size(g.cos_i)
    theta = np.concatenate(
        [
            np.arctan2(np.hypot(g.wix, g.wiy), g.cos_i),
            np.arctan2(np.hypot(g.wox, g.woy), g.cos_o),
        ]
    )
    _, first, index = np.unique(
        np.round(theta / _SAME_ANGLE), return_index=True, return_inverse=True
    )
    if first.size > min(_MOST_ANGLES, n // 2):
        return None, None
    room = max(16, 1 << (first.size - 1).bit_length())
    own = np.concatenate([theta[first], np.zeros(room - first.size)])
    cosine = np.where(np.abs(np.cos(own)) < 1e-15, 0.0, np.cos(own))
    rows = [jnp.asarray(np.pad(i, (0, size - n))) for i in np.split(index, 2)]
    return (_float64(np.sin(own) ** 2), _float64(cosine)), (rows[0], rows[1])


def _float64(a: ArrayLike) -> jax.Array:
    return jnp.asarray(a, dtype=jnp.float64)


def for_channel(problem: Problem, c: int) -> Problem:
    """The problem of one channel alone."""

    def row(a):
        return a[min(c, a.shape[0] - 1)][None]

    fixed = problem.unknowns.shape_constant
    unknowns = dataclasses.replace(
        problem.unknowns,
        coefficient_constant=problem.unknowns.coefficient_constant[:, c : c + 1],
        shape_constant=fixed[:, c : c + 1] if problem.unknowns.spectral else fixed,
        limits=problem.unknowns.limits[c : c + 1],
    )
    weight, target = row(problem.weight), row(problem.target)
    return dataclasses.replace(
        problem,
        unknowns=unknowns,
        weight=weight,
        target=target,
        linear_target=row(problem.linear_target),
        linear_weight=row(problem.linear_weight),
        scale=jnp.sum((weight * target) ** 2),
    )


def bucket(n: int) -> int:
    """A padded size, so that files of similar length share compiled code."""
    for size in _BUCKETS:
        if n <= size:
            return size
    chunks = math.ceil(n / _CHUNK)
    step = 1 << max(0, chunks.bit_length() - 3)
    return math.ceil(chunks / step) * step * _CHUNK


def reciprocity_pairs(ways: Sequence[Way] = ("front",)) -> geometry.Geometry:
    """Quasi-random pairs of directions, even in projected solid angle of both.

    In turn for every way of light; those from back to front are the others exchanged.
    """
    n = np.arange(_RECIPROCITY_PAIRS) + 0.5
    # Generalised golden ratio in four dimensions: the root of x^5 = x + 1.
    base = 1.1673039782614187
    a, b, c, d = (np.mod(n * base ** -(k + 1), 1.0) for k in range(4))
    theta_i, theta_r = np.arcsin(np.sqrt(a)), np.arcsin(np.sqrt(c))
    known = [w for w in ways if w != "up"] or ["down"]
    way = np.asarray(known)[np.arange(n.size) % len(known)]
    return geometry.from_angles(
        np.where(way == "back", np.pi - theta_i, theta_i),
        2 * np.pi * b,
        np.where(way == "front", theta_r, np.pi - theta_r),
        2 * np.pi * d,
    )
