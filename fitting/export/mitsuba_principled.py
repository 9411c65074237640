"""Mitsuba's `principled` for a surface, and what it computes."""

from __future__ import annotations

import numpy as np

from fitting.export.closest import Candidate
from fitting.export.mitsuba_file import Colour
from fitting.export.parts import Lobes, Part, Values, parts_of_lobes, sum_of
from fitting.export.refit import refit
from fitting.export.surface import Surface
from fitting.export.target import Say

# Mitsuba's clear coat lacks the factor 1 / (4 cos_i cos_o) of Disney's.
_WITHOUT_COAT = {"disney.clearcoat": 0.0, "disney.clearcoat_gloss": 0.5}


def principled(surface: Surface, parts: list[Part], say: Say) -> Candidate:
    """The lobe ``disney`` of the fit, or one refitted to it, as `principled`.

    Mitsuba has the exact Fresnel term of the index that ``specular`` stands for where
    Disney has Schlick's: the distance from the fit is that of Mitsuba's formula.
    """
    remarks: tuple[str, ...] = ()
    own = [p for p in parts if p.named("disney")]
    if len(parts) == len(own) == 1:
        part = own[0]
        if np.any(part.values["clearcoat"] > 0):
            remarks += (
                "the clear coat was left out: Mitsuba's lacks the factor 1 / (4 cos cos) "
                "of Disney's",
            )
    else:
        aniso = "disney(aniso)" if surface.model.anisotropic else "disney"
        lobes = refit(surface, aniso, say, fix=_WITHOUT_COAT)
        (part,) = parts_of_lobes(lobes)
        remarks += (f"{surface.model.expression} was refitted by {aniso}",)
    if "angle" in part.values:
        remarks += (
            f"the tangent lies at the azimuth {np.degrees(part.values['angle']):.4g} deg "
            "of the fit: turn the texture coordinates by as much",
        )
    return Candidate("principled", _computed(part), _tree(part.values), remarks=remarks)


def _tree(values: Values):
    tree = {
        "type": "principled",
        "base_color": Colour(values["base_color"]),
        "flatness": _scalar(values["subsurface"]),
    }
    names = ("metallic", "specular", "roughness", "sheen", "anisotropic")
    return tree | {n: _scalar(values[n]) for n in names if n in values}


def _computed(part: Part) -> Lobes:
    """Disney's lobe with the one Fresnel term in place of the other, off the metal."""
    values = {**part.values, "clearcoat": np.asarray(0.0)}
    r2 = values["roughness"] ** 2
    kind, widths = "", {"alpha": np.maximum(r2, 1e-3)}
    if "anisotropic" in values:
        aspect = np.sqrt(1.0 - 0.9 * values["anisotropic"])
        kind = "aniso, "
        widths = {
            "alpha_x": np.maximum(r2 / aspect, 1e-3),
            "alpha_y": np.maximum(r2 * aspect, 1e-3),
            "angle": values["angle"],
        }
    body = np.ones_like(values["base_color"]) * (1.0 - values["metallic"])
    f0 = 0.08 * values["specular"]
    exact = {"eta": np.maximum(2.0 / (1.0 - np.sqrt(f0)) - 1.0, 1.0 + 1e-9), "scale": body}
    schlick = {"f0": -body * f0, "f90": -body}
    return sum_of(
        [
            (str(part.term), values),
            (f"ggx({kind}uncorrelated, dielectric)", {**widths, **exact}),
            (f"ggx({kind}uncorrelated)", {**widths, **schlick}),
        ],
        "principled: disney with the exact Fresnel term of its index",
    )


def _scalar(value: np.ndarray) -> float:
    return float(f"{np.ravel(value)[0]:.9g}")
