"""Reflectances and transmittances: Nicodemus' nine, named geometries, colour."""

from fitting.reflectance.beams import (
    Annular,
    Beam,
    Conical,
    Directional,
    Hemispherical,
    projected_solid_angle,
)
from fitting.reflectance.named import Geometry, named
from fitting.reflectance.quantity import Reflectance, Rule, quantity, rule_and_quantity
from fitting.reflectance.surface import Surface, surface_of, surface_of_result

__all__ = [
    "Annular",
    "Beam",
    "Conical",
    "Directional",
    "Geometry",
    "Hemispherical",
    "Reflectance",
    "Rule",
    "Surface",
    "named",
    "projected_solid_angle",
    "quantity",
    "rule_and_quantity",
    "surface_of",
    "surface_of_result",
]
