"""Production models against their papers' formulas, quadrature and Mitsuba."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from evaluation import albedos, directions, of

from fitting.geometry import Geometry, PolarAngles, from_angles
from fitting.models.openpbr import passing

COMPONENTS = ("wix", "wiy", "cos_i", "wox", "woy", "cos_o")


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


DISNEY = {
    "metallic": 0.2, "subsurface": 0.3, "specular": 0.6, "roughness": 0.4,
    "sheen": 0.7, "clearcoat": 0.8, "clearcoat_gloss": 0.9,
}  # fmt: skip


def disney_of_the_course(g: Geometry, base: float, aniso: float, p: dict[str, float]):
    """The formulas of Burley's course notes on unit vectors along the axes, no tints."""
    light, view = (np.stack(np.broadcast_arrays(*v)) for v in (
        (g.wix, g.wiy, g.cos_i), (g.wox, g.woy, g.cos_o)
    ))  # fmt: skip
    half = light + view
    half = half / np.linalg.norm(half, axis=0)
    l_h = np.sum(light * half, axis=0)
    n_l, n_v, n_h = light[2], view[2], half[2]
    fl, fv, fh = (1 - n_l) ** 5, (1 - n_v) ** 5, (1 - l_h) ** 5

    def mix(a, b, x):
        return (1 - x) * a + x * b

    fd90 = 0.5 + 2 * l_h**2 * p["roughness"]
    fss90 = l_h**2 * p["roughness"]
    fd = mix(1, fd90, fl) * mix(1, fd90, fv)
    fss = mix(1, fss90, fl) * mix(1, fss90, fv)
    ss = 1.25 * (fss * (1 / (n_l + n_v) - 0.5) + 0.5)
    aspect = np.sqrt(1 - 0.9 * aniso)
    ax, ay = p["roughness"] ** 2 / aspect, p["roughness"] ** 2 * aspect
    ds = 1 / (np.pi * ax * ay * ((half[0] / ax) ** 2 + (half[1] / ay) ** 2 + n_h**2) ** 2)
    gs = 1.0
    for v in (light, view):
        gs = gs / (v[2] + np.sqrt((ax * v[0]) ** 2 + (ay * v[1]) ** 2 + v[2] ** 2))
    fs = mix(mix(0.08 * p["specular"], base, p["metallic"]), 1, fh)
    a2 = mix(0.1, 0.001, p["clearcoat_gloss"]) ** 2
    dr = (a2 - 1) / (np.pi * np.log(a2) * (1 + (a2 - 1) * n_h**2))
    fr = mix(0.04, 1, fh)
    b2 = 0.25**2
    gr = 1.0
    for c in (n_l, n_v):
        gr = gr / (c + np.sqrt(b2 + c**2 - b2 * c**2))
    body = mix(fd, ss, p["subsurface"]) * base / np.pi + fh * p["sheen"]
    return body * (1 - p["metallic"]) + gs * fs * ds + 0.25 * p["clearcoat"] * gr * fr * dr


@pytest.mark.parametrize("aniso", [0.0, 0.6])
@pytest.mark.parametrize("base", [0.0, 0.4, 1.0])
def test_disney_of_the_course_notes(base: float, aniso: float):
    g = directions()
    options, more = {}, {}
    if aniso:
        options, more = {"anisotropic": True}, {"anisotropic": aniso, "angle": 0.0}
    with_base, without = of("disney", g, options, **DISNEY, **more)
    expected = disney_of_the_course(g, base, aniso, DISNEY)
    np.testing.assert_allclose(base * with_base + without, expected, rtol=1e-10)


def test_disney_without_highlights_is_burley():
    g = directions()
    plain = dict.fromkeys(DISNEY, 0.0) | {"roughness": 0.6}
    burley = of("burley", g, roughness=0.6)[0]
    np.testing.assert_allclose(of("disney", g, **plain)[0], burley, rtol=1e-14)


@pytest.mark.parametrize("eta", [1.01, 2.5, 4.0])
@pytest.mark.parametrize("alpha", [0.01, 0.64])
def test_openpbr_passes_what_its_highlight_leaves(alpha: float, eta: float):
    mu = np.array([0.02, 0.1, 0.3, 0.6, 1.0])
    (e,) = albedos("ggx", mu, 128, {"fresnel": "dielectric"}, alpha=alpha, eta=eta)
    c = jnp.asarray(mu)
    found = passing(1 - c * c, c, jnp.asarray(alpha), jnp.asarray(eta))
    np.testing.assert_allclose(found, 1 - e, atol=1.8e-3 if eta <= 2.5 else 3.2e-3)


@pytest.mark.parametrize(("alpha", "reflected"), [(0.50364, 0.028031), (1.0, 0.012702)])
def test_openpbr_highlight_at_normal_incidence(alpha: float, reflected: float):
    """Single scattering of a rough interface, index 1.5, by 20-digit quadrature."""
    found = passing(*(jnp.asarray(v) for v in (0.0, 1.0, alpha, 1.5)))
    assert abs(1 - found - reflected) < 3e-4


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_white_openpbr_loses_no_energy(roughness: float):
    shape = {
        "base_metalness": 0.0, "base_diffuse_roughness": 0.6,
        "specular_roughness": roughness, "specular_ior": 1.5,
    }  # fmt: skip
    found = sum(albedos("openpbr", [0.05, 0.3, 0.7, 1.0], 128, **shape))
    np.testing.assert_allclose(found, 1.0, atol=2e-3)


def test_metallic_openpbr_is_ggx_and_plastic_one_is_not_reciprocal():
    g = directions()
    shape = {
        "base_metalness": 1.0, "base_diffuse_roughness": 0.6,
        "specular_roughness": 0.5, "specular_ior": 1.5,
    }  # fmt: skip
    by_base, by_multiple, rest = of("openpbr", g, **shape)
    f0, f90 = of("ggx", g, alpha=0.25)
    np.testing.assert_allclose(by_base, f0, rtol=1e-12)
    np.testing.assert_allclose(rest, f90, rtol=1e-12)
    np.testing.assert_array_equal(by_multiple, 0.0)
    plastic = {**shape, "base_metalness": 0.0}
    there, back = of("openpbr", g, **plastic)[0], of("openpbr", g.swapped, **plastic)[0]
    assert np.max(np.abs(there / back - 1)) > 0.1


def test_openpbr_by_a_table_of_angles_is_the_same():
    """The polar angles of a goniometer, evaluated once each."""
    theta = np.radians([0.0, 30.0, 60.0, 89.0])
    i, o = (m.ravel() for m in np.meshgrid(np.arange(4), np.arange(4), indexing="ij"))
    g = jax.tree.map(jnp.asarray, from_angles(theta[i], 0.1, theta[o], 2.0))
    table = PolarAngles(
        sine2=jnp.sin(theta) ** 2,
        cosine=jnp.cos(theta),
        index_i=jnp.asarray(i),
        index_o=jnp.asarray(o),
    )
    shape = {
        "base_metalness": 0.1, "base_diffuse_roughness": 0.6,
        "specular_roughness": 0.5, "specular_ior": 1.5,
    }  # fmt: skip
    plain = of("openpbr", g, **shape)
    tabled = of("openpbr", dataclasses.replace(g, polar=table), **shape)
    np.testing.assert_allclose(tabled, plain, rtol=1e-12)


@pytest.mark.parametrize("metal", [0.0, 0.4, 1.0])
def test_gltf_of_its_specification(metal: float):
    """The functions of appendix B and of KHR_materials_specular, on vectors."""
    g = directions()
    base, rough, ior, weight = 0.4, 0.5, 1.4, 0.7
    light, view = (np.stack(np.broadcast_arrays(*v)) for v in (
        (g.wix, g.wiy, g.cos_i), (g.wox, g.woy, g.cos_o)
    ))  # fmt: skip
    half = (light + view) / np.linalg.norm(light + view, axis=0)
    v_h, n_h, n_l, n_v = np.sum(view * half, axis=0), half[2], light[2], view[2]
    a2 = rough**4
    density = a2 / (np.pi * (n_h**2 * (a2 - 1) + 1) ** 2)
    visible = 0.5 / (
        n_l * np.sqrt(n_v**2 * (1 - a2) + a2) + n_v * np.sqrt(n_l**2 * (1 - a2) + a2)
    )
    layer, q = density * visible, (1 - v_h) ** 5
    f0 = min(((1 - ior) / (1 + ior)) ** 2, 1.0)
    fr = f0 + (1 - f0) * q
    dielectric = (1 - weight * fr) * base / np.pi + weight * fr * layer
    expected = (1 - metal) * dielectric + metal * layer * (base + (1 - base) * q)
    shape = {"metallic": metal, "roughness": rough, "ior": ior, "specular": weight}
    with_base, without = of("gltf", g, **shape)
    np.testing.assert_allclose(base * with_base + without, expected, rtol=1e-9)


def principled_of_mitsuba(g: Geometry, base: float, **parameters: float) -> np.ndarray:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    rgb = {"type": "rgb", "value": [base] * 3}
    bsdf = mi.load_dict({"type": "principled", "base_color": rgb, **parameters})
    at = mi.SurfaceInteraction3f()
    at.n = [0, 0, 1]
    at.sh_frame = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1])
    pairs = zip(*(np.asarray(getattr(g, n)) for n in COMPONENTS), strict=True)
    found = []
    for ix, iy, iz, ox, oy, oz in pairs:
        at.wi = [ix, iy, iz]
        found.append(bsdf.eval(mi.BSDFContext(), at, [ox, oy, oz])[0] / oz)
    return np.array(found)


DULL = dict.fromkeys(DISNEY, 0.0) | {"roughness": 0.4}


@pytest.mark.parametrize("aniso", [0.0, 0.6])
def test_metallic_disney_of_mitsuba(aniso: float):
    """Mitsuba computes in single precision."""
    g = directions(60, below_deg=80.0)
    options, more = {"anisotropic": True}, {"anisotropic": aniso, "angle": 0.0}
    shape = DULL | {"metallic": 1.0, **more}
    with_base, without = of("disney", g, options, **shape)
    found = principled_of_mitsuba(g, 0.7, metallic=1.0, roughness=0.4, anisotropic=aniso)
    np.testing.assert_allclose(0.7 * with_base + without, found, rtol=5e-6)


@pytest.mark.parametrize("flat", [0.0, 1.0])
def test_diffuse_disney_of_mitsuba(flat: float):
    """What the base colour adds; Mitsuba's highlight has the exact Fresnel reflectance."""
    g = directions(60, below_deg=80.0)
    white, black = (
        principled_of_mitsuba(g, c, roughness=0.4, flatness=flat) for c in (1, 0)
    )
    with_base, _ = of("disney", g, **DULL | {"subsurface": flat})
    np.testing.assert_allclose(with_base, white - black, rtol=5e-6)


def test_coated_disney_of_mitsuba():
    """Mitsuba's sheen is the same; its clear coat lacks ``1 / (4 cos_i cos_o)``."""
    g = directions(60, below_deg=80.0)
    rough = DULL | {"roughness": 1.0, "specular": 0.5}
    none = principled_of_mitsuba(g, 0.0, roughness=1.0)
    plain = of("disney", g, **rough)[1]
    sheen = of("disney", g, **rough | {"sheen": 1.0})[1] - plain
    found = principled_of_mitsuba(g, 0.0, roughness=1.0, sheen=1.0) - none
    np.testing.assert_allclose(sheen, found, rtol=1e-5, atol=1e-6)
    coat = of("disney", g, **rough | {"clearcoat": 1.0, "clearcoat_gloss": 0.3})[1] - plain
    found = principled_of_mitsuba(g, 0.0, roughness=1.0, clearcoat=1.0, clearcoat_gloss=0.3)
    np.testing.assert_allclose(coat * 4 * g.cos_i * g.cos_o, found - none, atol=2e-6)
