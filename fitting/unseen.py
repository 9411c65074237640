"""Coefficients that no row of the data sees: of ways of light that were not measured."""

from __future__ import annotations

import dataclasses

import numpy as np

from fitting.model import Model
from fitting.options import FitOptions
from fitting.predict import predict_geometry
from fitting.rows import Rows
from fitting.unknowns import make_unknowns


def without_unseen(
    rows: Rows, model: Model, options: FitOptions
) -> tuple[FitOptions, list[str]]:
    """The options with such coefficients fixed, and sentences on it.

    A lobe that reflects and transmits has a coefficient for both: one that no row sees
    keeps its default, 1 for a clear interface. A lobe that no row sees at all is left out,
    with coefficients of 0.
    """
    declared = model.parameters()
    unknowns = make_unknowns(model, rows.value.shape[1], options)
    free = {*unknowns.free_coefficients, *unknowns.free_shape}
    fixed: dict[str, float] = {}
    words: list[str] = []
    here = set(np.unique(rows.way))
    for label, lobe in zip(model.labels, model.lobes, strict=True):
        own = [f"{label}.{p.name}" for p in lobe.parameters()]
        own = [n for n in own if n in free]
        if not here & set(lobe.ways):
            fixed |= {
                n: 0.0 if declared[n].coefficient else declared[n].default for n in own
            }
            if own:
                words.append(f"{label} is left out: no row of the data sees its light")
        elif len(lobe.ways) > 1 and lobe.linear:
            for name in own:
                if declared[name].coefficient and not _seen(rows, model, name):
                    fixed[name] = declared[name].default
                    words.append(
                        f"{name} is held at {fixed[name]:g}: no row of the data sees that "
                        "light"
                    )
    if not fixed:
        return options, []
    return dataclasses.replace(options, fix={**options.fix, **fixed}), words


def _seen(rows: Rows, model: Model, name: str) -> bool:
    """Whether the model's value at some row changes with a coefficient."""
    declared = model.parameters()
    alone = {
        n: p.default if not p.coefficient else float(n == name) for n, p in declared.items()
    }
    return bool(np.any(predict_geometry(model, alone, rows.geometry) != 0.0))
