"""The registry of lobes: a name, and the file and class that hold it, loaded on use."""

from __future__ import annotations

import importlib
from importlib.metadata import entry_points

from fitting.models.lobe import AxisPeak, Lobe, Peak, Shape, SlopeWidths

__all__ = ["LOBES", "AxisPeak", "Lobe", "Peak", "Shape", "SlopeWidths", "lobe_class"]

LOBES: dict[str, str] = {
    "lambert": "Lambert",
    "oren_nayar": "OrenNayar",
    "eon": "EON",
    "ggx": "GGX",
    "beckmann": "Beckmann",
    "ward": "Ward",
    "blinn_phong": "BlinnPhong",
}


def lobe_class(name: str) -> type[Lobe]:
    """The class of a lobe by its name in expressions.

    Installed packages add lobes by entry points of the group ``fitting.models``. Raises
    ``KeyError`` for an unknown name.
    """
    if name in LOBES:
        return getattr(importlib.import_module(f"fitting.models.{name}"), LOBES[name])
    for entry in entry_points(group="fitting.models", name=name):
        return entry.load()
    raise KeyError(name)
