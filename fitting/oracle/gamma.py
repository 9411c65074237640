"""The shifted-gamma lobe, as its paper prints it."""

from __future__ import annotations

import mpmath as mp


def sgd(s, t, o):
    """Bagher, Soler and Holzschuch 2012, with its ``K_AP, c`` from our parameters.

    By the coefficients of ``ks F = f90 q + f0 (1 - q) + f1 (1 - cos_d - q)``, with the
    paper's ``K_AP``, and its ``c`` such that ``G1`` is 0 at the horizon.
    """
    alpha, p, k = s["alpha"], s["p"], s["k"]
    normaliser = 1 / (alpha * mp.gammainc(1 - p, alpha))
    ax = alpha + mp.tan(t.theta_h) ** 2 / alpha
    d = normaliser * mp.exp(-ax) / (mp.pi * ax**p * mp.cos(t.theta_h) ** 4)
    c = mp.log(1 + 1 / s["lambda"]) / (mp.pi / 2 - s["theta0"]) ** k
    for theta in (t.theta_i, t.theta_o):
        past = max(mp.mpf(0), theta - s["theta0"])
        d *= (1 + s["lambda"] * (1 - mp.exp(c * past**k))) / mp.cos(theta)
    value = d / mp.pi
    q = (1 - mp.cos(t.theta_d)) ** 5
    return value * (1 - q), value * q, value * (1 - mp.cos(t.theta_d) - q)
