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
        q = (1.0 - cos_d) ** 5
        return value * (1.0 - q), value * q
    return (value * dielectric(cos_d, shape["eta"]),)


def dielectric(cos_d: Array, eta: Array) -> Array:
    """Unpolarised reflectance of a smooth dielectric interface, from below or above.

    ``F = (rs^2 + rp^2) / 2`` with ``ct^2 = 1 - (1 - cos_d^2) / eta^2``. Total internal
    reflection gives 1 with zero derivative (the root is taken of 1 there, so that no
    infinite derivative is multiplied by zero).
    """
    ct2 = 1.0 - (1.0 - cos_d) * (1.0 + cos_d) / eta**2
    total = ct2 <= 0.0
    ct = jnp.sqrt(jnp.where(total, 1.0, ct2))
    rs = (cos_d - eta * ct) / (cos_d + eta * ct)
    rp = (eta * cos_d - ct) / (eta * cos_d + ct)
    return jnp.where(total, 1.0, 0.5 * (rs * rs + rp * rp))
