"""Hapke: particulate surfaces such as regolith, with opposition effect and roughness."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape

# exp(-2 z / pi) is below half a unit in the last place of 2, in either precision.
FLAT = 60.0


class Hapke(Lobe):
    """``f = w / (4 pi) m_i / (m_i + m_o) [P (1 + B) + H(m_i) H(m_o) - 1] S / cos_i``.

    Hapke 2012, "Theory of Reflectance and Emittance Spectroscopy", 2nd edition, without
    the porosity factor: single-scattering albedo ``w``, a phase function ``P`` of two
    Henyey-Greenstein terms of width ``b`` of which the share ``c`` scatters back,
    ``B = b0 / (1 + tan(xi / 2) / h)`` at the phase angle ``xi`` for the opposition effect,
    ``H(x) = 1 / (1 - w x (r + (1 - 2 r x) / 2 log(1 + 1 / x)))`` with
    ``r = (1 - sqrt(1 - w)) / (1 + sqrt(1 - w))``, and the effective cosines ``m_i, m_o``
    and the shadowing ``S`` of a surface of mean slope angle ``theta_bar``. ``w`` ends
    short of 1, where the slope of ``H`` in ``w`` is infinite. There is a pole where both
    directions graze at the same azimuth. No parameter is linear, so ``scale`` is added;
    at 1 it is the published model.
    """

    NAME: ClassVar[str] = "hapke"
    REFERENCE: ClassVar[str] = "Hapke 2012, with the roughness of Hapke 1984"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "w", 0.5, (0.01, 0.9999), "single-scattering albedo",
                scale="linear", start=(0.1, 0.9),
            ),
            shape(
                "b", 0.3, (0.0, 0.95), "width of the phase function, 0 for isotropic",
                scale="linear", start=(0.1, 0.5),
            ),
            shape(
                "c", 0.5, (0.0, 1.0), "share of the phase function that scatters back",
                scale="linear", start=(0.2, 0.9),
            ),
            shape(
                "h", 0.06, (1e-3, 1.0), "width of the opposition effect in tan(xi / 2)",
                start=(0.02, 0.3),
            ),
            shape(
                "b0", 1.0, (0.0, 1.0), "height of the opposition effect",
                scale="linear", start=(0.2, 0.9),
            ),
            shape(
                "theta_bar", 0.3, (0.002, 1.0), "mean slope angle of the surface",
                unit="rad", scale="linear", start=(0.05, 0.6),
            ),
            coefficient("scale", 1.0, "factor of the lobe, 1 for the published model"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, w = geometry, shape["w"]
        up = g.reflects
        steep = jnp.where(up, jnp.maximum(g.cos_i, g.cos_o), 1.0)
        flat = jnp.where(up, jnp.minimum(g.cos_i, g.cos_o), 1.0)
        swap = g.cos_i < g.cos_o
        sine_i, sine_o = _root(g.wix**2 + g.wiy**2), _root(g.wox**2 + g.woy**2)
        sine_steep = jnp.where(swap, sine_o, sine_i)
        sine_flat = jnp.where(swap, sine_i, sine_o)
        r = _rough(shape["theta_bar"], steep, sine_steep, flat, sine_flat, _azimuth(g))

        # H = 1 / (1 - v), and H H - 1 without the loss for small w.
        v_1, v_2 = _repeated(w, r.steep), _repeated(w, r.flat)
        many = (v_1 + v_2 - v_1 * v_2) / ((1.0 - v_1) * (1.0 - v_2))
        radiance = _phase(shape, g) + many
        cosines = r.steep * r.flat / (r.steep + r.flat)
        value = w / (4.0 * np.pi) * cosines * radiance * r.shadow
        return (jnp.where(up, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None


class _Azimuth(NamedTuple):
    """``cos^2, sin^2`` of half the azimuth ``psi`` between source and detector; ``1 - psi /
    pi``; ``f = exp(-2 tan(psi / 2))`` and ``1 - f``."""

    cos2: Array
    sin2: Array
    rest: Array
    fade: Array
    faded: Array


class _Rough(NamedTuple):
    """Effective cosines towards the steeper and the flatter direction, and ``S / cos_i``
    with the effective cosine of the other direction taken out."""

    steep: Array
    flat: Array
    shadow: Array


def _root(square: Array) -> Array:
    """Square root, with the derivative 0 at 0."""
    known = square > 0
    return jnp.where(known, jnp.sqrt(jnp.where(known, square, 1.0)), 0.0)


def _azimuth(g: Geometry) -> _Azimuth:
    """Of the components; where one direction is the normal, 0 for any azimuth."""
    dot = g.wix * g.wox + g.wiy * g.woy
    # Of the sum and the difference: one of them is small, and known exactly, where the
    # azimuths are opposite or equal and the cross product of both directions cancels.
    plus_x, plus_y = g.wix + g.wox, g.wiy + g.woy
    minus_x, minus_y = g.wix - g.wox, g.wiy - g.woy
    cross = 0.5 * (plus_x * minus_y - plus_y * minus_x)
    across = jnp.abs(cross)
    length = jnp.abs(dot) + _root(dot * dot + cross * cross)
    # The tangent of half the acute angle is never above 1.
    t = across / jnp.where(length > 0, length, 1.0)
    acute = dot >= 0
    near, far = 1.0 / (1.0 + t * t), t * t / (1.0 + t * t)
    half = 2.0 * jnp.arctan(t) / np.pi
    seen = t > 0.01
    exponent = jnp.where(acute, 2.0 * t, 2.0 / jnp.where(seen, t, 1.0))
    lost = ~acute & ~seen
    return _Azimuth(
        jnp.where(acute, near, far),
        jnp.where(acute, far, near),
        jnp.where(acute, 1.0 - half, half),
        jnp.where(lost, 0.0, jnp.exp(-exponent)),
        jnp.where(lost, 1.0, -jnp.expm1(-exponent)),
    )


def _rough(
    theta_bar: Array, steep: Array, sine_steep: Array, flat: Array, sine_flat: Array,
    azimuth: _Azimuth,
) -> _Rough:  # fmt: skip
    """Macroscopic roughness of Hapke 1984, symmetric in source and detector.

    ``E1(x) = exp(-2 cot(theta_bar) cot(x) / pi)``, ``E2(x) = exp(-(cot(theta_bar)
    cot(x))^2 / pi)``. The paper's differences next to ``E1 = E2 = 1`` at the horizon are
    written with expm1, and ``cos(psi)`` with half angles.
    """
    slope = jnp.tan(theta_bar)
    chi = 1.0 / jnp.sqrt(1.0 + np.pi * slope * slope)

    def over_slope(cosine: Array, sine: Array) -> Array:
        finite = cosine < FLAT * sine * slope
        return jnp.where(finite, cosine / jnp.where(finite, sine * slope, 1.0), FLAT)

    z_steep, z_flat = over_slope(steep, sine_steep), over_slope(flat, sine_flat)
    lost_steep = -jnp.expm1(-2.0 / np.pi * z_steep)
    lost_flat = -jnp.expm1(-2.0 / np.pi * z_flat)
    second_steep = jnp.exp(-z_steep * z_steep / np.pi)
    second_flat = jnp.exp(-z_flat * z_flat / np.pi)
    apart = (z_flat - z_steep) * (z_flat + z_steep) / np.pi
    step = -second_flat * jnp.expm1(jnp.minimum(apart, 0.0))

    base = lost_flat + lost_steep + azimuth.rest * (1.0 - lost_steep)
    tilt = azimuth.cos2 * second_flat
    turn = azimuth.sin2 * step
    m_steep = chi * (steep + sine_steep * slope * (tilt - turn) / base)
    m_flat = chi * (flat + sine_flat * slope * (tilt + turn) / base)
    e_steep = chi * (steep + sine_steep * slope * second_steep / (1.0 + lost_steep))
    e_flat = chi * (flat + sine_flat * slope * second_flat / (1.0 + lost_flat))
    hidden = azimuth.faded + azimuth.fade * chi * steep / e_steep
    return _Rough(m_steep, m_flat, chi / (e_steep * e_flat * hidden))


def _repeated(w: Array, x: Array) -> Array:
    """``1 - 1 / H`` towards an effective cosine (2012, eq. 8.56)."""
    r = w / (1.0 + jnp.sqrt(1.0 - w)) ** 2
    logarithm = jnp.log1p(x) - jnp.log(x)
    return w * x * (r + (0.5 - r * x) * logarithm)


def _phase(shape: Shape, g: Geometry) -> Array:
    """``P (1 + B)``, with ``1 +- 2 b cos(xi) + b^2`` as sums of positive terms."""
    b, c, h = shape["b"], shape["c"], shape["h"]
    x, y, z = g.wix - g.wox, g.wiy - g.woy, g.cos_i - g.cos_o
    sin2_half = 0.25 * (x * x + y * y + z * z)
    start = (1.0 - b) ** 2
    forward = start + 4.0 * b * g.cos_d * g.cos_d
    back = start + 4.0 * b * sin2_half
    terms = (1.0 - c) / (forward * jnp.sqrt(forward)) + c / (back * jnp.sqrt(back))
    surge = h * g.cos_d / (h * g.cos_d + _root(sin2_half))
    return (1.0 - b) * (1.0 + b) * terms * (1.0 + shape["b0"] * surge)
