"""Nodes for the hemispherical integral of light that facets refract."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry, from_components
from fitting.models.lobe import SlopeWidths
from fitting.quadrature import tangential, unit_nodes


def over_refraction(
    mu: Array,
    azimuth: Array,
    widths: SlopeWidths,
    eta: Array,
    nodes: int,
    *,
    to_dense: bool,
    full_circle: bool = False,
) -> tuple[Geometry, Array]:
    """Nodes ``(k, nodes, azimuths)`` of the facets, and ``|cos_o| dwo`` at each.

    The source is in front at the cosine ``mu``, the detector behind, where the index is
    ``eta > 1`` times that in front, or with ``to_dense`` false ``1 / eta``. Facets see
    the light and do not reflect it totally where ``wi.h > sqrt(1 - (n_o / n_i)^2)`` (or 0):
    along each azimuth an interval of the slope, the roots of a quadratic. Gauss-Legendre
    nodes crowd at both ends of it, where the transmittance goes like a root. The measure is
    ``dwo = (wi.h - n |wo.h|)^2 / (n^2 |wo.h|) dwh`` (Walter et al. 2007, eq. 17).
    """
    dtype = mu.dtype
    n = eta if to_dense else 1.0 / eta
    x_i, y_i = tangential(mu, azimuth)
    ax, ay, angle = widths
    ca, sa = jnp.cos(angle), jnp.sin(angle)
    # The least cosine at a facet, squared.
    least2 = jnp.zeros_like(mu) if to_dense else jnp.broadcast_to(1.0 - n * n, mu.shape)
    phi, dphi = _azimuths(mu, ax, ay, least2, nodes, full_circle)
    start_x, start_y = ax * jnp.cos(azimuth - angle), ay * jnp.sin(azimuth - angle)
    start = jnp.sqrt(start_x * start_x + start_y * start_y)
    c, s = jnp.cos(phi), jnp.sin(phi)
    ux = ax * (c * start_x - s * start_y) / start
    uy = ay * (s * start_x + c * start_y) / start
    rho = jnp.sqrt(ux * ux + uy * uy)
    px, py = (ca * ux - sa * uy) / rho, (sa * ux + ca * uy) / rho
    p = x_i * px + y_i * py

    low, high = _interval(p, mu, least2)
    v0, v1 = jnp.arctan(low / rho), jnp.arctan2(high[0], high[1] * rho)
    span = jnp.maximum(v1 - v0, 0.0)
    x, w = unit_nodes(nodes)
    # 3 x^2 - 2 x^3: the ends are approached like a square.
    share = jnp.asarray(x * x * (3.0 - 2.0 * x), dtype)[:, None]
    dshare = jnp.asarray(6.0 * x * (1.0 - x) * w, dtype)[:, None]
    r = jnp.tan(v0 + span * share)
    dr = (1.0 + r * r) * span * dshare
    slope = r * rho
    hz = 1.0 / jnp.sqrt(1.0 + slope * slope)
    hx, hy = slope * hz * px, slope * hz * py
    i = x_i * hx + y_i * hy + mu * hz
    o2 = 1.0 - (1.0 - i) * (1.0 + i) / (n * n)
    passes = (o2 > 0) & (i > 0)
    o = jnp.sqrt(jnp.where(passes, o2, 1.0))
    turn = i / n - o
    z = turn * hz - mu / n
    passes &= z < 0
    geometry = from_components(
        jnp.broadcast_to(x_i, z.shape),
        jnp.broadcast_to(y_i, z.shape),
        jnp.broadcast_to(mu, z.shape),
        turn * hx - x_i / n,
        turn * hy - y_i / n,
        jnp.where(passes, z, 1.0),
    )
    dwh = hz * hz * hz * (ax * ay) * r * dr * dphi
    dwo = (i - n * o) ** 2 / (n * n * o) * dwh
    return geometry, jnp.where(passes, -z * dwo, 0.0)


def _interval(p: Array, mu: Array, least2: Array) -> tuple[Array, tuple[Array, Array]]:
    """Slopes ``t`` with ``p t + mu > c sqrt(1 + t^2)``, ``c^2 = least2``.

    The first one, and the last as numerator and denominator, 0 if there is no end. An
    empty interval has both at 0.
    """
    a, b, c = p * p - least2, p * mu, mu * mu - least2
    below = least2 * (p * p + mu * mu - least2)
    root = jnp.sqrt(jnp.where(below > 0, below, 1.0))
    root = jnp.where(below > 0, root, 0.0)
    inside = c > 0
    enters = ~inside & (b > 0) & (below > 0)
    starts = jnp.where(enters, -c / jnp.where(enters, b + root, 1.0), 0.0)
    # Seen from inside: c / (root - b). From outside: (b + root) / -a.
    top = jnp.where(inside, jnp.where(root > b, c, 1.0), jnp.where(a < 0, b + root, 1.0))
    bottom = jnp.where(
        inside, jnp.where(root > b, root - b, 0.0), jnp.where(a < 0, -a, 0.0)
    )
    nothing = ~(inside | enters)
    return (
        starts,
        (jnp.where(nothing, 0.0, top), jnp.where(nothing, 1.0, bottom)),
    )


def _azimuths(
    mu: Array, ax: Array, ay: Array, least2: Array, nodes: int, full_circle: bool
) -> tuple[Array, Array]:
    """Azimuths of the facets from that of the source, and weights.

    Where only tilted facets let light through, those towards the source do: for round
    facets up to an angle that is known.
    """
    x, w = (jnp.asarray(a, mu.dtype) for a in unit_nodes(nodes))
    if full_circle:
        quarter = 0.5 * np.pi
        turns = jnp.concatenate([quarter * (k + x) for k in range(4)])
        return turns, quarter * jnp.tile(w, 4)
    sine2 = (1.0 - mu) * (1.0 + mu)
    outside = (least2 > mu * mu) & (sine2 > 0)
    cosine2 = (least2 - mu * mu) / jnp.where(outside, sine2, 1.0)
    cosine = jnp.sqrt(jnp.where(outside, cosine2, 0.25))
    end = jnp.where(outside, jnp.arccos(cosine), np.pi)
    share = x * x * (3.0 - 2.0 * x)
    return end * share, 2.0 * end * 6.0 * x * (1.0 - x) * w
