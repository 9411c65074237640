"""Radiometric quantities: solid angles, irradiance, reflected radiance, flux, intensity.

Radiance is in W/(m^2 sr), of a band or per wavelength alike; photometric quantities follow
the same formulas. theta is measured from the normal, in [0, pi]; a field of radiance counts
where theta < pi/2. Terms: ISO 80000-7:2019; geometry: Nicodemus et al. 1977 (NBS Monograph
160). numpy in, float64 out; JAX in, JAX out: all work under jit and grad.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from fitting.quadrature import unit_nodes

Array = Any
Field = Callable[[np.ndarray, np.ndarray], Array] | float
Bsdf = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], Array]
Convention = Literal["radiance", "importance"]

_Function = Callable[..., Array]
_FEWEST, _MOST = 16, 256
_POWER = {"radiance": 0, "importance": 2}


class Cone(NamedTuple):
    """A circular cone of directions: its axis and half-angle, in rad."""

    theta: float
    phi: float
    half_angle: float


HEMISPHERE = Cone(0.0, 0.0, math.pi)


class Integral(NamedTuple):
    """An integral, and how far that of half the nodes is; None: the nodes were given."""

    value: Array
    error: Array
    converged: bool | None


def solid_angle_of_cone(half_angle: ArrayLike) -> Array:
    """Solid angle in sr of a circular cone, ``4 pi sin^2(a/2)``, half-angle in rad.

    The same as ``2 pi (1 - cos a)``, without its cancellation (ISO 80000-3, item 3-8).
    """
    lib, a = _arrays(half_angle)
    return 4.0 * math.pi * lib.sin(0.5 * a) ** 2


def projected_solid_angle_of_hemisphere() -> float:
    """Integral of cos over the hemisphere: pi sr (Nicodemus et al. 1977)."""
    return math.pi


def projected_solid_angle_of_annulus(theta_1: ArrayLike, theta_2: ArrayLike) -> Array:
    """``pi (sin^2 theta_2 - sin^2 theta_1)`` in sr, between polar angles up to pi/2.

    As ``pi sin(theta_2 - theta_1) sin(theta_2 + theta_1)``, exact for narrow ones.
    """
    lib, a, b = _arrays(theta_1, theta_2)
    return math.pi * lib.sin(b - a) * lib.sin(b + a)


def projected_solid_angle_of_cone(theta: ArrayLike, half_angle: ArrayLike) -> Array:
    """Integral of cos over the part of a cone above the horizon, in sr; angles in rad.

    ``pi sin^2(a) cos(theta)`` where the cone does not cross the horizon, 0 below it. In
    general, with ``w^2 = max(0, -cos(theta + a) cos(theta - a))``, ``sin^2(a) cos(theta)
    atan2(w, -cos(a) cos(theta)) - w cos(a) + atan2(w, cos(a))``, theta and a in [0, pi]:
    pi times the view factor of a sphere (Lagarde and de Rousiers 2014, in half-angles).
    """
    lib, theta, a = _arrays(theta, half_angle)
    cos_t, cos_a, sin_a = lib.cos(theta), lib.cos(a), lib.sin(a)
    w2 = -lib.cos(theta + a) * lib.cos(theta - a)
    crosses = w2 > 0
    w = lib.where(crosses, lib.sqrt(lib.where(crosses, w2, 1.0)), 0.0)
    # atan2 has no derivative at (0, 0), where cone and horizon touch at a right angle.
    x = -cos_a * cos_t
    first = lib.arctan2(w, lib.where(crosses | (x != 0), x, 1.0))
    u = lib.arctan2(w, lib.where(crosses | (cos_a != 0), cos_a, 1.0))
    # u - w cos(a) = u - sin(u) cos(u) + cos^2(theta) sin(u) cos(u), as w = sin(theta)
    # sin(u): the terms of a small cone on the horizon are a^3 and have no larger ones.
    rest = 0.5 * _x_minus_sin(lib, 2.0 * u) + cos_t**2 * lib.sin(u) * lib.cos(u)
    return sin_a**2 * cos_t * first + rest


def _x_minus_sin(lib: Any, x: Array) -> Array:
    y = lib.where(x < 0.7, x, 0.0) ** 2
    series = 1.0
    for n in (210, 156, 110, 72, 42, 20):
        series = 1.0 - y / n * series
    return lib.where(x < 0.7, x * y / 6.0 * series, x - lib.sin(x))


def irradiance(
    radiance: Field,
    *, cone: Cone = HEMISPHERE, tolerance: float = 1e-8, nodes: int | None = None,
) -> Integral:  # fmt: skip
    """Irradiance ``E = int L cos(theta) dw`` in W/m^2 (ISO 80000-7, item 7-7.1).

    ``radiance(theta, phi)`` takes arrays ``(n,)`` in rad and returns ``(n,)`` or ``(n, c)``
    in W/(m^2 sr), a number is a uniform field; the integral is over the cone's part above
    the horizon. Gauss-Legendre nodes are doubled until the value moves by less than
    ``tolerance`` of the largest channel, or 256 per panel do not suffice; ``nodes`` fixes
    their number, for jit and grad. What falls between the first 16 needs a cone of its
    own. A uniform field gives ``pi L``, ``cos^n`` gives ``2 pi L / (n + 2)``.
    """
    return _integrate(_callable(radiance), cone, (), tolerance, nodes)


def irradiance_of_disk(
    radiance: ArrayLike, theta: ArrayLike, half_angle: ArrayLike
) -> Array:
    """``E = L Omega_p`` in W/m^2 of a uniform disk or sphere that fills a cone.

    ``pi L sin^2(a) cos(theta)`` where all of it is above the horizon; angles in rad.
    """
    return _arrays(radiance)[1] * projected_solid_angle_of_cone(theta, half_angle)


def irradiance_of_point_source(
    intensity: ArrayLike, distance: ArrayLike, theta: ArrayLike
) -> Array:
    """Inverse square law, ``E = I cos(theta) / d^2`` in W/m^2; 0 from below the horizon.

    Intensity in W/sr, distance in m, theta in rad (ISO 80000-7, items 7-5.1 and 7-7.1).
    """
    lib, i, d, theta = _arrays(intensity, distance, theta)
    return i * lib.maximum(lib.cos(theta), 0.0) / d**2


def radiant_exitance(
    radiance: Field, *, tolerance: float = 1e-8, nodes: int | None = None
) -> Integral:
    """``M = int L cos(theta) dw`` in W/m^2 of the radiance that leaves a surface.

    As `irradiance`; a Lambertian surface has ``pi L`` (ISO 80000-7, item 7-8.1).
    """
    return irradiance(radiance, tolerance=tolerance, nodes=nodes)


def radiant_intensity(radiance: ArrayLike, area: ArrayLike, theta: ArrayLike) -> Array:
    """``I = L A cos(theta)`` in W/sr of a flat Lambertian emitter; 0 behind it.

    Radiance in W/(m^2 sr), area in m^2, theta in rad (ISO 80000-7, item 7-5.1).
    """
    lib, value, area, theta = _arrays(radiance, area, theta)
    return value * area * lib.maximum(lib.cos(theta), 0.0)


def flux(irradiance: ArrayLike, area: ArrayLike) -> Array:
    """``Phi = E A`` in W through a flat, even area in m^2 (ISO 80000-7, item 7-4.1)."""
    _, per_area, m2 = _arrays(irradiance, area)
    return per_area * m2


def flux_through_cone(
    radiance: Field, area: float, theta: float, phi: float, half_angle: float,
    *, tolerance: float = 1e-8, nodes: int | None = None,
) -> Integral:  # fmt: skip
    """Flux in W from a flat element of ``area`` m^2 into a cone, ``A int L cos dw``.

    Arguments as of `irradiance`. With uniform radiance it is
    ``flux(irradiance_of_disk(L, theta, half_angle), area)``.
    """
    cone = Cone(theta, phi, half_angle)
    found = _integrate(_callable(radiance), cone, (), tolerance, nodes)
    return Integral(area * found.value, area * found.error, found.converged)


def reflected_radiance(
    bsdf: Bsdf, incident_radiance: Field, theta_r: float, phi_r: float,
    *, cone: Cone | None = None, tolerance: float = 1e-6, nodes: int | None = None,
) -> Integral:  # fmt: skip
    """``L_r = int f L_i cos(theta_i) dw_i`` in W/(m^2 sr), ``(c,)``, as of a BSDF in 1/sr.

    ``bsdf(theta_i, phi_i, theta_r, phi_r)`` takes arrays ``(n,)`` in rad and returns
    ``(n, c)`` or ``(n,)`` without cosine; the rest is as of `irradiance`. A disk source is
    a number in a cone. theta_r beyond pi/2 is transmitted light. Nicodemus et al. 1977,
    from the definition of the BRDF.
    """
    incoming = _callable(incident_radiance)

    def integrand(theta: np.ndarray, phi: np.ndarray) -> Array:
        there = np.full(theta.shape, theta_r), np.full(theta.shape, phi_r)
        f, incident = bsdf(theta, phi, *there), incoming(theta, phi)
        return f.reshape(theta.size, -1) * incident.reshape(theta.size, -1)

    # Nodes are densest where panels end: at the azimuth of wo, opposite to it, at theta_r.
    whole, rings = cone or Cone(0.0, phi_r, math.pi), (min(theta_r, math.pi - theta_r),)
    return _integrate(integrand, whole, rings, tolerance, nodes)


def reflected_radiance_of_beam(
    bsdf: Bsdf, normal_irradiance: ArrayLike, theta_i: ArrayLike, phi_i: ArrayLike,
    theta_r: ArrayLike, phi_r: ArrayLike,
) -> Array:  # fmt: skip
    """``L_r = f E_n cos(theta_i)`` in W/(m^2 sr), ``(n, c)``, of a collimated beam.

    ``normal_irradiance`` in W/m^2 across the beam: a number, ``(n, 1)`` or ``(n, c)``.
    Angles in rad, numbers or ``(n,)``; the beam may come from either side.
    """
    lib, *angles = _arrays(theta_i, phi_i, theta_r, phi_r)
    angles = [lib.atleast_1d(a) for a in lib.broadcast_arrays(*angles)]
    f, cosine = bsdf(*angles), abs(lib.cos(angles[0]))
    return f * _arrays(normal_irradiance)[1] * cosine.reshape(-1, *[1] * (f.ndim - 1))


def basic_radiance(radiance: ArrayLike, eta: ArrayLike) -> Array:
    """``L / eta^2``, which no lossless interface changes (Nicodemus et al. 1977)."""
    _, value, n = _arrays(radiance, eta)
    return value / n**2


def bsdf_for_other_convention(
    value: ArrayLike, eta_i: ArrayLike, eta_o: ArrayLike,
    *, given: Convention, wanted: Convention,
) -> Array:  # fmt: skip
    """A BSDF for radiance as one for basic radiance, or back; 1/sr.

    ``eta_i, eta_o`` are the indices on the side of the source (wi) and of the detector
    (wo). ``radiance``: ``f = dL_o / dE_i``, as measured in both media and as in Walter et
    al. 2007, eq. 21, has ``f(wi, wo) / eta_o^2 = f(wo, wi) / eta_i^2``. With ``L / eta^2``
    for both radiances, ``importance``: ``f eta_i^2 / eta_o^2 = f(wo, wi)``, the adjoint
    (Veach 1997, section 5.2). The integral of ``f cos_o`` over wo, the transmittance, is
    at most 1; that of ``f cos_i`` over wi is so only for basic radiance.

    pbrt 4 and Mitsuba 3 evaluate ``f`` in TransportMode::Radiance, their default, with
    wo (pbrt) or wi (Mitsuba) towards the camera, and the other in TransportMode::
    Importance. Reflection has both indices equal, and no difference.
    """
    _, f, n_i, n_o = _arrays(value, eta_i, eta_o)
    return f * (n_i / n_o) ** (_POWER[wanted] - _POWER[given])


def _callable(radiance: Field) -> _Function:
    return radiance if callable(radiance) else lambda t, _: np.full(t.shape, radiance)


def _integrate(
    field: _Function, cone: Cone, breaks: tuple[float, ...],
    tolerance: float, nodes: int | None,
) -> Integral:  # fmt: skip
    if nodes is not None:
        fine = _sum(field, cone, breaks, nodes)
        return Integral(fine, abs(fine - _sum(field, cone, breaks, nodes // 2)), None)
    count, fine, error = _FEWEST, _sum(field, cone, breaks, _FEWEST), np.inf
    while count < _MOST:
        count, coarse = 2 * count, fine
        fine = _sum(field, cone, breaks, count)
        error = abs(fine - coarse)
        if np.max(error) <= tolerance * np.max(np.abs(fine)):
            return Integral(fine, error, True)
    return Integral(fine, error, False)


def _sum(field: _Function, cone: Cone, breaks: tuple[float, ...], count: int) -> Array:
    """The integral of ``field cos dw`` by nodes in rings around the normal.

    At polar angle t the cone spans azimuths of ``+/- d``, ``cos(d) = (cos(a) - cos(theta)
    cos(t)) / (sin(theta) sin(t))``: a square root where it begins, ends or closes to a
    circle. There panels end, and ``t ~ sin^2(x)`` takes the root away.
    """
    x, w = unit_nodes(count)
    theta, a = cone.theta, cone.half_angle
    low, high = np.clip((theta - a, theta + a), 0.0, 0.5 * np.pi)
    ends = (low, high, abs(theta - a), 2.0 * np.pi - theta - a, *breaks)
    edges = np.unique(np.clip(ends, low, high))
    step = np.diff(edges)[:, None]
    t = (edges[:-1, None] + step * np.sin(0.5 * np.pi * x) ** 2).reshape(-1, 1)
    dt = (step * 0.5 * np.pi * np.sin(np.pi * x) * w).reshape(-1, 1)
    inside = np.sin(0.5 * (a + theta - t)) * np.sin(0.5 * (a - theta + t))
    outside = np.sin(0.5 * (theta + t + a)) * np.sin(0.5 * (theta + t - a))
    reach = 2 * np.arctan2(*(np.sqrt(np.maximum(v, 0.0)) for v in (inside, outside)))
    phi = cone.phi + reach * np.concatenate([-x[::-1], x])
    weights = (np.sin(t) * np.cos(t) * dt * reach * np.concatenate([w[::-1], w])).ravel()
    values = field(np.broadcast_to(t, phi.shape).ravel(), phi.ravel())
    if isinstance(values, jax.Array):
        return jnp.asarray(weights, values.dtype) @ values
    return weights @ values


def _arrays(*values: ArrayLike) -> tuple[Any, ...]:
    """numpy or, if one of the values is JAX's, ``jax.numpy``, and its arrays."""
    theirs = [v for v in values if isinstance(v, jax.Array)]
    if not theirs:
        return np, *(np.asarray(v, dtype=np.float64) for v in values)
    dtype = jnp.result_type(*theirs, float)
    return jnp, *(jnp.asarray(v, dtype) for v in values)
