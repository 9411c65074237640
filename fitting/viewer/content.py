"""What the page is told of a fit: its shader, parameters, channels and measured points."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np

from data_formats import Channel, Measurement
from fitting.model import Model
from fitting.parameters import Parameter
from fitting.result import FitResult, ParameterResult
from fitting.viewer.colours import display
from fitting.viewer.glsl import shader
from fitting.viewer.measured import packed

_FEW = 3


def content(
    result: FitResult, measurement: Measurement | None, name: str
) -> dict[str, Any]:
    """Plain data for JSON; angles in degrees where their name says so.

    Raises `TranslationError` for a model that graphics hardware cannot evaluate.
    """
    model = Model(result.model)
    shown = display([Channel(c.name, c.wavelength_nm) for c in result.channels])
    declared = model.parameters()
    values = {n: np.atleast_1d(v) for n, v in result.values.items()}
    index = model.relative_index({n: v[0] for n, v in values.items()})
    return {
        "name": name,
        "model": result.model,
        "fitted_to": Path(result.data.path.split(" + ")[0]).name,
        "shader": dataclasses.asdict(shader(model)),
        "channels": [c.name for c in result.channels],
        "rgb": shown.rgb.tolist(),
        "luminance": shown.luminance.tolist(),
        "coloured": shown.coloured,
        "chosen": _chosen(result, measurement),
        "parameters": [_parameter(p, declared[p.name]) for p in result.parameters],
        "anisotropic": model.anisotropic,
        "ways": list(model.ways),
        "index": float(np.asarray(index)),
        "data": None if measurement is None else packed(measurement, model.ways),
    }


def _parameter(p: ParameterResult, declared: Parameter) -> dict[str, Any]:
    low, high = declared.support
    return {
        "name": p.name,
        "meaning": p.meaning,
        "unit": "" if p.unit == "1" else p.unit,
        "coefficient": declared.coefficient,
        "scale": declared.scale,
        "range": _range(p, declared),
        "support": [_finite(low), _finite(high)],
        "value": p.value,
        "sigma": p.standard_uncertainty,
        "at_bound": p.at_bound,
        "fixed": p.fixed,
        "given": declared.given,
        "tied_to": p.tied_to,
    }


def _range(p: ParameterResult, declared: Parameter) -> list[float]:
    """What a slider spans: the support, or as far beyond the values as one may want."""
    low, high = declared.support
    largest = max(map(abs, p.value))
    if not math.isfinite(high):
        high = max(1.0, 3.0 * largest)
    if not math.isfinite(low):
        low = -high
    return [min(low, *p.value), max(high, *p.value)]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _chosen(result: FitResult, measurement: Measurement | None) -> list[int]:
    """The channels of curves where all would be too many: three over the spectrum."""
    some = np.arange(len(result.channels))
    if measurement is not None and measurement.valid.any():
        some = np.flatnonzero(measurement.valid.any(axis=0))
    if some.size <= _FEW:
        return some.tolist()
    at = ((np.arange(_FEW) + 0.5) / _FEW * some.size).astype(int)
    return some[at].tolist()
