"""Fresnel terms, split into what is linear in the coefficients and what is not."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.models.lobe import Shape
from fitting.parameters import Parameter, coefficient, shape

Fresnel = Literal["schlick", "dielectric", "conductor", "f82", "generalised"]

# Where the reflectance of a metal dips, acos(1/7) = 81.8 degrees, and what Kutz et al. 2021
# subtract there, c (1 - c)^6, at its largest.
_DIP = 1.0 / 7.0
_DIP_SIZE = _DIP * (1.0 - _DIP) ** 6
_DIP_Q = (1.0 - _DIP) ** 5


def parameters(kind: Fresnel) -> tuple[Parameter, ...]:
    """Shape parameters and coefficients of a Fresnel term."""
    ends = (
        coefficient("f0", 0.04, "reflectance of a facet at normal incidence"),
        coefficient("f90", 1.0, "reflectance of a facet at grazing incidence"),
    )
    scale = coefficient("scale", 1.0, "factor of the Fresnel reflectance")
    if kind == "schlick":
        return ends
    if kind == "f82":
        return (
            *ends,
            coefficient(
                "tint", 1.0, "share of Schlick's reflectance that is left at 81.8 degrees",
                support=(0.0, 1.0), amplitude=False,
            ),
        )  # fmt: skip
    if kind == "generalised":
        return (
            shape("power", 5.0, (1.0, 10.0), "exponent of 1 - cos_d", start=(2.0, 8.0)),
            *ends,
        )
    if kind == "conductor":
        return (
            shape("eta", 1.0, (1e-3, 10.0), "index of refraction", start=(0.1, 3.0)),
            shape(
                "k", 4.0, (0.0, 100.0), "extinction coefficient", scale="linear",
                start=(1.0, 8.0),
            ),
            scale,
        )  # fmt: skip
    return (
        shape(
            "eta", 1.5, (1.01, 4.0), "index of refraction relative to the outside",
            scale="linear", start=(1.3, 2.0),
        ),
        scale,
    )  # fmt: skip


def split(kind: Fresnel, shape: Shape, value: Array, cos_d: Array) -> tuple[Array, ...]:
    """Basis functions of a facet lobe ``value`` (1/sr, without Fresnel).

    - Schlick 1994, eq. 15, with a free grazing value: ``F = f0 (1 - q) + f90 q``,
      ``q = (1 - cos_d)^5``, linear in both; ``generalised`` has a free exponent.
    - ``f82`` (Kutz, Hasan and Edmondson 2021): Schlick less ``(1 - tint) F(1/7)
      c (1 - c)^6 / (1/7 (6/7)^6)``, the dip of metals before grazing. It is meant for
      metals: with ``f0`` far below ``f90`` and a small tint the dip is deeper than what is
      there, and ``F`` is below zero around it.
    - ``dielectric``, ``conductor``: exact, times a scale.
    """
    if kind == "dielectric":
        return (value * dielectric(cos_d, shape["eta"]),)
    if kind == "conductor":
        return (value * conductor(cos_d, shape["eta"], shape["k"]),)
    # At retro-reflection a rounded cos_d may exceed 1, and q would be negative.
    p = jnp.maximum(1.0 - cos_d, 0.0)
    if kind == "generalised":
        some = p > 0
        # log1p keeps the digits of a small cos_d; XLA's loses some of them further out.
        small = cos_d < 0.25
        logarithm = jnp.where(
            small,
            jnp.log1p(-jnp.where(small, cos_d, 0.0)),
            jnp.log(jnp.where(some, p, 1.0)),
        )
        logarithm = shape["power"] * logarithm
        rest = jnp.where(some, -jnp.expm1(logarithm), 1.0)
        return value * rest, value * jnp.where(some, jnp.exp(logarithm), 0.0)
    # 1 - q written as a product keeps its digits at grazing, where q goes to 1.
    rest = cos_d * (1.0 + p * (1.0 + p * (1.0 + p * (1.0 + p))))
    if kind == "schlick":
        return value * rest, value * p**5
    return value * rest, value * p**5, value * (cos_d * p**6 / _DIP_SIZE)


def linear(kind: Fresnel) -> bool:
    """Whether `amplitudes` are the coefficients themselves."""
    return kind != "f82"


def amplitudes(kind: Fresnel, coefficients: tuple[Array, ...]) -> tuple[Array, ...]:
    """Factors of the basis functions of `split`."""
    if kind != "f82":
        return coefficients
    f0, f90, tint = coefficients
    return f0, f90, -(1.0 - tint) * (f0 * (1.0 - _DIP_Q) + f90 * _DIP_Q)


def average(kind: Fresnel, shape: Shape, coefficients: tuple[Array, ...]) -> Array:
    """``2 int_0^1 F(c) c dc``, the reflectance of a facet lit from everywhere.

    In closed form where there is one, else by 32 nodes (error below 1e-6 for an index of
    1.2 and above, 1e-4 at 1.01).
    """
    if kind in ("dielectric", "conductor"):
        nodes, weights = np.polynomial.legendre.leggauss(32)
        eta = shape["eta"]
        c = jnp.asarray(0.5 * (nodes + 1.0), eta.dtype)
        w = jnp.asarray(weights, eta.dtype) * c
        f = dielectric(c, eta) if kind == "dielectric" else conductor(c, eta, shape["k"])
        return jnp.sum(w * f) * coefficients[0]
    f0, f90, *_ = coefficients
    if kind == "generalised":
        p = shape["power"]
        return f0 + (f90 - f0) * 2.0 / ((p + 1.0) * (p + 2.0))
    mean = f0 + (f90 - f0) / 21.0
    if kind == "f82":
        mean = mean + amplitudes(kind, coefficients)[2] / (126.0 * _DIP_SIZE)
    return mean


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


class Interface(NamedTuple):
    """A smooth interface, both polarisations apart, and the cosine behind it."""

    reflected_s: Array
    reflected_p: Array
    transmitted_s: Array
    transmitted_p: Array
    cos_t: Array

    @property
    def reflected(self) -> Array:
        """For unpolarised light."""
        return 0.5 * (self.reflected_s + self.reflected_p)

    @property
    def transmitted(self) -> Array:
        """For unpolarised light, ``1 - reflected`` without its cancellation."""
        return 0.5 * (self.transmitted_s + self.transmitted_p)


def dielectric_terms(cos_d: Array, eta: Array) -> Interface:
    """Reflectance and transmittance of an interface to a denser medium, ``eta > 1``.

    With ``c = cos_d`` and ``g = eta cos_t = sqrt(eta^2 - 1 + c^2)`` (Born and Wolf, sec.
    1.5.2)::

        R_s = ((g - c) / (g + c))^2            T_s = 4 c g / (g + c)^2
        R_p = ((eta^2 c - g) / (eta^2 c + g))^2    T_p = 4 eta^2 c g / (eta^2 c + g)^2
    """
    step = (eta - 1.0) * (eta + 1.0)
    g = jnp.sqrt(step + cos_d * cos_d)
    eta2 = eta * eta
    total_s, total_p = g + cos_d, eta2 * cos_d + g
    # (eta^2 c - g) = (eta^2 - 1) (c^2 (eta^2 + 1) - 1) / (eta^2 c + g), without the
    # cancellation of an index next to 1.
    across = step * (cos_d * cos_d * (eta2 + 1.0) - 1.0) / total_p
    return Interface(
        reflected_s=(step / total_s / total_s) ** 2,
        reflected_p=(across / total_p) ** 2,
        transmitted_s=4.0 * cos_d * g / total_s**2,
        transmitted_p=4.0 * eta2 * cos_d * g / total_p**2,
        cos_t=g / eta,
    )


def conductor(cos_d: Array, eta: Array, k: Array) -> Array:
    """Unpolarised reflectance of a smooth interface to the index ``eta + i k``.

    In real arithmetic, with ``s2 = 1 - c^2``, ``t = eta^2 - k^2 - s2`` and ``a + i b`` the
    root of ``t + 2 i eta k`` (Born and Wolf, 14.2)::

        R_s = ((a - c)^2 + b^2) / ((a + c)^2 + b^2)
        R_p / R_s = ((a c - s2)^2 + (b c)^2) / ((a c + s2)^2 + (b c)^2)

    Of ``a`` and ``b`` the larger comes from a root and the other from ``eta k``, and
    ``a - c = (eta^2 - 1 + s2 k^2 / (a^2 + k^2)) / (a + c)``, so that nothing cancels: a
    metal that hardly absorbs and an index next to 1 both keep their digits. At the index 1
    exactly and grazing incidence the limit is not one; it is taken as 1.
    """
    s2 = jnp.maximum((1.0 - cos_d) * (1.0 + cos_d), 0.0)
    # Next to grazing an index of 1, and next to normal one of 0, leaves little of t.
    steep = (eta - k) * (eta + k) - s2
    t = jnp.where(cos_d > 0.7, steep, (eta - 1.0) * (eta + 1.0) - k * k + cos_d * cos_d)
    product = eta * k
    # The root of zero has no derivative; this little one is lost beside anything else.
    least = math.sqrt(jnp.finfo(t.dtype).tiny)
    m = jnp.sqrt(t * t + 4.0 * product * product + least)
    larger = jnp.sqrt(0.5 * (m + jnp.abs(t)))
    smaller = product / larger
    a, b = jnp.where(t >= 0, larger, smaller), jnp.where(t >= 0, smaller, larger)
    b2 = b * b
    # k / a = b / eta: of the two quotients the one whose divisor is the root.
    beside, above = jnp.where(t >= 0, k, b), jnp.where(t >= 0, a, eta)
    share = beside * beside / (above * above + beside * beside)
    inside = (eta - 1.0) * (eta + 1.0) + share * s2
    total = jnp.maximum(a + cos_d, math.sqrt(least))
    alike = (t >= 0) & (a < 2.0 * cos_d) & (cos_d < 2.0 * a)
    difference = jnp.where(alike, inside / total, a - cos_d)
    rs = (difference**2 + b2) / (total**2 + b2)
    across, depth = a * cos_d, b2 * cos_d * cos_d
    ratio = ((across - s2) ** 2 + depth) / ((across + s2) ** 2 + depth)
    return jnp.where(cos_d > 0, 0.5 * rs * (1.0 + ratio), 1.0)
