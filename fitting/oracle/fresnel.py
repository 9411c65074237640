"""Fresnel terms as basis functions: the lobe times what multiplies each coefficient."""

from __future__ import annotations

import mpmath as mp


def schlick(value, s, t):
    """Schlick 1994: ``F = f0 + (f90 - f0) (1 - cos)^5``, by f0 and f90."""
    q = (1 - mp.cos(t.theta_d)) ** 5
    return value * (1 - q), value * q


def dielectric_amplitudes(theta, eta):
    """Fresnel by Snell's refracted angle, complex where all is reflected: s and p."""
    inside = mp.asin(mp.sin(theta) / eta)
    c, ct = mp.cos(theta), mp.cos(inside)
    return (c - eta * ct) / (c + eta * ct), (eta * c - ct) / (eta * c + ct)


def dielectric_reflectance(theta, eta):
    """Of unpolarised light."""
    rs, rp = dielectric_amplitudes(theta, eta)
    return (rs**2 + rp**2) / 2


def dielectric(value, s, t):
    return (value * dielectric_reflectance(t.theta_d, s["eta"]),)


def conductor_reflectance(theta, eta, k):
    """Fresnel with a complex index, by Snell's refracted cosine."""
    n = mp.mpc(eta, k)
    c = mp.cos(theta)
    ct = mp.sqrt(1 - (mp.sin(theta) / n) ** 2)
    rs = (c - n * ct) / (c + n * ct)
    rp = (n * c - ct) / (n * c + ct)
    return (abs(rs) ** 2 + abs(rp) ** 2) / 2


def conductor(value, s, t):
    return (value * conductor_reflectance(t.theta_d, s["eta"], s["k"]),)


def generalised(value, s, t):
    """Schlick with a free exponent."""
    q = (1 - mp.cos(t.theta_d)) ** s["power"]
    return value * (1 - q), value * q


def f82(value, s, t):
    """Kutz, Hasan and Edmondson 2021: what multiplies f0, f90 and minus the dip."""
    c, dip = mp.cos(t.theta_d), mp.mpf(1) / 7
    return (*schlick(value, s, t), value * c * (1 - c) ** 6 / (dip * (1 - dip) ** 6))


KINDS = {
    "schlick": schlick,
    "dielectric": dielectric,
    "conductor": conductor,
    "f82": f82,
    "generalised": generalised,
}


def times(value, s, t, o):
    """A lobe times the Fresnel term that the options name."""
    return KINDS[o["fresnel"]](value, s, t)
