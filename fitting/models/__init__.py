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
    "student_t": "StudentT",
    "gtr": "GTR",
    "ward": "Ward",
    "blinn_phong": "BlinnPhong",
    "sgd": "SGD",
    "phong": "Phong",
    "lafortune": "Lafortune",
    "ashikhmin_shirley": "AshikhminShirley",
    "ashikhmin_shirley_diffuse": "AshikhminShirleyDiffuse",
    "minnaert": "Minnaert",
    "burley": "Burley",
    "interfaced_lambert": "InterfacedLambert",
    "disney": "Disney",
    "openpbr": "OpenPBR",
    "abg": "ABg",
    "harvey_shack": "HarveyShack",
    "abc": "ABC",
    "abc_smooth": "ABCSmooth",
    "rtls": "RTLS",
    "rpv": "RPV",
    "hapke": "Hapke",
}


def lobe_class(name: str) -> type[Lobe]:
    """The class of a lobe by its name in expressions, or by the path of its file.

    Installed packages add lobes by entry points of the group ``fitting.models``; a path
    ends in ``.py``. Raises ``KeyError`` for an unknown name and `ModelError` for a file
    that holds no lobe.
    """
    if name in LOBES:
        return getattr(importlib.import_module(f"fitting.models.{name}"), LOBES[name])
    if name.endswith(".py"):
        from fitting.models.lobe_file import lobe_of_file

        return lobe_of_file(name)
    for entry in entry_points(group="fitting.models", name=name):
        return entry.load()
    raise KeyError(name)
