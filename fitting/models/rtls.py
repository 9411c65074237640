"""Ross-Li: the kernel model of MODIS land products, linear, for vegetation and soil."""

from __future__ import annotations

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient

HORIZON = 1e-6


class RTLS(Lobe):
    """``f = (f_iso + f_vol K_vol + f_geo K_geo) / pi``.

    Ross-Thick and Li-Sparse-Reciprocal kernels of Wanner et al. 1995 and Lucht et al.
    2000, eq. 38 to 44, for crowns with ``h / b = 2`` and ``b / r = 1``. With the phase
    angle ``xi``:
    ``K_vol = ((pi / 2 - xi) cos(xi) + sin(xi)) / (cos_i + cos_o) - pi / 4``,
    ``K_geo = O - sec_i - sec_o + (1 + cos(xi)) sec_i sec_o / 2``,
    ``O = (t - sin(t) cos(t)) (sec_i + sec_o) / pi`` and ``cos(t) = min(1, 2 sqrt(D^2 +
    (tan_i tan_o sin(phi))^2) / (sec_i + sec_o))``, ``D^2 = tan_i^2 + tan_o^2 - 2 tan_i
    tan_o cos(phi)``. The three coefficients are those of the data products. The kernels,
    and ``f``, may be negative. ``K_geo`` has a pole at the horizon: its denominator
    ``cos_i cos_o`` counts cosines below 1e-6 as 1e-6.
    """

    NAME: ClassVar[str] = "rtls"
    REFERENCE: ClassVar[str] = "Lucht, Schaaf and Strahler 2000, eq. 37 to 44"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None
    NONNEGATIVE: ClassVar[bool] = False

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            coefficient("f_iso", 0.3, "weight of the isotropic kernel"),
            coefficient("f_vol", 0.1, "weight of the volume (Ross-Thick) kernel"),
            coefficient("f_geo", 0.05, "weight of the geometric (Li-Sparse-R) kernel"),
        )

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        up = g.reflects
        both = jnp.where(up, g.cos_i + g.cos_o, 1.0)
        # wi x wo is sin(xi) long, and so is the root in cos(t) times cos_i cos_o.
        x = g.cos_o * g.wix - g.cos_i * g.wox
        y = g.cos_o * g.wiy - g.cos_i * g.woy
        plus_x, plus_y = g.wix + g.wox, g.wiy + g.woy
        z = 0.5 * (plus_y * (g.wix - g.wox) - plus_x * (g.wiy - g.woy))
        sin_xi = _root(x * x + y * y + z * z)

        cos_t = 2.0 * sin_xi / both
        overlaps = cos_t < 1.0
        inside = jnp.where(overlaps, cos_t, 0.0)
        sin_t = jnp.sqrt((1.0 - inside) * (1.0 + inside))
        # (pi / 2 - t + sin(t) cos(t)) / pi, so that O - sec_i - sec_o cancels nothing.
        bare = (jnp.arctan2(inside, sin_t) + inside * sin_t) / np.pi
        bare = both * jnp.where(overlaps, bare, 0.5)
        # (1 + cos(xi)) / 2 - (cos_i + cos_o) / 2: 0 where both directions are the normal.
        below = _below_one(g.wix, g.wiy, g.cos_i) * _below_one(g.wox, g.woy, g.cos_o)
        steep = 0.5 * (below + g.wix * g.wox + g.wiy * g.woy)
        seen = jnp.where(both > 1.0, steep, g.cos_d * g.cos_d - 0.5 * both) - bare
        raised_i, raised_o = jnp.maximum(g.cos_i, HORIZON), jnp.maximum(g.cos_o, HORIZON)
        k_geo = seen / (raised_i * raised_o)
        kernels = jnp.ones_like(both), _volume(g, sin_xi, both), k_geo
        return tuple(jnp.where(up, k / np.pi, 0.0) for k in kernels)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None


def _root(square: Array) -> Array:
    """Square root, with the derivative 0 at 0."""
    known = square > 0
    return jnp.where(known, jnp.sqrt(jnp.where(known, square, 1.0)), 0.0)


def _below_one(x: Array, y: Array, cosine: Array) -> Array:
    """``1 - cos(theta)``; the denominator is harmless below the horizon, too."""
    return (x * x + y * y) / (1.0 + jnp.maximum(cosine, 0.0))


def _volume(g: Geometry, sin_xi: Array, both: Array) -> Array:
    """``K_vol``, in three forms of its numerator over ``both = cos_i + cos_o``.

    It is 0 where both directions are the normal, and on a surface through that point. To
    keep digits there, ``1 - cos_i`` and ``1 - cos_o`` come from squares of components,
    ``sin(xi) - xi cos(xi)`` of a small ``xi`` is a series, and near a right angle
    ``sin(xi)`` is ``1 - cos(xi)^2 / (1 + sin(xi))``.
    """
    dot = g.wix * g.wox + g.wiy * g.woy
    c = dot + g.cos_i * g.cos_o
    below_i = _below_one(g.wix, g.wiy, g.cos_i)
    below_o = _below_one(g.wox, g.woy, g.cos_o)
    xi = jnp.arctan2(sin_xi, c)

    upright = jnp.abs(c) < 0.6
    cu = jnp.where(upright, c, 0.0)
    sine = jnp.sqrt((1.0 - cu) * (1.0 + cu))
    beyond = jnp.minimum(g.cos_i, g.cos_o) - jnp.minimum(below_i, below_o)
    at_right_angle = cu * (jnp.arctan2(cu, sine) - cu / (1.0 + sine)) + (
        (1.0 - 0.25 * np.pi) - 0.25 * np.pi * beyond
    )

    near = c >= 0.6
    small = jnp.where(near, xi, 0.0)
    series = jnp.zeros_like(xi)
    for k in range(9, 0, -1):
        term = 2.0 * k * (-1.0) ** (k + 1) / math.factorial(2 * k + 1)
        series = term + small * small * series
    first = 0.25 * np.pi * (2.0 * dot - g.cos_i * below_o - g.cos_o * below_i)
    oblique = first + jnp.where(near, small**3 * series, sin_xi - xi * c)
    return jnp.where(upright, at_right_angle, oblique) / both
