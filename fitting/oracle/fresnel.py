"""Fresnel terms as basis functions: the lobe times what multiplies each coefficient."""

from __future__ import annotations

import mpmath as mp


def schlick(value, s, t):
    """Schlick 1994: ``F = f0 + (f90 - f0) (1 - cos)^5``, by f0 and f90."""
    q = (1 - mp.cos(t.theta_d)) ** 5
    return value * (1 - q), value * q


def dielectric_reflectance(theta, eta):
    """Fresnel by Snell's refracted angle."""
    inside = mp.asin(mp.sin(theta) / eta)
    c, ct = mp.cos(theta), mp.cos(inside)
    rs = (c - eta * ct) / (c + eta * ct)
    rp = (eta * c - ct) / (eta * c + ct)
    return (rs**2 + rp**2) / 2


def dielectric(value, s, t):
    return (value * dielectric_reflectance(t.theta_d, s["eta"]),)


def times(value, s, t, o):
    """A lobe times the Fresnel term that the options name."""
    return {"schlick": schlick, "dielectric": dielectric}[o["fresnel"]](value, s, t)
