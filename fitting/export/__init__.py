"""Hand a fitted model over to renderers, optical design programs and tables.

    from fitting.export import export, targets
    report = export(load_result("paint.fit.json"), "mitsuba", "paint.xml")

Names are loaded on first use, so that ``import fitting.export`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fitting.export.exporting import export
    from fitting.export.registry import TARGETS, TargetInfo, targets
    from fitting.export.report import Report, Residual
    from fitting.export.target import ExportError, Request

_HOME = {
    "ExportError": "target",
    "Report": "report",
    "Request": "target",
    "Residual": "report",
    "TARGETS": "registry",
    "TargetInfo": "registry",
    "export": "exporting",
    "targets": "registry",
}

__all__ = [
    "TARGETS",
    "ExportError",
    "Report",
    "Request",
    "Residual",
    "TargetInfo",
    "export",
    "targets",
]


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'fitting.export' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"fitting.export.{_HOME[name]}"), name)
    globals()[name] = value
    return value
