"""Production models, as their papers and specifications print them."""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np

from fitting.models.openpbr import NODES
from fitting.oracle import diffuse, facets, fresnel


def _mix(a, b, x):
    return a * (1 - x) + b * x


def _smith(width, theta):
    """``G1 / (2 cos)`` of GGX, with ``tan(theta)``."""
    g1 = 2 / (1 + mp.sqrt(1 + (width * mp.tan(theta)) ** 2))
    return g1 / (2 * mp.cos(theta))


def disney(s, t, o):
    """Burley 2012, section 5: by base colour, and the rest."""
    r, metal = s["roughness"], s["metallic"]
    ci, co = mp.cos(t.theta_i), mp.cos(t.theta_o)
    cd2 = mp.cos(t.theta_d) ** 2
    fi, fo, fh = ((1 - c) ** 5 for c in (ci, co, mp.cos(t.theta_d)))
    f90 = mp.mpf(1) / 2 + 2 * cd2 * r
    diffuse = _mix(1, f90, fi) * _mix(1, f90, fo)
    flat = _mix(1, cd2 * r, fi) * _mix(1, cd2 * r, fo)
    total = max(ci + co, mp.mpf("1e-6"))
    under = mp.mpf("1.25") * (flat * (1 / total - mp.mpf(1) / 2) + mp.mpf(1) / 2)

    aspect, angle = mp.mpf(1), mp.mpf(0)
    if "anisotropic" in s:
        aspect = mp.sqrt(1 - mp.mpf("0.9") * s["anisotropic"])
        angle = s["angle"]
    least = mp.mpf("0.001")
    ax, ay = max(least, r**2 / aspect), max(least, r**2 * aspect)

    def along(phi):
        return (ax * mp.cos(phi - angle)) ** 2 + (ay * mp.sin(phi - angle)) ** 2

    inverse = (mp.cos(t.phi_h - angle) / ax) ** 2 + (mp.sin(t.phi_h - angle) / ay) ** 2
    ch, sh = mp.cos(t.theta_h), mp.sin(t.theta_h)
    highlight = 1 / (mp.pi * ax * ay * (sh**2 * inverse + ch**2) ** 2)
    for theta, phi in ((t.theta_i, t.phi_i), (t.theta_o, t.phi_o)):
        highlight *= _smith(mp.sqrt(along(phi)), theta)

    a2 = _mix(mp.mpf("0.1"), mp.mpf("0.001"), s["clearcoat_gloss"]) ** 2
    coat = (a2 - 1) / (mp.pi * mp.log(a2) * (1 + (a2 - 1) * ch**2))
    quarter = mp.mpf(1) / 4
    coat *= _smith(quarter, t.theta_i) * _smith(quarter, t.theta_o)
    coat *= quarter * s["clearcoat"] * _mix(mp.mpf("0.04"), 1, fh)

    with_base = (1 - metal) * _mix(diffuse, under, s["subsurface"]) / mp.pi
    with_base += metal * (1 - fh) * highlight
    plain = mp.mpf("0.08") * s["specular"] * (1 - metal)
    without = (1 - metal) * s["sheen"] * fh + highlight * (plain * (1 - fh) + fh) + coat
    return with_base, without


@functools.cache
def _gauss(count):
    """The nodes and weights on [0, 1] that the model is defined with, as exact numbers."""
    x, w = np.polynomial.legendre.leggauss(count)
    return [
        (mp.mpf(float(a)), mp.mpf(float(b)))
        for a, b in zip(0.5 * (x + 1), w / 2, strict=True)
    ]


def _facet_loss(view, facet, alpha, eta):
    """``1 - F G2 / G1(o)`` of one facet, by tangents and Snell's law."""
    cosine = sum(a * b for a, b in zip(view, facet, strict=True))
    source = [2 * cosine * h - v for h, v in zip(facet, view, strict=True)]
    if source[2] <= 0:
        return mp.mpf(1)
    of_i, of_o = (
        (mp.sqrt(1 + alpha**2 * (x * x + y * y) / z**2) - 1) / 2
        for x, y, z in (source, view)
    )
    reflected = fresnel.dielectric_reflectance(mp.acos(min(cosine, mp.mpf(1))), eta)
    return 1 - reflected * (1 + of_o) / (1 + of_i + of_o)


@functools.lru_cache(4096)
def _passing(theta_o, alpha, eta):
    """``1 - E_spec`` as the model defines it: the same rule over the same cap."""
    view = (mp.sin(theta_o), mp.mpf(0), mp.cos(theta_o))
    length = mp.hypot(alpha * view[0], view[2])
    vx, vz = alpha * view[0] / length, view[2] / length
    end = mp.acos(-vz)
    turns = [(mp.cos(mp.pi * y), mp.sin(mp.pi * y), wy) for y, wy in _gauss(NODES[1])]
    total = mp.mpf(0)
    for x, wx in _gauss(NODES[0]):
        cos_c, sin_c = mp.cos_sin(end * x)
        for cos_y, sin_y, wy in turns:
            facet = (alpha * (sin_c * cos_y + vx), alpha * sin_c * sin_y, cos_c + vz)
            size = mp.sqrt(sum(h * h for h in facet))
            loss = _facet_loss(view, [h / size for h in facet], alpha, eta)
            total += wx * wy * end * sin_c / (1 + vz) * loss
    return total


def openpbr(s, t, o):
    """OpenPBR Surface 1.1: base colour, its multiple scattering, and the rest."""
    metal, eta = s["base_metalness"], s["specular_ior"]
    width = {"alpha": s["specular_roughness"] ** 2}
    plain = {"fresnel": "schlick", "shadowing": "correlated"}
    facing, rising = facets.ggx(width, t, plain)
    q = fresnel.dielectric_reflectance(t.theta_d, eta)
    rough = {"roughness": s["base_diffuse_roughness"]}
    single, multiple = 1 / mp.pi, mp.mpf(0)
    if rough["roughness"] > 0:  # the paper's form is 0 / 0 there
        single, multiple = diffuse.eon(rough, t, {})
    left = (1 - metal) * _passing(t.theta_o, width["alpha"], eta)
    return (
        left * single + metal * facing,
        left * multiple,
        (1 - metal) * q * (facing + rising) + metal * rising,
    )


def gltf(s, t, o):
    """glTF 2.0, appendix B, with KHR_materials_ior and KHR_materials_specular."""
    metal, weight, ior = s["metallic"], s["specular"], s["ior"]
    plain = {"fresnel": "schlick", "shadowing": "correlated"}
    facing, rising = facets.ggx({"alpha": s["roughness"] ** 2}, t, plain)
    q = (1 - mp.cos(t.theta_d)) ** 5
    f0 = ((1 - ior) / (1 + ior)) ** 2
    reflected = f0 + (1 - f0) * q
    layer = facing + rising
    with_base = (1 - metal) * (1 - weight * reflected) / mp.pi + metal * facing
    return with_base, (1 - metal) * weight * reflected * layer + metal * rising
