"""What the lobes are held against: the formulas of their papers, in 50 digits.

Written from the papers with angles, tangents and no care for rounding, and never from the
stable forms of `fitting.models`: two ways to one number. Each function takes the shape
parameters ``s`` by name, the angles ``t`` of a pair of directions (`Angles`) and the
options ``o`` of the lobe by field, and returns the basis functions as a tuple.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable

from fitting.models import Lobe

FORMULAS: dict[str, str] = {
    "lambert": "diffuse",
    "oren_nayar": "diffuse",
    "eon": "diffuse",
    "ggx": "facets",
    "beckmann": "facets",
    "student_t": "facets",
    "gtr": "facets",
    "ward": "facets",
    "blinn_phong": "facets",
    "sgd": "gamma",
    "phong": "empirical",
    "lafortune": "empirical",
    "ashikhmin_shirley": "empirical",
    "ashikhmin_shirley_diffuse": "empirical",
    "minnaert": "empirical",
    "burley": "empirical",
    "interfaced_lambert": "empirical",
    "lambert_transmission": "transmission",
    "rough_dielectric": "transmission",
    "thin_slab": "transmission",
    "smooth_slab": "transmission",
    "disney": "principled",
    "openpbr": "principled",
    "gltf": "principled",
    "abg": "scatter",
    "harvey_shack": "scatter",
    "abc": "scatter",
    "abc_smooth": "scatter",
    "rtls": "field",
    "rpv": "field",
    "hapke": "field",
}


def formula(lobe: Lobe) -> Callable | None:
    """``f(s, t, o)`` of a lobe, or None where there is none.

    A lobe from outside brings its own as a function ``oracle`` in its file. There is none
    of multiple scattering, whose albedo, a double integral, is held against 1 instead.
    """
    if getattr(lobe, "multiple_scattering", False):
        return None
    if lobe.NAME in FORMULAS:
        module = importlib.import_module(f"fitting.oracle.{FORMULAS[lobe.NAME]}")
        return getattr(module, lobe.NAME)
    return getattr(inspect.getmodule(type(lobe)), "oracle", None)
