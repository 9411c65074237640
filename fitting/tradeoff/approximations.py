"""Cheaper formulas in place of exact ones, as renderers use them; pure functions.

They are here to be measured against the lobes' own formulas, not to be fitted with.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
from jax.scipy.special import erfc
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.eon import C1, C2, EON
from fitting.models.lobe import Shape


def schlick(cos_d: Array, eta: Array) -> Array:
    """``F = F0 + (1 - F0) (1 - cos_d)^5``, ``F0 = ((eta - 1) / (eta + 1))^2``.

    Schlick 1994, eq. 15, in place of the reflectance of a dielectric interface.
    """
    f0 = ((eta - 1.0) / (eta + 1.0)) ** 2
    p = jnp.maximum(1.0 - cos_d, 0.0)
    p2 = p * p
    return f0 + (1.0 - f0) * (p2 * p2 * p)


def beckmann_g1(x: Array) -> Array:
    """``G1 = 1 / (1 + Lambda(x))`` of Beckmann, exact; ``x = cot(theta) / alpha``.

    Walter et al. 2007, eq. 26, ``x Lambda = (exp(-x^2) / sqrt(pi) - x erfc(x)) / 2``.
    """
    x_lambda = 0.5 * (jnp.exp(-x * x) / math.sqrt(math.pi) - x * erfc(x))
    return x / (x + x_lambda)


def beckmann_g1_rational(x: Array) -> Array:
    """``(3.535 x + 2.181 x^2) / (1 + 2.276 x + 2.577 x^2)`` below 1.6, and 1 above.

    The rational approximation of Walter et al. 2007, sec. 5.2, below their eq. 26. It
    jumps at 1.6 in value and slope and exceeds 1 by 6e-5, so that it is nothing to fit
    with.
    """
    ratio = x * (3.535 + 2.181 * x) / (1.0 + x * (2.276 + 2.577 * x))
    return jnp.where(x < 1.6, ratio, 1.0)


def eon_albedo(mu: Array, roughness: Array) -> Array:
    """``E(mu) = (1 + r G(mu) / pi) / (1 + c1 r)`` of EON's single scattering, for mu > 0.

    ``G = S (theta - S mu) + 2/3 ((S / mu) (1 - S^3) - S)``, ``S = sin(theta)``. Portsmouth,
    Kutz and Hill 2025, JCGT 14(1), as published; the lobe has a form that does not cancel.
    """
    s = jnp.sqrt((1.0 - mu) * (1.0 + mu))
    g = s * (jnp.arccos(mu) - s * mu) + (2.0 / 3.0) * (s / mu * (1.0 - s**3) - s)
    return (1.0 + roughness * g / math.pi) / (1.0 + C1 * roughness)


def eon_albedo_polynomial(mu: Array, roughness: Array) -> Array:
    """The same with ``G / pi`` as a polynomial of fourth degree in ``1 - mu``.

    Portsmouth, Kutz and Hill 2025, listing 2 (``E_FON_approx``): no arc tangent, no root.
    """
    return (1.0 + roughness * _g_over_pi(mu)) / (1.0 + C1 * roughness)


def eon_basis_polynomial(shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
    """The basis functions of the lobe ``eon`` with the polynomial in multiple scattering.

    As `fitting.models.eon.EON.basis`, ``k = c1 - G(mu) / pi`` from the polynomial.
    """
    g, r = geometry, shape["roughness"]
    up = g.reflects
    a = 1.0 / (1.0 + C1 * r)
    s = g.wix * g.wox + g.wiy * g.woy
    larger = jnp.where(up, jnp.maximum(g.cos_i, g.cos_o), 1.0)
    away = (1.0 - r) + r * (2.0 * g.cos_d * g.cos_d - g.cos_i * g.cos_o)
    single = jnp.where(s > 0, 1.0 + r * jnp.where(s > 0, s, 0.0) / larger, away)
    k_i, k_o = C1 - _g_over_pi(g.cos_i), C1 - _g_over_pi(g.cos_o)
    multiple = r * k_i * k_o / (C1 - C2)
    scale = a / jnp.pi
    return jnp.where(up, scale * single, 0.0), jnp.where(up, scale * multiple, 0.0)


def eon_value(shape: Shape, geometry: Geometry, albedo: Array, *, exact: bool) -> Array:
    """EON at one albedo, with its own basis functions or with the polynomial's."""
    lobe = EON()
    basis = lobe.basis if exact else eon_basis_polynomial
    terms = zip(basis(shape, geometry), lobe.amplitudes(shape, (albedo,)), strict=True)
    first, second = (b * a for b, a in terms)
    return first + second


def _g_over_pi(mu: Array) -> Array:
    m = 1.0 - mu
    return m * (0.0571085289 + m * (0.491881867 + m * (-0.332181442 + m * 0.0714429953)))
