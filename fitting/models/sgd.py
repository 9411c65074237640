"""SGD: the shifted-gamma lobe, with the most freedom in peak, skirt and shadowing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.geometry import Geometry
from fitting.models import fresnel
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape

_COUNT, _LONGEST = 56, 40.0


def _unit_nodes() -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [0, 1].

    The weights ``1 / ((1 - x^2) P'(x)^2)`` have no error to first order in that of the
    nodes; numpy's are off by up to 200 ulp of a sum that counts only some of them.
    """
    x, _ = np.polynomial.legendre.leggauss(_COUNT)
    wide = x.astype(np.longdouble)
    last = np.eye(_COUNT + 1, dtype=np.longdouble)[_COUNT]
    slope = np.polynomial.legendre.legval(wide, np.polynomial.legendre.legder(last))
    weights = 1.0 / ((1.0 - wide) * (1.0 + wide) * slope**2)
    return 0.5 * (x + 1.0), weights.astype(np.float64)


_NODES, _WEIGHTS = _unit_nodes()


class SGD(Lobe):
    """``f = F(cos_d) D(h) G1(i) G1(o) / (pi cos_i cos_o)`` with a shifted-gamma ``D``.

    Bagher, Soler and Holzschuch 2012, to be added to `lambert`: with ``x = tan^2(theta_h)``

        D   = exp(-x / alpha) (1 + x / alpha^2)^(-p) / (pi alpha J cos(theta_h)^4)
        G1  = 1 + lambda (1 - exp(c max(0, theta - theta0)^k)),   0 at the horizon
        F   = f90 q + f0 (1 - q) + f1 (s - q),   s = 1 - cos_d,   q = s^5

    ``J`` normalises ``D``, which at ``p = 0`` is Beckmann's with the squared width
    ``alpha``; ``p`` sharpens its tip. The paper's ``c`` is no parameter: in all 300
    published fits it is ``ln(1 + 1 / lambda) / (pi/2 - theta0)^k`` to the printed digits,
    which makes ``G1`` vanish at the horizon, and the lobe finite there. The others map one
    to one: ``K_AP`` is ``1 / (alpha Gamma(1 - p, alpha))``, and with ``ks, F0, F1`` the
    coefficients are ``f90 = ks``, ``f0 = ks (F0 - F1)`` and ``f1 = ks F1``.

    Reciprocal, but a description of data and no physical model: it divides by ``pi`` where
    facets would have 4, ``F`` goes below zero where ``f1`` is far enough below zero, and
    nothing bounds the albedo.
    """

    NAME: ClassVar[str] = "sgd"
    REFERENCE: ClassVar[str] = "Bagher, Soler and Holzschuch 2012, EGSR"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None
    PER_ANGLE: ClassVar[bool] = True

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "alpha", 0.03, (1e-5, 1.5), "squared slope width of the skirt",
                start=(1e-3, 0.5),
            ),
            shape(
                "p", 0.5, (0.0, 1.8), "how much the tip is sharper than the skirt",
                scale="linear", start=(0.1, 1.0),
            ),
            shape(
                "lambda", 3.0, (1e-2, 1e3), "how much of the shadow comes early",
                start=(1.0, 10.0),
            ),
            shape(
                "k", 20.0, (2.0, 1e3), "how suddenly the shadow sets in",
                start=(7.0, 60.0),
            ),
            shape(
                "theta0", 0.1, (-1.0, 1.4), "polar angle up to which there is no shadow",
                unit="rad", scale="linear", start=(-0.3, 0.6),
            ),
            coefficient("f0", 0.04, "facet reflectance at normal incidence"),
            coefficient("f90", 1.0, "facet reflectance at grazing incidence"),
            coefficient(
                "f1", 0.0, "what the facet reflectance has more in between",
                support=(-math.inf, math.inf),
            ),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, alpha = geometry, shape["alpha"]
        h2, hz2 = g.hx * g.hx + g.hy * g.hy, g.hz * g.hz
        # Where the exponential is below all floats the lobe and its derivatives are exactly
        # zero; elsewhere hz is far from zero. Its two halves take the other factors between
        # them, lest a large one meet it already underflown.
        cap = -1.8 * math.log(jnp.finfo(jnp.result_type(h2)).tiny)
        seen = g.reflects & (h2 < cap * alpha * hz2)
        hz2 = jnp.where(seen, hz2, 1.0)
        t = jnp.where(seen, h2, 0.0) / hz2 / alpha
        half = jnp.exp(-0.5 * t)
        tip = jnp.exp(-shape["p"] * jnp.log1p(t / alpha))
        d = tip / (jnp.pi * alpha * _norm(alpha, shape["p"]) * hz2 * hz2)
        lit_i, lit_o = g.over_angles(_lit(shape))
        value = jnp.where(seen, half * (d * lit_i * lit_o / jnp.pi) * half, 0.0)
        s = jnp.maximum(1.0 - g.cos_d, 0.0)
        rest, q = fresnel.split("schlick", shape, value, g.cos_d)
        # s - s^5 = s (1 - s) (1 + s) (1 + s^2), without a difference.
        between = s * g.cos_d * (1.0 + s) * (1.0 + s * s)
        return rest, q, value * between

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        # Between the width alpha of the tip and the width sqrt(alpha) of the skirt.
        tip = 0.5 * jnp.minimum(shape["p"], 1.0)
        width = jnp.exp((0.5 + tip) * jnp.log(shape["alpha"]))
        return SlopeWidths(width, width, jnp.zeros_like(width))


def _norm(alpha: Float[Array, "*s"], p: Float[Array, "*s"]) -> Float[Array, "*s"]:
    """``J = int_0^inf exp(-t) (1 + t / alpha)^(-p) dt = e^a a^p Gamma(1 - p, a)``.

    For any ``p``, also where ``Gamma`` is singular, and with derivatives by both: with
    ``t = alpha (e^y - 1)`` and Gauss-Legendre nodes in ``y`` up to ``t = 40``, to rounding.
    """
    dtype = alpha.dtype
    top = jax.lax.stop_gradient(jnp.log1p(_LONGEST / alpha))
    y = top[..., None] * jnp.asarray(_NODES, dtype)
    terms = jnp.exp((1.0 - p[..., None]) * y - alpha[..., None] * jnp.expm1(y))
    return alpha * top * jnp.sum(jnp.asarray(_WEIGHTS, dtype) * terms, axis=-1)


def _lit(shape: Shape) -> Callable[[Array, Array], Array]:
    """``G1 / cos(theta)`` as a function of ``sin^2(theta), cos(theta)``.

    With the elevation ``u = pi/2 - theta``, that of ``theta0`` called ``u0``, and ``1 - y =
    1 - (1 - u / u0)^k``, ``G1 = (1 + lambda) (1 - (1 + 1 / lambda)^(y - 1))``: nothing
    cancels, and the quotient keeps its digits down to its limit at the horizon.
    """
    strength, k = shape["lambda"], shape["k"]
    base = jnp.log1p(1.0 / strength)
    top = 0.5 * math.pi - shape["theta0"]

    def lit(sine2: Array, cosine: Array) -> Array:
        # So far below rounding that the quotient has its limit, and no square underflows.
        cosine = jnp.maximum(cosine, float(jnp.finfo(cosine.dtype).eps) ** 2)
        tilted = sine2 > 0
        sine = jnp.where(tilted, jnp.sqrt(jnp.where(tilted, sine2, 1.0)), 0.0)
        share = jnp.arctan2(cosine, sine) / top
        shaded = share < 1.0
        share = jnp.where(shaded, share, 0.5)
        # ln(1 - u) by a positive argument: XLA's log1p loses 100 ulp below -0.35.
        rest = -jnp.expm1(-k * jnp.log1p(share / (1.0 - share)))
        g1 = -(1.0 + strength) * jnp.expm1(-base * rest)
        return jnp.where(shaded, g1, 1.0) / cosine

    return lit
