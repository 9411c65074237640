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
from fitting.padding import CHUNK, padded, room, rows_at_once
from fitting.reduced import Problem
from fitting.rows import Rows
from fitting.unknowns import make_unknowns

_RECIPROCITY_PAIRS = 256
_SAME_ANGLE = 1e-10
_MOST_ANGLES = 512
# Relative, and as a share of the median.
_NOISE = 0.02
# Sizes below this have no square.
TINY = 1e-140
# How often a fit is made again with the noise that follows from it.
NOISE_ROUNDS = 2


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
    kappa, weight = _factors(rows, objective, options)
    value = np.where(rows.valid, rows.value, 0.0).T
    target = objectives.transform(objective, value * kappa)
    return Terms(kappa, weight, target, value)


def _factors(
    rows: Rows, objective: str, options: FitOptions
) -> tuple[np.ndarray, np.ndarray]:
    """``kappa (n,)`` and ``weight (1 or c, n)``: one for all channels where it can be."""
    spec = OBJECTIVES[objective]
    kappa = np.ones(rows.index.size)
    if spec.cosine:
        kappa = np.abs(rows.geometry.cos_o)
    if spec.scaled:
        size = np.median(np.abs(rows.value * kappa[:, None])[rows.valid])
        kappa = kappa / (size if size > 0 else 1.0)
    weight = np.ones((1, kappa.size))
    if spec.solid_angle and not _is_named(options.weights, "rows"):
        weight = np.sqrt(rows.solid_angle)[None]
    if not rows.valid.all():
        weight = weight * rows.valid.T
    if spec.uses_sigma:
        sigma = standard_uncertainty(rows, options)
        weight = weight / np.where(rows.valid, sigma, 1.0).T
    if len(weight) > 1 and np.all(weight == weight[:1]):
        weight = weight[:1]
    return kappa, weight


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
    known = np.abs(rows.value[rows.valid])
    return assumed_noise(magnitude, np.median(known), np.mean(known), options.noise)


def assumed_noise(
    magnitude: np.ndarray,
    median: ArrayLike,
    mean: ArrayLike,
    noise: tuple[float, float] | None,
) -> np.ndarray:
    """Standard uncertainties above 0 of values of a magnitude, with their median and mean.

    The mean is looked at where the median is 0, and where that is, too, all are alike.
    """
    median, mean = np.asarray(median), np.asarray(mean)
    typical = np.where(median > TINY, median, np.where(mean > TINY, mean, 1.0))
    relative, absolute = noise or (_NOISE, _NOISE * typical)
    # A relative noise alone leaves nothing where the value is 0.
    floor = 1e-6 * typical
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
    kappa, weight = _factors(rows, objective, options)
    weight = weight if row_weights is None else weight * row_weights
    n_channels, size = rows.value.shape[1], rows.padded.cos_i.size
    value = _by_channel(rows, size)
    target = value
    kappa = padded(kappa, size, 1.0)
    linear_weight = weight = padded(weight, size)
    if not OBJECTIVES[objective].linear:
        target, linear_weight = room(value.shape), room(value.shape)
        for c in range(n_channels):
            v = value[c] * kappa
            target[c] = objectives.transform(objective, v)
            slope = objectives.slope(objective, v) * kappa
            linear_weight[c] = weight[min(c, len(weight) - 1)] * slope
    elif np.any(kappa != 1.0):
        target = np.multiply(value, kappa, out=room(value.shape))
        linear_weight = np.multiply(weight, kappa, out=room(weight.shape))
    angles, angle_rows = _polar_angles(rows.geometry, size, model)
    scale = _sum_of_squares(weight, target)
    energy = 0.0 if options.energy == "hard" else float(options.energy)
    target, linear_target, weight, linear_weight = _on_device(
        target, value, weight, linear_weight
    )
    return Problem(
        model=model,
        unknowns=make_unknowns(model, n_channels, options),
        objective=objective,
        robust=math.isfinite(robust_width),
        chunk=rows_at_once(size),
        penalised=penalised,
        geometry=jax.tree.map(jax.device_put, rows.padded),
        angles=angles,
        angle_rows=angle_rows,
        kappa=jax.device_put(kappa),
        weight=weight,
        target=target,
        linear_target=linear_target,
        linear_weight=linear_weight,
        robust_width=_float64(robust_width),
        energy_weight=_float64(energy * scale / n_channels),
        reciprocity_weight=_float64(options.reciprocity * scale / n_channels),
        scale=_float64(scale),
        pairs=jax.tree.map(_float64, reciprocity_pairs(model.ways)),
    )


def _by_channel(rows: Rows, size: int) -> np.ndarray:
    """The values ``(c, size)``, 0 where they are not valid, turned over block by block."""
    n, n_channels = rows.value.shape
    out = room((n_channels, size))
    for begin in range(0, n, CHUNK):
        part = slice(begin, min(begin + CHUNK, n))
        out[:, part] = np.where(rows.valid[part], rows.value[part], 0.0).T
    return out


def _sum_of_squares(weight: np.ndarray, target: np.ndarray) -> float:
    last = len(weight) - 1
    return sum(float(np.sum((weight[min(c, last)] * t) ** 2)) for c, t in enumerate(target))


def _on_device(*arrays: np.ndarray) -> list[jax.Array]:
    """The arrays for JAX; what is one array remains one."""
    made = {id(a): jax.device_put(a) for a in arrays}
    return [made[id(a)] for a in arrays]


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
    rows = [jax.device_put(np.pad(i, (0, size - n))) for i in np.split(index, 2)]
    return (_float64(np.sin(own) ** 2), _float64(cosine)), (rows[0], rows[1])


def _float64(a: ArrayLike) -> jax.Array:
    return jax.device_put(np.asarray(a, dtype=np.float64))


def for_channel(problem: Problem, c: int) -> Problem:
    """The problem of one channel alone."""

    def row(a):
        return a[min(c, a.shape[0] - 1)][None]

    fixed = problem.unknowns.shape_constant
    unknowns = dataclasses.replace(
        problem.unknowns,
        coefficient_constant=problem.unknowns.coefficient_constant[:, c : c + 1],
        shape_constant=fixed[:, c : c + 1] if problem.unknowns.spectral else fixed,
        low=problem.unknowns.low[c : c + 1],
        high=problem.unknowns.high[c : c + 1],
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
