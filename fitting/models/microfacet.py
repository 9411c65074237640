"""What all lobes around the half vector share: widths, tangent frame, stretched slopes."""

from __future__ import annotations

import math
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Shape, SlopeWidths
from fitting.parameters import Parameter, shape

ALPHA_SUPPORT = (1e-4, 1.5)


def width_parameters(anisotropic: bool) -> tuple[Parameter, ...]:
    """``alpha``, or ``alpha_x, alpha_y`` and the angle of the tangent frame."""
    if not anisotropic:
        return (
            shape("alpha", 0.2, ALPHA_SUPPORT, "microfacet slope width", start=(0.01, 1.0)),
        )
    return (
        shape(
            "alpha_x", 0.2, ALPHA_SUPPORT, "slope width along the tangent",
            start=(0.02, 0.8),
        ),
        shape(
            "alpha_y", 0.3, ALPHA_SUPPORT, "slope width across the tangent",
            start=(0.02, 0.8),
        ),
        shape(
            "angle", 0.4, (0.0, math.pi), "azimuth of the tangent",
            unit="rad", scale="periodic", start=(0.0, math.pi),
        ),
    )  # fmt: skip


def slope_widths(parameters: Shape) -> SlopeWidths:
    """The widths as three numbers, whether isotropic or not."""
    if "alpha" in parameters:
        alpha = parameters["alpha"]
        return SlopeWidths(alpha, alpha, jnp.zeros_like(alpha))
    return SlopeWidths(parameters["alpha_x"], parameters["alpha_y"], parameters["angle"])


class Stretched(NamedTuple):
    """Squared tangential lengths after the stretch that makes a width of 1.

    ``h2 = (hx/ax)^2 + (hy/ay)^2``, ``i2 = (ax wix)^2 + (ay wiy)^2``, ``o2`` likewise for
    ``wo``, all in the tangent frame; ``area = ax ay``.
    """

    h2: Array
    i2: Array
    o2: Array
    area: Array


def stretched(parameters: Shape, g: Geometry) -> Stretched:
    """Half vector and directions in the frame where the distribution is round."""
    if "alpha" in parameters:
        alpha = parameters["alpha"]
        a2 = alpha**2
        # Not divided by alpha^2: the derivative would pass through alpha^-4, and overflow.
        return Stretched(
            (g.hx / alpha) ** 2 + (g.hy / alpha) ** 2,
            (g.wix**2 + g.wiy**2) * a2,
            (g.wox**2 + g.woy**2) * a2,
            a2,
        )
    ax, ay, angle = slope_widths(parameters)
    c, s = jnp.cos(angle), jnp.sin(angle)

    def along(x: Array, y: Array) -> tuple[Array, Array]:
        return c * x + s * y, c * y - s * x

    hx, hy = along(g.hx, g.hy)
    ix, iy = along(g.wix, g.wiy)
    ox, oy = along(g.wox, g.woy)
    return Stretched(
        (hx / ax) ** 2 + (hy / ay) ** 2,
        (ax * ix) ** 2 + (ay * iy) ** 2,
        (ax * ox) ** 2 + (ay * oy) ** 2,
        ax * ay,
    )
