"""Fresnel terms, split into what is linear in the coefficients and what is not."""

from __future__ import annotations

from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array

from fitting.models.lobe import Shape
from fitting.parameters import Parameter, coefficient, shape

Fresnel = Literal["schlick", "dielectric"]


def parameters(kind: Fresnel) -> tuple[Parameter, ...]:
    """``f0, f90`` for Schlick; index ``eta`` and a ``scale`` for the exact dielectric."""
    if kind == "schlick":
        return (
            coefficient("f0", 0.04, "reflectance of a facet at normal incidence"),
            coefficient("f90", 1.0, "reflectance of a facet at grazing incidence"),
        )
    return (
        shape(
            "eta", 1.5, (1.01, 4.0), "index of refraction relative to the outside",
            scale="linear", start=(1.3, 2.0),
        ),
        coefficient("scale", 1.0, "factor of the Fresnel reflectance"),
    )  # fmt: skip


def split(kind: Fresnel, shape: Shape, value: Array, cos_d: Array) -> tuple[Array, ...]:
    """Basis functions of a facet lobe ``value`` (1/sr, without Fresnel).

    Schlick 1994, eq. 15, with a free grazing value: ``F = f0 (1 - q) + f90 q``,
    ``q = (1 - cos_d)^5``, linear in both.
    """
    if kind == "schlick":
        # 1 - q written as a product keeps its digits at grazing, where q goes to 1. At
        # retro-reflection a rounded cos_d may exceed 1, and q would be negative.
        p = jnp.maximum(1.0 - cos_d, 0.0)
        rest = cos_d * (1.0 + p * (1.0 + p * (1.0 + p * (1.0 + p))))
        return value * rest, value * p**5
    return (value * dielectric(cos_d, shape["eta"]),)


def dielectric(cos_d: Array, eta: Array) -> Array:
    """Unpolarised reflectance of a smooth dielectric interface, from below or above.

    ``F = (1/2) ((g - c) / (g + c))^2 (1 + ((c (g + c) - 1) / (c (g - c) + 1))^2)``,
    ``g^2 = eta^2 - 1 + c^2`` (Cook and Torrance 1982), with ``g - c`` written as
    ``(eta^2 - 1) / (g + c)`` so that no digit is lost as ``eta`` goes to 1. Total internal
    reflection gives 1 with zero derivative (the root is taken of 1 there, so that no
    infinite derivative is multiplied by zero).
    """
    step = (eta - 1.0) * (eta + 1.0)
    g2 = step + cos_d * cos_d
    total = g2 <= 0.0
    g = jnp.sqrt(jnp.where(total, 1.0, g2))
    both = jnp.where(total, 1.0, g + cos_d)
    less = step / both
    rs = less / both
    rp_rs = (cos_d * both - 1.0) / jnp.where(total, 1.0, cos_d * less + 1.0)
    return jnp.where(total, 1.0, 0.5 * rs * rs * (1.0 + rp_rs * rp_rs))
