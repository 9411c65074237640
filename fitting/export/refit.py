"""A target's own model fitted to a surface that the target cannot hold as it is."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from fitting.conversion import resample
from fitting.export.parts import Lobes
from fitting.export.surface import Surface
from fitting.export.target import ExportError, Say
from fitting.fitter import fit
from fitting.model import Model

_STARTS = 3


def refit(
    surface: Surface,
    expression: str,
    say: Say,
    *,
    fix: Mapping[str, float] | None = None,
    tie: Mapping[str, str] | None = None,
) -> Lobes:
    """A model of this program fitted to the reflection of a surface from the front.

    To its values, in the target's channels, at the directions of `resample`; in every
    other respect a fit like any other (``log1p``, several starts). Raises `ExportError`
    if the surface reflects nothing from the front.
    """
    if "front" not in surface.model.ways:
        raise ExportError(
            f"{surface.model.expression} reflects nothing from the front, which is all "
            "that this target holds"
        )
    data = resample(surface.result)
    data = data.select(~(data.transmitted | data.from_back))
    value = data.value @ surface.mixing.matrix
    data = dataclasses.replace(
        data, value=value, valid=np.isfinite(value), channels=surface.channels
    )
    own = Model(expression)
    say(f"refitting {surface.model.expression} by {own.expression}")

    def detail(what: str) -> None:
        say(f"{own.expression}: {what}")

    found = fit(
        data, own, cross_validate=False, starts=_STARTS, reciprocity=0.0,
        fix=dict(fix or {}), tie=dict(tie or {}), progress=detail,
    )  # fmt: skip
    return Lobes(own.expression, found.values, own.expression)
