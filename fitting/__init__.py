"""Fit parametric reflectance models to measurements, with honest error bars.

    from fitting import fit, read
    result = fit(read("paint.astm"), "lambert + ggx")

Names are loaded on first use, so that ``import fitting`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from data_formats import Measurement, MeasurementError, read, write
    from fitting.comparison import Comparison, compare
    from fitting.conversion import resample
    from fitting.expression import ModelError
    from fitting.fitter import fit
    from fitting.geometry import Geometry, from_angles
    from fitting.model import Model
    from fitting.options import FitOptions
    from fitting.result import FitResult, ResultError, json_schema, load_result
    from fitting.scoring import Score, score
    from fitting.texels import TexelFits, fit_many

_HOME = {
    "Measurement": "data_formats",
    "MeasurementError": "data_formats",
    "read": "data_formats",
    "write": "data_formats",
    "Comparison": "fitting.comparison",
    "compare": "fitting.comparison",
    "resample": "fitting.conversion",
    "ModelError": "fitting.expression",
    "fit": "fitting.fitter",
    "Geometry": "fitting.geometry",
    "from_angles": "fitting.geometry",
    "Model": "fitting.model",
    "FitOptions": "fitting.options",
    "FitResult": "fitting.result",
    "ResultError": "fitting.result",
    "json_schema": "fitting.result",
    "load_result": "fitting.result",
    "Score": "fitting.scoring",
    "score": "fitting.scoring",
    "TexelFits": "fitting.texels",
    "fit_many": "fitting.texels",
}

__all__ = [
    "Comparison",
    "FitOptions",
    "FitResult",
    "Geometry",
    "Measurement",
    "MeasurementError",
    "Model",
    "ModelError",
    "ResultError",
    "Score",
    "TexelFits",
    "compare",
    "fit",
    "fit_many",
    "from_angles",
    "json_schema",
    "load_result",
    "read",
    "resample",
    "score",
    "write",
]


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'fitting' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value
