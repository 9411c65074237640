"""Which parameters of a fit are free, and what the others are."""

from __future__ import annotations

import fnmatch
import itertools
import math
import re

import jax.numpy as jnp
import numpy as np

from fitting.expression import ModelError
from fitting.model import Model
from fitting.options import FitOptions, Value
from fitting.parameters import Parameter
from fitting.reduced import Unknowns

_TIE = re.compile(r"\s*(?:(?P<factor>[-+0-9.eE]+)\s*\*\s*)?(?P<name>[\w.]+)\s*")


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
