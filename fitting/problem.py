"""From a measurement, a model and options to the arrays that the solver works on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from data_formats import Measurement, MeasurementError
from fitting import geometry, objectives
from fitting.model import Model
from fitting.models import Way
from fitting.objectives import OBJECTIVES
from fitting.options import FitOptions
from fitting.reduced import Problem
from fitting.solid_angle import solid_angle_weights
from fitting.unknowns import make_unknowns

_BUCKETS = (128, 256, 512, 1024, 1536, 2048, 3072, 4096)
_CHUNK = 4096
_LARGEST = 1e100
_RECIPROCITY_PAIRS = 256
_SAME_ANGLE = 1e-10
_MOST_ANGLES = 512


_NO_LOBE: dict[Way, str] = {
    "front": "rows of light reflected at the front, for which the model has no lobe",
    "back": "rows of light reflected at the back (theta_i > 90 deg), for which the model "
    "has no lobe (the option 'back' makes one)",
    "down": "transmitted rows (theta_r > 90 deg), for which the model has no lobe (such as "
    "lambert_transmission)",
    "up": "transmitted rows lit from the back (theta_i > 90 deg), for which the model has "
    "no lobe (such as lambert_transmission)",
}


def ways_of(measurement: Measurement) -> np.ndarray:
    """``(n,)`` the way of light of every row, as lobes name them."""
    through, back = measurement.transmitted, measurement.from_back
    # Of grazing light the detector tells the side.
    back = back | (~through & (measurement.theta_r > 0.5 * math.pi + 1e-9))
    reflected = np.where(back, "back", "front")
    return np.where(through, np.where(back, "up", "down"), reflected)


def _from_normal(theta: np.ndarray) -> np.ndarray:
    """Angle to the normal of the side that a direction is on, rad."""
    return np.minimum(theta, math.pi - theta)


@dataclass(frozen=True)
class Rows:
    """The rows that a fit uses, as plain arrays, and why others were left out."""

    index: np.ndarray
    geometry: geometry.Geometry
    value: np.ndarray
    valid: np.ndarray
    sigma: np.ndarray | None
    solid_angle: np.ndarray
    left_out: tuple[str, ...]
    way: np.ndarray
    fitted: np.ndarray | None = None


def select_rows(
    measurement: Measurement, max_theta_deg: float, ways: Sequence[Way] = ("front",)
) -> Rows:
    """Rows that a model can be compared with which knows these ways of light.

    Raises `MeasurementError` if none is left.
    """
    m = measurement
    limit = math.radians(max_theta_deg) + 1e-6
    steepest = np.maximum(_from_normal(m.theta_i), _from_normal(m.theta_r))
    way = ways_of(m)
    unknown = ~np.isin(way, ways)
    grazing = ~unknown & (steepest > limit)
    empty = ~unknown & ~grazing & ~m.valid.any(axis=1)
    keep = ~unknown & ~grazing & ~empty
    reasons = [(unknown & (way == w), text) for w, text in _NO_LOBE.items()]
    reasons += [
        (grazing, f"rows beyond the grazing cut-off of {max_theta_deg:g} deg"),
        (empty, "rows without a valid value"),
    ]
    left_out = tuple(f"{int(r.sum())} {text}" for r, text in reasons if r.any())
    if not keep.any():
        raise MeasurementError(
            f"{m.provenance.path or 'measurement'}: no row is left to fit "
            f"({'; '.join(left_out) or 'it is empty'}); see `brdf info`"
        )
    top = float(np.abs(np.where(m.valid[keep], m.value[keep], 0.0)).max())
    if top > _LARGEST:
        raise MeasurementError(
            f"{m.provenance.path or 'measurement'}: the largest value is {top:.3g} 1/sr; "
            f"expected a BRDF below {_LARGEST:g}; check the units"
        )
    angles = (m.theta_i[keep], m.phi_i[keep], m.theta_r[keep], m.phi_r[keep])
    return Rows(
        index=np.flatnonzero(keep),
        geometry=geometry.from_angles(*angles),
        value=m.value[keep],
        valid=m.valid[keep],
        sigma=None if m.sigma is None else m.sigma[keep],
        solid_angle=solid_angle_weights(*angles),
        left_out=left_out,
        way=way[keep],
    )


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
    if spec.solid_angle and options.weights == "solid-angle":
        per_row = np.sqrt(rows.solid_angle)
    weight = per_row[None] * valid
    if spec.uses_sigma:
        weight = weight / np.where(valid, standard_uncertainty(rows, options).T, 1.0)
    if np.all(weight == weight[:1]):
        weight = weight[:1]
    target = objectives.transform(objective, value * kappa)
    return Terms(kappa, weight, target, value)


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


def with_noise_of(rows: Rows, fitted: np.ndarray) -> Rows:
    """The same rows, whose assumed noise follows a fit instead of the noisy values."""
    return dataclasses.replace(rows, fitted=fitted)


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
    slope = objectives.slope(objective, terms.value * terms.kappa) * terms.kappa
    linear_weight = weight * slope
    if OBJECTIVES[objective].linear:
        linear_weight = weight * terms.kappa

    def pad(a: np.ndarray, fill: float = 0.0) -> jax.Array:
        width = [(0, 0)] * (a.ndim - 1) + [(0, size - n)]
        return _float64(np.pad(a, width, constant_values=fill))

    # Padded rows look along the normal, where every lobe is finite.
    normal = geometry.from_angles(0.0, 0.0, 0.0, 0.0)
    padded = jax.tree.map(
        lambda a, z: pad(np.asarray(a), float(np.asarray(z))), rows.geometry, normal
    )
    angles, angle_rows = _polar_angles(rows.geometry, size, model)
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
        weight=pad(weight),
        target=pad(terms.target),
        linear_target=pad(terms.value),
        linear_weight=pad(linear_weight),
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
    wanted = any(lobe.PER_ANGLE for lobe in model.lobes)
    if not wanted or first.size > min(_MOST_ANGLES, n // 2):
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
