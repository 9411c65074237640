"""Masking and shadowing, as the visibility ``V = G2 / (4 cos_i cos_o)``."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import jax.numpy as jnp
from jax.scipy.special import erfc
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.quotients import half_excess, reciprocal
from fitting.quadrature import unit_nodes

Shadowing = Literal["correlated", "uncorrelated", "v_cavity", "bare"]


def visibility(
    kind: Shadowing, geometry: Geometry, up: Array, cos_lambda: Callable[[], tuple]
) -> Array:
    """``G2 / (4 cos_i cos_o)``, finite wherever ``up`` and one cosine is positive.

    ``cos_lambda()`` gives ``cos Lambda`` of Smith for both directions, which stays finite
    at grazing.

    - ``correlated``: ``G2 = 1 / (1 + Lambda_i + Lambda_o)``, heights of one surface
      (Heitz 2014, eq. 99).
    - ``uncorrelated``: ``G2 = 1 / ((1 + Lambda_i) (1 + Lambda_o))`` (ibid., eq. 98).
    - ``v_cavity``: ``G2 = min(1, 2 hz cos_i / cos_d, 2 hz cos_o / cos_d)`` (Torrance and
      Sparrow 1967), with ``2 hz cos_d = cos_i + cos_o``; its derivatives jump where two of
      the three are equal.
    - ``bare``: ``V = 1 / 4``, neither shadowing nor the factor of the projected areas.
    """
    cos_i, cos_o = jnp.where(up, geometry.cos_i, 1.0), jnp.where(up, geometry.cos_o, 1.0)
    if kind == "bare":
        return jnp.full_like(cos_i, 0.25)
    product = cos_i * cos_o
    if kind == "v_cavity":
        cos_d = jnp.where(up, geometry.cos_d, 1.0)
        share = (cos_i + cos_o) / jnp.maximum(cos_i, cos_o)
        lit = product * share >= cos_d * cos_d
        # The square of a quotient: one over a square overflows sooner when derived.
        shadowed = share * (0.5 / cos_d) ** 2
        return jnp.where(lit, 0.25 / jnp.where(lit, product, 1.0), shadowed)
    of_i, of_o = (jnp.where(up, v, 0.0) for v in cos_lambda())
    if kind == "uncorrelated":
        return 0.25 * reciprocal((cos_i + of_i) * (cos_o + of_o))
    return 0.25 * reciprocal(product + cos_o * of_i + cos_i * of_o)


def cos_lambda_ggx(t2: Array, cosine: Array) -> Array:
    """``cos Lambda = (sqrt(cos^2 + t2) - cos) / 2`` of GGX, without the cancellation.

    Heitz 2014, eq. 72, with ``t2 = (alpha sin)^2``.
    """
    return half_excess(t2, cosine)


def cos_lambda_beckmann(t2: Array, cosine: Array) -> Array:
    """``cos Lambda(x)``, ``x = cos / sqrt(t2)``, exact (Walter et al. 2007, eq. 26).

    ``x Lambda = (exp(-x^2) / sqrt(pi) - x erfc(x)) / 2``: no pole at grazing, and not the
    paper's rational approximation. Beyond ``x = 7`` it is below 1e-24 and is set to zero,
    which also keeps the derivative of the root away from normal incidence, where
    ``t2 = 0``.
    """
    shadowed = t2 * 49.0 > cosine * cosine
    t = jnp.sqrt(jnp.where(shadowed, t2, 1.0))
    x = jnp.where(shadowed, cosine, 0.0) / t
    x_lambda = 0.5 * (jnp.exp(-x * x) / math.sqrt(math.pi) - x * erfc(x))
    return jnp.where(shadowed, t * x_lambda, 0.0)


def cos_lambda_student_t(t2: Array, cosine: Array, gamma: Array) -> Array:
    """``cos Lambda`` of the Student-t distribution, by 24 nodes.

    ``Lambda`` is the mean height of the slopes above the line of sight (Heitz 2014, eq.
    61), ``cos Lambda = t int_z^inf (x - z) p(x) dx`` with ``z = cos / t`` and Student's
    density ``p`` of the slope along it. With ``x = sqrt(gamma - 1) cot(y)`` and
    ``cot(d) = z / sqrt(gamma - 1)``::

        cos Lambda = t sqrt(gamma - 1) / sqrt(pi) Gamma(gamma - 1/2) / Gamma(gamma - 1)
                     int_0^d sin(y)^(2 gamma - 4) sin(d - y) / sin(d) dy

    Nothing in it is negative. Below ``gamma = 3`` the power of ``y`` at 0 is not whole,
    or a pole; another power of the variable removes it. Error of ``G1`` below 1e-8.
    """
    some = t2 > 0
    t = jnp.sqrt(jnp.where(some, t2, 1.0))
    root = jnp.sqrt(gamma - 1.0)
    end = jnp.arctan2(t * root, cosine)[..., None]
    nodes, weights = _gauss(24, t2.dtype)
    power = jnp.maximum(1.0, 3.0 / (2.0 * gamma - 3.0))
    share = jnp.exp(power * jnp.log(nodes))
    y = end * share
    # dy = power end x^(power - 1) dx; the powers of x that meet are joined.
    grown = jnp.exp((power * (2.0 * gamma - 3.0) - 1.0) * jnp.log(nodes)) * power
    # sin(y) / share; with gamma next to 1.5 the share of the first node underflows.
    away = y > 1e-3
    sinc = jnp.where(away, jnp.sin(y) / jnp.where(away, y, 1.0), 1.0 - y * y / 6.0)
    rest = jnp.exp((2.0 * gamma - 4.0) * jnp.log(end * sinc))
    ratio = jnp.sin(end - y) / jnp.sin(end)
    integral = jnp.sum(weights * grown * rest * end * ratio, axis=-1)
    factor = root * _gamma_ratio(gamma - 1.0) / math.sqrt(math.pi)
    return jnp.where(some, t * factor * integral, 0.0)


def cos_lambda_gtr(
    sine2: Array, cosine: Array, alpha: Array, density: Callable[[Array, Array], Array]
) -> Array:
    """``cos Lambda`` of an isotropic distribution ``D(s2 / alpha^2, hz)``, by 56 nodes.

    The projected area of the facets that face away, ``cos Lambda = int max(0, -w.m) D dm``
    (Heitz 2014, eq. 21 and 26), in which nothing cancels. The azimuth is integrated in
    closed form; of the slopes ``r``, those up to 2 as ``alpha sinh(u)`` with nodes that
    crowd towards the smallest slope that faces away, the others as ``2 / x``. Directions
    within 1e-4 rad of the normal see no shadowing.
    """
    some = sine2 > 1e-8 * cosine * cosine
    sine = jnp.sqrt(jnp.where(some, sine2, 1.0))[..., None]
    first = jnp.where(some, cosine, 0.0)[..., None] / sine
    bend = 2.0 * jnp.maximum(first, 1.0)

    def facing_away(r: Array, beyond: Array, dr: Array) -> Array:
        """Sum over slopes, given with ``beyond = r - first``, which would cancel."""
        hz2 = 1.0 / (1.0 + r * r)
        slopes = density((r / alpha) ** 2 * hz2, jnp.sqrt(hz2)) * hz2 * hz2
        turn = first / r
        away = jnp.sqrt(beyond / r * (1.0 + turn))
        half_turn = jnp.arctan2(away, turn)
        narrow = half_turn < 0.03
        height = jnp.where(
            narrow, away**3 / 3.0 * (1.0 + 0.2 * away * away), away - turn * half_turn
        )
        return jnp.sum(slopes * r * r * height * dr, axis=-1)

    nodes, weights = _gauss(40, sine2.dtype)
    begin = jnp.arcsinh(first / alpha)
    span = jnp.arcsinh(bend / alpha) - begin
    step = span * nodes * nodes
    r = alpha * jnp.sinh(begin + step)
    beyond = 2.0 * alpha * jnp.cosh(begin + 0.5 * step) * jnp.sinh(0.5 * step)
    dr = alpha * jnp.cosh(begin + step) * 2.0 * span * nodes * weights
    near = facing_away(r, beyond, dr)
    nodes, weights = _gauss(16, sine2.dtype)
    r = bend / nodes
    far = facing_away(r, r - first, r / nodes * weights)
    return jnp.where(some, 2.0 * sine[..., 0] * (near + far), 0.0)


def _gauss(count: int, dtype) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    x, w = unit_nodes(count)
    return jnp.asarray(x, dtype), jnp.asarray(w, dtype)


# The series of Gamma(x + 1/2) / (Gamma(x) sqrt(x)) in 1/x.
_GAMMA_RATIO = (
    1.0, -1 / 8, 1 / 128, 5 / 1024, -21 / 32768, -399 / 262144, 869 / 4194304,
    39325 / 33554432,
)  # fmt: skip


def _gamma_ratio(x: Array) -> Array:
    """``Gamma(x + 1/2) / Gamma(x)``, by its series at ``x + 8`` and 8 steps down.

    A difference of logarithms of Gamma would lose two digits in float32.
    """
    steps = 1.0
    for k in range(8):
        steps = steps * ((x + k) / (x + (k + 0.5)))
    z = 1.0 / (x + 8.0)
    series = 0.0
    for term in reversed(_GAMMA_RATIO):
        series = term + z * series
    return steps * jnp.sqrt(x + 8.0) * series
