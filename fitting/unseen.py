"""Coefficients that no row of the data sees: of ways of light that were not measured."""

from __future__ import annotations

import dataclasses
import fnmatch

import numpy as np

from fitting.model import Model
from fitting.options import FitOptions
from fitting.predict import predict_geometry
from fitting.reduced import Unknowns
from fitting.rows import Rows
from fitting.unknowns import make_unknowns


def without_unseen(
    rows: Rows, model: Model, options: FitOptions
) -> tuple[FitOptions, list[str]]:
    """The options with such coefficients fixed, and sentences on it.

    A lobe that reflects and transmits has a coefficient for both: one that no row sees
    keeps its default, 1 for a clear interface. A lobe that no row sees at all is left out,
    with coefficients of 0. Both as far as the user's bounds allow; what others are tied to
    stays free, since rows may see those.
    """
    declared = model.parameters()
    unknowns = make_unknowns(model, rows.value.shape[1], options)
    free = {*unknowns.free_coefficients, *unknowns.free_shape} - _masters(unknowns)
    fixed: dict[str, float] = {}
    words: list[str] = []
    here = set(np.unique(rows.way))
    for label, lobe in zip(model.labels, model.lobes, strict=True):
        own = [f"{label}.{p.name}" for p in lobe.parameters()]
        own = [n for n in own if n in free]
        if not here & set(lobe.ways):
            for name in own:
                none = 0.0 if declared[name].coefficient else declared[name].default
                fixed[name] = _bounded(name, none, options)
            if own:
                words.append(f"{label} is left out: no row of the data sees its light")
        elif len(lobe.ways) > 1 and lobe.linear:
            for name in own:
                if declared[name].coefficient and not _seen(rows, model, name):
                    fixed[name] = _bounded(name, declared[name].default, options)
                    words.append(
                        f"{name} is held at {fixed[name]:g}: no row of the data sees that "
                        "light"
                    )
    if not fixed:
        return options, []
    bounds = {n: b for n, b in options.bounds.items() if n not in fixed}
    fix = {**options.fix, **fixed}
    return dataclasses.replace(options, fix=fix, bounds=bounds), words


def _masters(unknowns: Unknowns) -> set[str]:
    """Free parameters that others are tied to."""
    out: set[str] = set()
    for names, source, free in (
        (unknowns.shape_names, unknowns.shape_source, unknowns.free_shape),
        (unknowns.coefficient_names, unknowns.coefficient_source,
         unknowns.free_coefficients),
    ):  # fmt: skip
        for name, (index, _) in zip(names, source, strict=True):
            if index >= 0 and free[index] != name:
                out.add(free[index])
    return out


def _bounded(name: str, value: float, options: FitOptions) -> float:
    """The value, or the end of the user's bounds that is next to it."""
    for pattern, (low, high) in options.bounds.items():
        if fnmatch.fnmatch(name, pattern):
            value = min(max(value, low), high)
    return value


def _seen(rows: Rows, model: Model, name: str) -> bool:
    """Whether the model's value at some row changes with a coefficient."""
    declared = model.parameters()
    alone = {
        n: p.default if not p.coefficient else float(n == name) for n, p in declared.items()
    }
    return bool(np.any(predict_geometry(model, alone, rows.geometry) != 0.0))
