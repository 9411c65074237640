"""Lobes of land surfaces and planets, as their papers print them."""

from __future__ import annotations

import mpmath as mp

from fitting.models.rtls import HORIZON


def _raised(theta):
    """A cosine of at least 1e-6."""
    return max(mp.cos(theta), mp.mpf(HORIZON))


def _cos_phase(t):
    apart = mp.cos(t.phi_i - t.phi_o)
    along = mp.sin(t.theta_i) * mp.sin(t.theta_o) * apart
    return along + mp.cos(t.theta_i) * mp.cos(t.theta_o)


def rtls(s, t, o):
    """Lucht et al. 2000, eq. 38 to 44; K_geo over cosines of at least 1e-6."""
    ci, co = mp.cos(t.theta_i), mp.cos(t.theta_o)
    ti, to = mp.tan(t.theta_i), mp.tan(t.theta_o)
    apart = t.phi_i - t.phi_o
    cos_xi = max(min(_cos_phase(t), mp.mpf(1)), -mp.mpf(1))
    xi = mp.acos(cos_xi)
    k_vol = ((mp.pi / 2 - xi) * cos_xi + mp.sin(xi)) / (ci + co) - mp.pi / 4
    square = ti**2 + to**2 - 2 * ti * to * mp.cos(apart) + (ti * to * mp.sin(apart)) ** 2
    both = 1 / ci + 1 / co
    tt = mp.acos(min(mp.mpf(1), 2 * mp.sqrt(max(square, mp.mpf(0))) / both))
    overlap = (tt - mp.sin(tt) * mp.cos(tt)) * both / mp.pi
    k_geo = overlap - both + (1 + cos_xi) / (2 * ci * co)
    k_geo *= ci * co / (_raised(t.theta_i) * _raised(t.theta_o))
    return 1 / mp.pi, k_vol / mp.pi, k_geo / mp.pi


def rpv(s, t, o):
    """Rahman et al. 1993; the power of cosines of at least 1e-6."""
    ci, co = _raised(t.theta_i), _raised(t.theta_o)
    bowl = (ci * co * (ci + co)) ** (s["k"] - 1)
    g = s["g"]
    henyey = (1 - g**2) / (1 + g**2 + 2 * g * _cos_phase(t)) ** mp.mpf("1.5")
    ti, to = mp.tan(t.theta_i), mp.tan(t.theta_o)
    square = ti**2 + to**2 - 2 * ti * to * mp.cos(t.phi_i - t.phi_o)
    hot = 1 + (1 - s["rho_c"]) / (1 + mp.sqrt(max(square, mp.mpf(0))))
    return (bowl * henyey * hot / mp.pi,)


def _hapke_h(w, x):
    root = mp.sqrt(1 - w)
    r0 = (1 - root) / (1 + root)
    return 1 / (1 - w * x * (r0 + (1 - 2 * r0 * x) / 2 * mp.log((1 + x) / x)))


def hapke(s, t, o):
    """Hapke 2012 without porosity; roughness of Hapke 1984, in its two cases."""
    w, b, c, tan_bar = s["w"], s["b"], s["c"], mp.tan(s["theta_bar"])
    i, e = t.theta_i, t.theta_o
    psi = mp.acos(mp.cos(t.phi_i - t.phi_o))
    chi = 1 / mp.sqrt(1 + mp.pi * tan_bar**2)

    def e1(x):
        return mp.exp(-2 / (mp.pi * tan_bar * mp.tan(x))) if x > 0 else mp.mpf(0)

    def e2(x):
        return mp.exp(-1 / (mp.pi * (tan_bar * mp.tan(x)) ** 2)) if x > 0 else mp.mpf(0)

    def eta(x):
        return chi * (mp.cos(x) + mp.sin(x) * tan_bar * e2(x) / (2 - e1(x)))

    half2 = mp.sin(psi / 2) ** 2
    if i <= e:
        d = 2 - e1(e) - psi / mp.pi * e1(i)
        up_i = mp.cos(psi) * e2(e) + half2 * e2(i)
        up_e = e2(e) - half2 * e2(i)
        last = mp.cos(i) / eta(i)
    else:
        d = 2 - e1(i) - psi / mp.pi * e1(e)
        up_i = e2(i) - half2 * e2(e)
        up_e = mp.cos(psi) * e2(i) + half2 * e2(e)
        last = mp.cos(e) / eta(e)
    mu_i = chi * (mp.cos(i) + mp.sin(i) * tan_bar * up_i / d)
    mu_e = chi * (mp.cos(e) + mp.sin(e) * tan_bar * up_e / d)
    # The last digit of psi = pi may make its tangent negative.
    f = mp.exp(-2 * abs(mp.tan(psi / 2)))
    shadow = mu_e / eta(e) * mp.cos(i) / eta(i) * chi / (1 - f + f * chi * last)

    cos_g = max(min(_cos_phase(t), mp.mpf(1)), -mp.mpf(1))
    forward = (1 - b**2) / (1 + 2 * b * cos_g + b**2) ** mp.mpf("1.5")
    back = (1 - b**2) / (1 - 2 * b * cos_g + b**2) ** mp.mpf("1.5")
    surge = s["b0"] / (1 + mp.tan(mp.acos(cos_g) / 2) / s["h"])
    single = ((1 - c) * forward + c * back) * (1 + surge)
    many = _hapke_h(w, mu_i) * _hapke_h(w, mu_e) - 1
    geometric = mu_i / (mu_i + mu_e) * shadow / mp.cos(i)
    return (w / (4 * mp.pi) * geometric * (single + many),)
