"""Broad lobes, as their papers print them."""

from __future__ import annotations

import mpmath as mp


def lambert(s, t, o):
    return (1 / mp.pi,)


def oren_nayar(s, t, o):
    """Oren and Nayar 1994, qualitative model."""
    v = s["sigma"] ** 2
    a = 1 - v / (v + mp.mpf("0.33")) / 2
    b = mp.mpf("0.45") * v / (v + mp.mpf("0.09"))
    alpha, beta = max(t.theta_i, t.theta_o), min(t.theta_i, t.theta_o)
    cosine = max(mp.mpf(0), mp.cos(t.phi_i - t.phi_o))
    return ((a + b * cosine * mp.sin(alpha) * mp.tan(beta)) / mp.pi,)


def eon_albedo(r, theta):
    """``E_F(mu)`` of Portsmouth, Kutz and Hill 2025."""
    s, c = mp.sin(theta), mp.cos(theta)
    g = s * (theta - s * c) + 2 * (s / c * (1 - s**3) - s) / 3
    return (1 + r * g / mp.pi) / (1 + (mp.mpf(1) / 2 - 2 / (3 * mp.pi)) * r)


def eon(s, t, o):
    """Portsmouth, Kutz and Hill 2025; single and multiple scattering."""
    r = s["roughness"]
    a = 1 / (1 + (mp.mpf(1) / 2 - 2 / (3 * mp.pi)) * r)
    mean = a * (1 + (mp.mpf(2) / 3 - 28 / (15 * mp.pi)) * r)
    facing = mp.sin(t.theta_i) * mp.sin(t.theta_o) * mp.cos(t.phi_i - t.phi_o)
    below = max(mp.cos(t.theta_i), mp.cos(t.theta_o)) if facing > 0 else mp.mpf(1)
    single = a / mp.pi * (1 + r * facing / below)
    missing = (1 - eon_albedo(r, t.theta_i)) * (1 - eon_albedo(r, t.theta_o))
    return single, missing / (mp.pi * (1 - mean))
