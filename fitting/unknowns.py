"""Which parameters of a fit are free, and what the others are."""

from __future__ import annotations

import fnmatch
import itertools
import math
import re

import jax
import numpy as np

from fitting.albedo import LEAVING, lit_sides
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
        if name in ties:
            raise ModelError(f"{name} is both fixed and tied; leave one of them out")
    for name in options.bounds:
        if name in fixed or name in ties:
            how = "fixed" if name in fixed else "tied"
            raise ModelError(f"{name} is {how} and cannot have bounds as well")
    for name, parameter in declared.items():
        if parameter.given and name not in fixed:
            raise ModelError(
                f"{name} ({parameter.meaning}) is not known; fix it at one value, or at "
                f"{n_channels}, one per channel"
            )
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
    supports = [_support(n, declared, bounds.get(n), ties) for n in shape_free]
    linear_source = tuple(source(n, linear_free) for n in linear_names)
    constant = np.zeros((len(linear_names), n_channels))
    for i, name in enumerate(linear_names):
        if name in fixed:
            constant[i] = fixed[name]
    ends = [_ends(n, bounds.get(n), declared[n]) for n in linear_free]
    rows, limits = _constraints(
        model, linear_free, linear_names, linear_source, constant, ends, options
    )
    low, high = np.array(ends, dtype=np.float64).reshape(-1, 2).T
    put = jax.device_put
    return Unknowns(
        shape_names=tuple(shape_names),
        shape_source=tuple(source(n, shape_free) for n in shape_names),
        scales=tuple(declared[n].scale for n in shape_free),
        coefficient_names=tuple(linear_names),
        coefficient_source=linear_source,
        n_coefficients=len(linear_free),
        shape_constant=put(_columns([fixed.get(n, 0.0) for n in shape_names])),
        lower=put(np.array([low for low, _ in supports], dtype=np.float64)),
        upper=put(np.array([high for _, high in supports], dtype=np.float64)),
        coefficient_constant=put(constant),
        low=put(np.tile(low, (n_channels, 1))),
        high=put(np.tile(high, (n_channels, 1))),
        only_bounds=options.energy != "hard",
        rows=put(rows),
        limits=put(limits),
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
    if match is None or not math.isfinite(factor) or factor <= 0:
        raise ModelError(
            f"tie of {name}: {text!r} is not 'other' or 'factor*other', factor above 0"
        )
    (master,) = _matching(match["name"], declared)
    if master == name:
        raise ModelError(f"{name} is tied to itself")
    return master, factor


def _check_fixed(name: str, value: Value, parameter: Parameter, n_channels: int) -> None:
    try:
        values = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        values = np.array([math.nan])
    if values.size not in (1, n_channels) or not np.all(np.isfinite(values)):
        raise ModelError(
            f"{name} is fixed at {value}: expected one finite number or {n_channels}, one "
            "per channel"
        )
    low, high = parameter.support
    outside = (values < low) | (values > high)
    if parameter.scale != "periodic" and outside.any():
        raise ModelError(f"{name} is fixed at {value}, outside [{low:g}, {high:g}]")


def _columns(values: list[Value]) -> np.ndarray:
    """One row per value; one column, or one per channel if a value has as many."""
    if not values:
        return np.zeros((0, 1))
    rows = [np.atleast_1d(np.asarray(v, dtype=np.float64)) for v in values]
    width = max(r.size for r in rows)
    return np.stack([np.broadcast_to(r, width) for r in rows])


def _support(
    name: str,
    declared: dict[str, Parameter],
    bound: tuple[float, float] | None,
    ties: dict[str, tuple[str, float]],
) -> tuple[float, float]:
    """Support within the bounds, where also all that is tied to it stays in its own."""
    parameter = declared[name]
    low, high = (parameter.bounded(*bound) if bound else parameter).support
    for other, (master, factor) in ties.items():
        if master == name and parameter.scale != "periodic":
            ends = declared[other].support
            low, high = max(low, ends[0] / factor), min(high, ends[1] / factor)
    if not low < high:
        raise ModelError(
            f"bounds {bound} and ties of {name} leave nothing of its support "
            f"[{parameter.support[0]:g}, {parameter.support[1]:g}]; to hold it, fix it"
        )
    return low, high


def _ends(
    name: str, bound: tuple[float, float] | None, parameter: Parameter
) -> tuple[float, float]:
    """Bounds of a coefficient; an infinite end stands for that of the support."""
    low, high = bound or parameter.support
    low = low if math.isfinite(low) else parameter.support[0]
    high = high if math.isfinite(high) else parameter.support[1]
    if not low < high:
        raise ModelError(f"bounds ({low:g}, {high:g}) of {name}: expected low < high")
    return low, high


def _constraints(
    model: Model,
    free: list[str],
    names: list[str],
    source: tuple[tuple[int, float], ...],
    constant: np.ndarray,
    ends: list[tuple[float, float]],
    options: FitOptions,
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and limits of ``rows x >= limits``: bounds, and energy where it is hard."""
    rows: list[np.ndarray] = []
    limits: list[np.ndarray] = []
    ones = np.ones(constant.shape[1])
    for k, (low, high) in enumerate(ends):
        unit = np.zeros(len(free))
        unit[k] = 1.0
        if math.isfinite(low):
            rows.append(unit)
            limits.append(low * ones)
        if math.isfinite(high):
            rows.append(-unit)
            limits.append(-high * ones)
    if options.energy == "hard":
        sources = dict(zip(names, zip(source, constant, strict=True), strict=True))
        for choice in _albedo_bounds(model, names):
            row, limit, least = np.zeros(len(free)), -ones, 0.0 * ones
            for name, bound in choice:
                (index, factor), value = sources[name]
                if index >= 0:
                    row[index] -= bound * factor
                    least = least + bound * factor * max(ends[index][0], 0.0)
                else:
                    limit = limit + bound * value
                    least = least + bound * value
            if np.any(least > 1.0 + 1e-12):
                total = " + ".join(name for name, _ in choice)
                raise ModelError(
                    f"energy 'hard' cannot hold: {total} is "
                    f"at least {least.max():g} by what is fixed or bounded; it must be "
                    "able to stay below 1"
                )
            if row.any():
                rows.append(row)
                limits.append(limit)
    if not rows:
        return np.zeros((0, len(free))), np.zeros((constant.shape[1], 0))
    return np.stack(rows), np.stack(limits, axis=1)


def _albedo_bounds(model: Model, names: list[str]) -> list[tuple[tuple[str, float], ...]]:
    """Coefficients with factors whose sum bounds the albedo for light from one side.

    With every lobe's albedo at most its bound times its largest coefficient, it is enough
    that the sum over lobes of any one of these each stays below 1.
    """
    declared = model.parameters()
    out: dict[tuple[tuple[str, float], ...], None] = {}
    for side in lit_sides(model):
        groups: list[list[tuple[str, float]]] = []
        for label, lobe in zip(model.labels, model.lobes, strict=True):
            if not set(lobe.ways) & set(LEAVING[side]):
                continue
            bound = lobe.albedo_bound
            if bound is None:
                raise ModelError(
                    f"energy 'hard' needs lobes of bounded albedo; {label} has no bound"
                )
            own = [n for n in names if n.rpartition(".")[0] == label]
            groups.append([(n, bound) for n in own if declared[n].amplitude])
        out |= dict.fromkeys(itertools.product(*groups))
    return list(out)
