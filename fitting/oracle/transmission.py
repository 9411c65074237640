"""Lobes that let light through, as their papers print them."""

from __future__ import annotations

import mpmath as mp

from fitting.oracle.facets import beckmann_smith, ggx_smith, inverse_a, slope2, widths
from fitting.oracle.fresnel import dielectric_amplitudes


def _cosines(t):
    """Both cosines, to the normal in front: that of light behind is negative."""
    return mp.cos(t.theta_i), mp.cos(t.theta_o)


def _passes(t):
    cos_i, cos_o = _cosines(t)
    return cos_i * cos_o < 0


def _sum(t):
    """Tangential part of ``wi + wo``, from the half vector."""
    length = 2 * mp.cos(t.theta_d) * mp.sin(t.theta_h)
    return length * mp.cos(t.phi_h), length * mp.sin(t.phi_h)


def lambert_transmission(s, t, o):
    if not _passes(t):
        return (mp.mpf(0),)
    if o["media"] and mp.cos(t.theta_i) < 0:
        return (1 / (mp.pi * s["eta"] ** 2),)
    return (1 / mp.pi,)


def _density(s, o, theta, phi):
    """Walter et al. 2007, eq. 25 and 33."""
    ax, ay, _ = widths(s)
    stretch = slope2(s, theta, phi)
    if o["distribution"] == "beckmann":
        return mp.exp(-stretch) / (mp.pi * ax * ay * mp.cos(theta) ** 4)
    return 1 / (mp.pi * ax * ay * mp.cos(theta) ** 4 * (1 + stretch) ** 2)


def _g1(s, o, theta, phi):
    smith = beckmann_smith if o["distribution"] == "beckmann" else ggx_smith
    return 1 / (1 + smith(inverse_a(s, theta, phi)))


def _near(theta):
    """The angle to the normal of the own side."""
    return min(theta, mp.pi - theta)


def _facets(s, t, o, theta_h, phi_h):
    """``D G1 G1 / (4 |cos_i cos_o|)``, of either side."""
    cos_i, cos_o = (abs(c) for c in _cosines(t))
    g2 = _g1(s, o, _near(t.theta_i), t.phi_i) * _g1(s, o, _near(t.theta_o), t.phi_o)
    return _density(s, o, theta_h, phi_h) * g2 / (4 * cos_i * cos_o)


def rough_dielectric(s, t, o):
    """Walter et al. 2007, eq. 20 and 21, by Snell's angles."""
    eta = s["eta"]
    cos_i, cos_o = _cosines(t)
    if not _passes(t):
        index = eta if cos_i > 0 else 1 / eta
        value = _facets(s, t, o, _near(t.theta_h), t.phi_h)
        rs, rp = dielectric_amplitudes(t.theta_d, index)
        return value * (abs(rs) ** 2 + abs(rp) ** 2) / 2, mp.mpf(0)
    down = cos_i > 0
    theta, phi = (t.theta_i, t.phi_i) if down else (t.theta_o, t.phi_o)
    sx, sy = _sum(t)
    front = mp.sin(theta) * mp.cos(phi), mp.sin(theta) * mp.sin(phi)
    # -(w_f + eta w_b) with w_b = sum - w_f.
    x = (eta - 1) * front[0] - eta * sx
    y = (eta - 1) * front[1] - eta * sy
    z = (eta - 1) * max(cos_i, cos_o) - eta * 2 * mp.cos(t.theta_d) * mp.cos(t.theta_h)
    length = mp.sqrt(x * x + y * y + z * z)
    between = 2 * mp.cos(t.theta_d) ** 2 - 1
    of_front, of_back = -(1 + eta * between) / length, (eta + between) / length
    if not (of_front > 0 and z > 0):
        return mp.mpf(0), mp.mpf(0)
    rs, rp = dielectric_amplitudes(mp.acos(min(of_front, mp.mpf(1))), eta)
    # The cosine behind is that of the printed half vector, not Snell's.
    through = 1 - (rs**2 + rp**2) / 2
    value = 4 * _facets(s, t, o, mp.atan2(mp.hypot(x, y), z), mp.atan2(y, x))
    factor = of_front * of_back * through / length**2
    return mp.mpf(0), value * factor * (eta**2 if down else 1)


def _plate(s, o, theta):
    """Reflectance and transmittance, by the geometric series of what comes out."""
    eta = s["eta"]
    cos_t = mp.sqrt(1 - (mp.sin(theta) / eta) ** 2)
    inside = mp.exp(-s["optical_depth"] / cos_t)
    faces = [abs(r) ** 2 for r in dielectric_amplitudes(theta, eta)]
    if o["polarisation"] == "mixed":
        faces = [sum(faces) / 2]
    r = t = mp.mpf(0)
    for f in faces:
        lost = 1 - f**2 * inside**2
        t += (1 - f) ** 2 * inside / lost
        r += f + f * (1 - f) ** 2 * inside**2 / lost
    return r / len(faces), t / len(faces)


def thin_slab(s, t, o):
    if not _passes(t):
        value = _facets(s, t, o, _near(t.theta_h), t.phi_h)
        return value * _plate(s, o, t.theta_d)[0], mp.mpf(0)
    sx, sy = _sum(t)
    sz = abs(mp.cos(t.theta_i)) + abs(mp.cos(t.theta_o))
    half = mp.sqrt(sx * sx + sy * sy + sz * sz) / 2
    own = {**s, "alpha": s["alpha_t"]} if o["two_widths"] else s
    value = _facets(own, t, o, mp.atan2(mp.hypot(sx, sy), sz), mp.atan2(sy, sx))
    return mp.mpf(0), value * _plate(s, o, mp.acos(min(half, mp.mpf(1))))[1]


def smooth_slab(s, t, o):
    sx, sy = _sum(t)
    kernel = mp.exp(-(sx**2 + sy**2) / s["width"] ** 2) / (mp.pi * s["width"] ** 2)
    cos_i, cos_o = _cosines(t)
    # 1 - |beta_i - beta_o|^2 / 4.
    cos2 = mp.cos(t.theta_d) ** 2 + (cos_i - cos_o) ** 2 / 4
    r, through = _plate(s, o, mp.acos(min(mp.sqrt(cos2), mp.mpf(1))))
    return (mp.mpf(0), kernel * through) if _passes(t) else (kernel * r, mp.mpf(0))
