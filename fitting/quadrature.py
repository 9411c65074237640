"""Nodes and weights for integrals of lobes over the hemisphere.

They are fixed in number and move smoothly with the widths of the lobe, so that integrals
can be differentiated.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry, from_components
from fitting.models.lobe import AxisPeak, SlopeWidths


def tangential(mu: Array, azimuth: Array) -> tuple[Array, Array]:
    """x and y of a direction by its cosine and azimuth."""
    sine = jnp.sqrt((1.0 - mu) * (1.0 + mu))
    return sine * jnp.cos(azimuth), sine * jnp.sin(azimuth)


def unit_nodes(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(max(count, 1))
    return 0.5 * (x + 1.0), 0.5 * w


def _quarters(count: int, quarters: int) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths and weights of as many quarters of the circle, ``count`` nodes in each."""
    x, w = unit_nodes(count)
    phi = 0.5 * np.pi * (np.arange(quarters)[:, None] + x)
    return phi.ravel(), 0.5 * np.pi * np.tile(w, quarters)


def over_half_vector(
    mu: Array,
    azimuth: Array,
    widths: SlopeWidths,
    nodes: int,
    *,
    full_circle: bool = False,
) -> tuple[Geometry, Array]:
    """Nodes ``(k, nodes, azimuths)`` of the half vector, and ``cos_i dwi`` at each.

    Slopes are ``r (alpha_x cos(phi), alpha_y sin(phi))`` in the tangent frame with
    ``r = tan v`` and Gauss-Legendre nodes in ``v`` and in quarters of ``phi`` that begin at
    the detector. The measure is ``dwi = 4 cos_d dwh``, ``dwh = cos^3(theta_h) alpha_x
    alpha_y r dr dphi``. The source is on the horizon where ``tan(theta_h) = (R + p) /
    cos_o`` with ``p`` the component of wo along the azimuth of the half vector and
    ``R^2 = p^2 + cos_o^2``: for a grazing detector this bends sharply at ``p = 0``, where
    the quarters meet. Where the lobe is round, half a circle stands for both.
    """
    dtype = mu.dtype
    x_o, y_o = tangential(mu, azimuth)
    ax, ay, angle = widths
    ca, sa = jnp.cos(angle), jnp.sin(angle)
    phi, dphi = _quarters(nodes // 2, 4 if full_circle else 2)
    dphi = jnp.asarray(dphi if full_circle else 2.0 * dphi, dtype)
    start_x, start_y = ax * jnp.cos(azimuth - angle), ay * jnp.sin(azimuth - angle)
    start = jnp.sqrt(start_x * start_x + start_y * start_y)
    c, s = jnp.asarray(np.cos(phi), dtype), jnp.asarray(np.sin(phi), dtype)
    ux = ax * (c * start_x - s * start_y) / start
    uy = ay * (s * start_x + c * start_y) / start
    rho = jnp.sqrt(ux * ux + uy * uy)
    px, py = (ca * ux - sa * uy) / rho, (sa * ux + ca * uy) / rho

    p = x_o * px + y_o * py
    r2 = p * p + mu * mu
    big = jnp.sqrt(jnp.where(r2 > 0, r2, 1.0)) + jnp.abs(p)
    # (R + p) (R - p) = cos_o^2: the form without cancellation on either side.
    top = jnp.where(p > 0, big, mu)
    bottom = jnp.where(p > 0, mu, big)
    v_max = jnp.arctan2(top, rho * bottom)

    x, w = unit_nodes(nodes)
    r = jnp.tan(v_max * jnp.asarray(x, dtype)[:, None])
    dr = (1.0 + r * r) * v_max * jnp.asarray(w, dtype)[:, None]
    slope = r * rho
    hz = 1.0 / jnp.sqrt(1.0 + slope * slope)
    hx, hy = slope * hz * px, slope * hz * py
    cos_d = x_o * hx + y_o * hy + mu * hz
    geometry = Geometry(
        wix=2.0 * cos_d * hx - x_o,
        wiy=2.0 * cos_d * hy - y_o,
        cos_i=2.0 * cos_d * hz - mu,
        wox=x_o, woy=y_o, cos_o=mu,
        hx=hx, hy=hy, hz=hz, cos_d=cos_d,
    )  # fmt: skip
    dwh = hz * hz * hz * (ax * ay) * r * dr * dphi
    return geometry, geometry.cos_i * 4.0 * cos_d * dwh


def over_axis(
    mu: Array, azimuth: Array, peak: AxisPeak, nodes: int
) -> tuple[Geometry, Array]:
    """Nodes ``(k, nodes, azimuths)`` around the axis of a peak, and ``cos_i dwi`` at each.

    With ``t`` the angle from the axis, ``tan(t / 2) = w tan(v) / 2`` with the width ``w =
    sqrt(2 / (exponent + 2))`` and Gauss-Legendre nodes in ``v``, up to a right angle or
    the horizon, which at the azimuth ``psi`` around an axis ``(s, 0, c)`` is at ``t =
    atan2(c, s cos(psi))``.
    """
    dtype = mu.dtype
    x_o, y_o = tangential(mu, azimuth)
    sine = jnp.sqrt((1.0 - mu) * (1.0 + mu))
    along, up = peak.c_xy * sine, peak.c_z * mu
    length = jnp.sqrt(along * along + up * up)
    s, c = along / length, up / length
    psi, dpsi = (jnp.asarray(a, dtype) for a in _quarters(nodes // 2, 2))
    horizon = jnp.arctan2(c, s * jnp.cos(psi))
    half = 0.5 * jnp.minimum(horizon, 0.5 * np.pi)
    width = 0.5 * jnp.sqrt(2.0 / (peak.exponent + 2.0))
    v_max = jnp.arctan2(jnp.sin(half), width * jnp.cos(half))
    x, w = unit_nodes(nodes)
    tangent = width * jnp.tan(v_max * jnp.asarray(x, dtype)[:, None])
    dt = 2.0 * (width + tangent * tangent / width) / (1.0 + tangent * tangent)
    dt = dt * v_max * jnp.asarray(w, dtype)[:, None]
    cos_t = (1.0 - tangent * tangent) / (1.0 + tangent * tangent)
    sin_t = 2.0 * tangent / (1.0 + tangent * tangent)
    across = cos_t * s + sin_t * jnp.cos(psi) * c
    aside = sin_t * jnp.sin(psi)
    z = jnp.maximum(cos_t * c - sin_t * jnp.cos(psi) * s, 0.0)
    ca, sa = jnp.cos(azimuth), jnp.sin(azimuth)
    geometry = from_components(
        across * ca - aside * sa, across * sa + aside * ca, z, x_o, y_o, mu
    )
    return geometry, 2.0 * z * sin_t * dt * dpsi


def over_source(mu: Array, azimuth: Array, nodes: int) -> tuple[Geometry, Array]:
    """Nodes ``(k, polar, azimuths)`` of the source, and ``cos_i dwi`` at each.

    Gauss-Legendre in the polar angle and the azimuth, in panels that end at the detector's
    polar angle and at quarter turns from it, where diffuse lobes have their kinks.
    """
    dtype = mu.dtype
    x_o, y_o = tangential(mu, azimuth)
    x, w = unit_nodes(nodes // 2)
    x, w = jnp.asarray(x, dtype)[:, None], jnp.asarray(w, dtype)[:, None]
    middle = jnp.arccos(mu)
    rest = 0.5 * np.pi - middle
    theta = jnp.concatenate([middle * x, middle + rest * x], axis=1)
    dtheta = jnp.concatenate([middle * w, rest * w], axis=1)

    phi, dphi = (jnp.asarray(a, dtype) for a in _quarters(nodes // 4, 4))
    sine, cosine = jnp.sin(theta), jnp.cos(theta)
    geometry = from_components(
        sine * jnp.cos(phi + azimuth), sine * jnp.sin(phi + azimuth), cosine,
        x_o, y_o, mu,
    )  # fmt: skip
    return geometry, cosine * sine * dtheta * dphi
