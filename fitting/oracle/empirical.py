"""Empirical lobes and simple diffuse bases, as their papers print them."""

from __future__ import annotations

import mpmath as mp

from fitting.oracle import fresnel


def _cosine_lobe(c_xy, c_z, n, t):
    across = mp.sin(t.theta_i) * mp.sin(t.theta_o) * mp.cos(t.phi_i - t.phi_o)
    cosine = c_xy * across + c_z * mp.cos(t.theta_i) * mp.cos(t.theta_o)
    return (n + 2) / (2 * mp.pi) * (cosine**n if cosine > 0 else mp.mpf(0))


def phong(s, t, o):
    """Lafortune and Willems 1994."""
    return (_cosine_lobe(-1, 1, s["exponent"], t),)


def lafortune(s, t, o):
    """Lafortune et al. 1997, eq. 8, with the normalisation of Ngan et al. 2005."""
    c_xy, n = s["c_xy"], s["exponent"]
    return (_cosine_lobe(c_xy, 1, n, t) / max(abs(c_xy), mp.mpf(1)) ** n,)


def ashikhmin_shirley(s, t, o):
    """Ashikhmin and Shirley 2000, eq. 4, with cosines of at least 1e-6 below."""
    floor = mp.mpf("1e-6")
    if "exponent" in s:
        nu = nv = s["exponent"]
        phi = mp.mpf(0)
    else:
        nu, nv, phi = s["exponent_u"], s["exponent_v"], t.phi_h - s["angle"]
    exponent = nu * mp.cos(phi) ** 2 + nv * mp.sin(phi) ** 2
    larger = max(mp.cos(t.theta_i), mp.cos(t.theta_o), floor)
    below = 8 * mp.pi * max(mp.cos(t.theta_d), floor) * larger
    value = mp.sqrt((nu + 1) * (nv + 1)) * mp.cos(t.theta_h) ** exponent / below
    return fresnel.times(value, s, t, o)


def ashikhmin_shirley_diffuse(s, t, o):
    """Ashikhmin and Shirley 2000, eq. 5, without Rd (1 - Rs)."""
    i, e = (1 - (1 - mp.cos(theta) / 2) ** 5 for theta in (t.theta_i, t.theta_o))
    return (28 / (23 * mp.pi) * i * e,)


def minnaert(s, t, o):
    """Minnaert 1941, with cosines of at least 1e-6."""
    k, floor = s["k"], mp.mpf("1e-6")
    both = max(mp.cos(t.theta_i), floor) * max(mp.cos(t.theta_o), floor)
    return ((k + 1) / (2 * mp.pi) * both ** (k - 1),)


def burley(s, t, o):
    """Burley 2012, section 5.3."""
    f90 = mp.mpf("0.5") + 2 * s["roughness"] * mp.cos(t.theta_d) ** 2
    i, e = (1 + (f90 - 1) * (1 - mp.cos(a)) ** 5 for a in (t.theta_i, t.theta_o))
    return (i * e / mp.pi,)


def interfaced_lambert(s, t, o):
    """The body's factor of the amplitude rho / (1 - rho K)."""
    eta = s["eta"]
    i, e = (1 - fresnel.dielectric_reflectance(a, eta) for a in (t.theta_i, t.theta_o))
    return (i * e / (mp.pi * eta**2),)
