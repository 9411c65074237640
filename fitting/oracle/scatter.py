"""Scatter lobes of the distance from the mirror direction, as their papers print them."""

from __future__ import annotations

import mpmath as mp

from fitting.models.abc import HORIZON
from fitting.oracle.fresnel import dielectric_reflectance


def _from_mirror(t):
    """``|xy(wi) + xy(wo)|``: the half vector before normalisation is 2 cos_d long."""
    return 2 * mp.cos(t.theta_d) * mp.sin(t.theta_h)


def abg(s, t, o):
    """``A / (B + |beta - beta_0|^g)`` for ``b0 = A / B = 1``."""
    b = s["shoulder"] ** s["g"]
    return (b / (b + _from_mirror(t) ** s["g"]),)


def harvey_shack(s, t, o):
    """Harvey 1976; Rayleigh-Rice: a power spectrum of ``|beta - beta_0| / l``, and l^-4."""
    ratio = 550 / s["wavelength"] if o.get("spectral") else mp.mpf(1)
    at = _from_mirror(t) * ratio / s["shoulder"]
    return (ratio**4 * mp.sqrt(1 + at**2) ** s["slope"],)


def abc(s, t, o):
    """Low et al. 2012, microfacet; V-shaped grooves; cosines of at least 1e-6."""
    least = mp.mpf(HORIZON)
    ci, co = max(mp.cos(t.theta_i), least), max(mp.cos(t.theta_o), least)
    ch, cd = mp.cos(t.theta_h), mp.cos(t.theta_d)
    g = min(1, 2 * ch * ci / cd, 2 * ch * co / cd)
    d = (1 + s["b"] * (1 - ch)) ** -s["c"]
    return (d * g * dielectric_reflectance(t.theta_d, s["eta"]) / (mp.pi * ci * co),)


def abc_smooth(s, t, o):
    """Low et al. 2012, smooth surface; F at the half of ``xy(wi) - xy(wo)``."""
    apart = t.phi_i - t.phi_o
    si, so = mp.sin(t.theta_i), mp.sin(t.theta_o)
    distance2 = max(si**2 + so**2 - 2 * si * so * mp.cos(apart), mp.mpf(0))
    half = min(mp.sqrt(distance2) / 2, mp.mpf(1))
    f = dielectric_reflectance(mp.asin(half), s["eta"])
    return (f / (1 + s["b"] * _from_mirror(t) ** 2) ** s["c"],)
