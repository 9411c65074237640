"""The registry of lobes: a name, and the file and class that hold it, loaded on use."""

from __future__ import annotations

import functools
import importlib
from importlib.metadata import EntryPoint, entry_points

from fitting.models.lobe import AxisPeak, Lobe, Passage, Peak, Shape, SlopeWidths, Way

__all__ = [
    "LOBES",
    "AxisPeak",
    "Lobe",
    "Passage",
    "Peak",
    "Shape",
    "SlopeWidths",
    "Way",
    "lobe_class",
    "lobe_names",
]

LOBES: dict[str, str] = {
    # Matt surfaces.
    "lambert": "Lambert",
    "oren_nayar": "OrenNayar",
    "eon": "EON",
    "burley": "Burley",
    "minnaert": "Minnaert",
    "interfaced_lambert": "InterfacedLambert",
    "ashikhmin_shirley_diffuse": "AshikhminShirleyDiffuse",
    # Facets around the half vector.
    "ggx": "GGX",
    "beckmann": "Beckmann",
    "student_t": "StudentT",
    "gtr": "GTR",
    "sgd": "SGD",
    "ward": "Ward",
    "blinn_phong": "BlinnPhong",
    "ashikhmin_shirley": "AshikhminShirley",
    # Lobes around a direction.
    "phong": "Phong",
    "lafortune": "Lafortune",
    # Scatter of polished and glossy surfaces.
    "abg": "ABg",
    "harvey_shack": "HarveyShack",
    "abc": "ABC",
    "abc_smooth": "ABCSmooth",
    # Soils, vegetation, planets.
    "rpv": "RPV",
    "rtls": "RTLS",
    "hapke": "Hapke",
    # Transmission, and what belongs to it.
    "lambert_transmission": "LambertTransmission",
    "rough_dielectric": "RoughDielectric",
    "thin_slab": "ThinSlab",
    "smooth_slab": "SmoothSlab",
    # Materials of renderers, to convert a fit to.
    "disney": "Disney",
    "openpbr": "OpenPBR",
    "gltf": "GLTF",
}


def lobe_names() -> tuple[str, ...]:
    """All lobes that expressions know, those of installed packages included."""
    return (*LOBES, *_installed())


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
    return _installed()[name].load()


@functools.cache
def _installed() -> dict[str, EntryPoint]:
    """Lobes of installed packages; looking for them reads the metadata of all packages."""
    return {e.name: e for e in entry_points(group="fitting.models")}
