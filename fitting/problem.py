"""From a measurement, a model and options to the arrays that the solver works on."""

from __future__ import annotations

import dataclasses
import fnmatch
import itertools
import math
import re
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from data_formats import Measurement, MeasurementError
from fitting import geometry, objectives
from fitting.expression import ModelError
from fitting.model import Model
from fitting.objectives import OBJECTIVES
from fitting.options import FitOptions, Value
from fitting.parameters import Parameter
from fitting.reduced import Problem, Unknowns
from fitting.solid_angle import solid_angle_weights

_BUCKETS = (128, 256, 512, 1024, 1536, 2048, 3072, 4096)
_CHUNK = 4096
_TIE = re.compile(r"\s*(?:(?P<factor>[-+0-9.eE]+)\s*\*\s*)?(?P<name>[\w.]+)\s*")
_RECIPROCITY_PAIRS = 256


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


def select_rows(measurement: Measurement, max_theta_deg: float) -> Rows:
    """Rows that a reflection model can be compared with.

    Raises `MeasurementError` if none is left.
    """
    m = measurement
    limit = math.radians(max_theta_deg) + 1e-6
    below = m.theta_r > 0.5 * math.pi + 1e-6
    grazing = ~below & ((m.theta_i > limit) | (m.theta_r > limit))
    empty = ~below & ~grazing & ~m.valid.any(axis=1)
    keep = ~below & ~grazing & ~empty
    reasons = (
        (below, "transmitted rows (theta_r > 90 deg), which a BRDF does not describe"),
        (grazing, f"rows beyond the grazing cut-off of {max_theta_deg:g} deg"),
        (empty, "rows without a valid value"),
    )
    left_out = tuple(f"{int(r.sum())} {text}" for r, text in reasons if r.any())
    if not keep.any():
        raise MeasurementError(
            f"{m.provenance.path or 'measurement'}: no row is left to fit "
            f"({'; '.join(left_out) or 'it is empty'}); see `brdf info`"
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
    )


def resolve_objective(name: str, has_sigma: bool) -> str:
    """The objective that ``auto`` stands for."""
    if name == "auto":
        return "chi2" if has_sigma else "log1p"
    if name not in OBJECTIVES:
        raise ModelError(f"no objective {name!r}; choose of {', '.join(OBJECTIVES)}, auto")
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
    kappa = np.asarray(rows.geometry.cos_o) if spec.cosine else np.ones(value.shape[1])
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

    Without either, a = 0.02 and b = 0.02 times the median of the values.
    """
    if rows.sigma is not None and options.noise is None:
        return rows.sigma
    magnitude = np.abs(np.where(rows.valid, rows.value, 0.0))
    relative, absolute = options.noise or (0.02, 0.02 * np.median(magnitude[rows.valid]))
    return np.sqrt((relative * magnitude) ** 2 + absolute**2) + 1e-300


def make_unknowns(model: Model, n_channels: int, options: FitOptions) -> Unknowns:
    """Which parameters are free, under which bounds, and what the others are.

    Raises `ModelError` that names the parameter for a senseless fix, bound or tie.
    """
    declared = model.parameters()
    fixed = {
        n: v for pattern, v in options.fix.items() for n in _matching(pattern, declared)
    }
    bounds = {
        n: b for pattern, b in options.bounds.items() for n in _matching(pattern, declared)
    }
    ties = {
        n: _parse_tie(n, text, declared)
        for pattern, text in options.tie.items()
        for n in _matching(pattern, declared)
    }
    for name, value in fixed.items():
        _check_fixed(name, value, declared[name], n_channels)
    free = [n for n in declared if n not in fixed and n not in ties]
    shape_free = [n for n in free if not declared[n].coefficient]
    linear_free = [n for n in free if declared[n].coefficient]

    def source(name: str, among: list[str]) -> tuple[int, float]:
        if name in fixed:
            return -1, 0.0
        master, factor = ties.get(name, (name, 1.0))
        if master in fixed:
            raise ModelError(f"{name} is tied to {master}, which is fixed; fix both")
        return among.index(master), factor

    shape_names = [n for n, p in declared.items() if not p.coefficient]
    linear_names = [n for n, p in declared.items() if p.coefficient]
    for name, (master, _) in ties.items():
        if declared[name].coefficient != declared[master].coefficient or master in ties:
            raise ModelError(
                f"{name} cannot be tied to {master}: both must be shape parameters, or "
                "both coefficients, and a tied parameter cannot be tied to"
            )
    supports = [_support(n, declared[n], bounds.get(n)) for n in shape_free]
    linear_source = tuple(source(n, linear_free) for n in linear_names)
    constant = np.zeros((len(linear_names), n_channels))
    for i, name in enumerate(linear_names):
        if name in fixed:
            constant[i] = fixed[name]
    rows, limits = _constraints(
        model, linear_free, linear_names, linear_source, constant, bounds, options
    )
    return Unknowns(
        shape_names=tuple(shape_names),
        shape_source=tuple(source(n, shape_free) for n in shape_names),
        scales=tuple(declared[n].scale for n in shape_free),
        coefficient_names=tuple(linear_names),
        coefficient_source=linear_source,
        n_coefficients=len(linear_free),
        shape_constant=jnp.asarray(
            [float(np.ravel(fixed.get(n, 0.0))[0]) for n in shape_names]
        ),
        lower=jnp.asarray([low for low, _ in supports]),
        upper=jnp.asarray([high for _, high in supports]),
        coefficient_constant=jnp.asarray(constant),
        rows=jnp.asarray(rows),
        limits=jnp.asarray(limits),
    )


def _matching(pattern: str, declared: dict[str, Parameter]) -> list[str]:
    names = [n for n in declared if n == pattern or fnmatch.fnmatch(n, pattern)]
    if not names:
        raise ModelError(f"no parameter {pattern!r}; the model has {', '.join(declared)}")
    return names


def _parse_tie(name: str, text: str, declared: dict[str, Parameter]) -> tuple[str, float]:
    match = _TIE.fullmatch(text)
    try:
        factor = float(match["factor"] or 1.0) if match else math.nan
    except ValueError:
        factor = math.nan
    if match is None or not math.isfinite(factor):
        raise ModelError(f"tie of {name}: {text!r} is not 'other' or 'factor*other'")
    (master,) = _matching(match["name"], declared)
    if master == name:
        raise ModelError(f"{name} is tied to itself")
    return master, factor


def _check_fixed(name: str, value: Value, parameter: Parameter, n_channels: int) -> None:
    values = np.atleast_1d(np.asarray(value, dtype=np.float64))
    sizes = (1, n_channels) if parameter.coefficient else (1,)
    if values.size not in sizes or not np.all(np.isfinite(values)):
        raise ModelError(
            f"{name} is fixed at {value}: expected one finite number"
            + (f" or {n_channels}, one per channel" if parameter.coefficient else "")
        )
    low, high = parameter.support
    outside = (values < low) | (values > high)
    if not parameter.coefficient and parameter.scale != "periodic" and outside.any():
        raise ModelError(f"{name} is fixed at {value}, outside [{low:g}, {high:g}]")


def _support(
    name: str, parameter: Parameter, bound: tuple[float, float] | None
) -> tuple[float, float]:
    narrowed = parameter.bounded(*bound) if bound else parameter
    low, high = narrowed.support
    if not low < high:
        raise ModelError(
            f"bounds {bound} of {name} leave nothing of its support "
            f"[{parameter.support[0]:g}, {parameter.support[1]:g}]; to hold it, fix it"
        )
    return low, high


def _constraints(
    model: Model,
    free: list[str],
    names: list[str],
    source: tuple[tuple[int, float], ...],
    constant: np.ndarray,
    bounds: dict[str, tuple[float, float]],
    options: FitOptions,
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and limits of ``rows x >= limits``: bounds, and energy where it is hard."""
    declared = model.parameters()
    rows: list[np.ndarray] = []
    limits: list[np.ndarray] = []
    ones = np.ones(constant.shape[1])
    for k, name in enumerate(free):
        low, high = bounds.get(name, declared[name].support)
        if not low < high:
            raise ModelError(f"bounds ({low:g}, {high:g}) of {name}: expected low < high")
        unit = np.zeros(len(free))
        unit[k] = 1.0
        if math.isfinite(low):
            rows.append(unit)
            limits.append(low * ones)
        if math.isfinite(high):
            rows.append(-unit)
            limits.append(-high * ones)
    if options.energy == "hard":
        # With every lobe's albedo at most its largest coefficient, it is enough that the
        # sum over lobes of any one coefficient each stays below 1.
        groups: list[list[int]] = []
        for label, lobe in zip(model.labels, model.lobes, strict=True):
            if lobe.ALBEDO_BOUND is None:
                raise ModelError(
                    f"energy 'hard' needs lobes of bounded albedo; {label} has no bound"
                )
            own = [i for i, n in enumerate(names) if n.rpartition(".")[0] == label]
            groups.append(own)
        for choice in itertools.product(*groups):
            row, limit = np.zeros(len(free)), -ones
            for i in choice:
                index, factor = source[i]
                if index >= 0:
                    row[index] -= factor
                else:
                    limit = limit + constant[i]
            if row.any():
                rows.append(row)
                limits.append(limit)
    if not rows:
        return np.zeros((0, len(free))), np.zeros((constant.shape[1], 0))
    return np.stack(rows), np.stack(limits, axis=1)


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
        kappa=pad(terms.kappa, 1.0),
        weight=pad(weight),
        target=pad(terms.target),
        linear_target=pad(terms.value),
        linear_weight=pad(linear_weight),
        robust_width=_float64(robust_width),
        energy_weight=_float64(energy * scale / n_channels),
        reciprocity_weight=_float64(options.reciprocity * scale / n_channels),
        scale=_float64(scale),
        pairs=jax.tree.map(_float64, reciprocity_pairs()),
    )


def _float64(a: ArrayLike) -> jax.Array:
    return jnp.asarray(a, dtype=jnp.float64)


def for_channel(problem: Problem, c: int) -> Problem:
    """The problem of one channel alone."""

    def row(a):
        return a[min(c, a.shape[0] - 1)][None]

    unknowns = dataclasses.replace(
        problem.unknowns,
        coefficient_constant=problem.unknowns.coefficient_constant[:, c : c + 1],
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


def reciprocity_pairs() -> geometry.Geometry:
    """Quasi-random pairs of directions, even in projected solid angle of both."""
    n = np.arange(_RECIPROCITY_PAIRS) + 0.5
    # Generalised golden ratio in four dimensions: the root of x^5 = x + 1.
    base = 1.1673039782614187
    a, b, c, d = (np.mod(n * base ** -(k + 1), 1.0) for k in range(4))
    return geometry.from_angles(
        np.arcsin(np.sqrt(a)), 2 * np.pi * b, np.arcsin(np.sqrt(c)), 2 * np.pi * d
    )
