"""Our lobes against Mitsuba 3, another program's answer to the same formulas.

Mitsuba computes in float32 and its ``eval`` includes the cosine of the second direction,
which is divided out here. Both get the same directions, rounded to float32. Its Smith terms
are separable, our option ``uncorrelated``; where its formula is another than ours on
purpose, the test says so and puts one in place of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import erf

from fitting.geometry import from_components
from fitting.model import Model
from fitting.models.fresnel import dielectric_terms
from fitting.models.slab import reflected_and_transmitted

SETS, PAIRS = 400, 50
Vectors = np.ndarray
Values = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def mitsuba() -> Iterator[ModuleType]:
    module = pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
    before = module.variant()
    module.set_variant("scalar_rgb")
    yield module
    if before:
        module.set_variant(before)


def directions(rng: np.random.Generator, alpha_x, alpha_y) -> tuple[Vectors, Vectors]:
    """Pairs ``(sets, pairs, 3)`` above 3 degrees, half of them within the highlight."""

    def anywhere() -> Vectors:
        z, phi = rng.uniform(0.05, 1.0, (SETS, PAIRS)), rng.uniform(0, 7, (SETS, PAIRS))
        sine = np.sqrt(1 - z * z)
        return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=-1)

    wi, elsewhere = anywhere(), anywhere()
    share, phi = rng.uniform(0, 0.9, (SETS, PAIRS)), rng.uniform(0, 7, (SETS, PAIRS))
    slope = np.sqrt(share / (1 - share))
    x, y = slope * alpha_x[:, None] * np.cos(phi), slope * alpha_y[:, None] * np.sin(phi)
    h = np.stack([x, y, np.ones_like(x)], axis=-1)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    wo = 2 * np.sum(wi * h, axis=-1, keepdims=True) * h - wi
    near = (rng.random((SETS, PAIRS)) < 0.5) & (wo[..., 2] > 0.05)
    wo = np.where(near[..., None], wo, elsewhere)
    return wi.astype(np.float32), wo.astype(np.float32)


def theirs(mi: ModuleType, scene: Callable[[int], dict[str, Any]], wi, wo) -> np.ndarray:
    """Values ``(sets, pairs)`` of the first channel, without the cosine."""
    context, at = mi.BSDFContext(), mi.SurfaceInteraction3f()
    out = np.empty(wi.shape[:2])
    for i in range(SETS):
        bsdf = mi.load_dict(scene(i))
        for j in range(PAIRS):
            at.wi = mi.Vector3f(*wi[i, j].tolist())
            out[i, j] = bsdf.eval(context, at, mi.Vector3f(*wo[i, j].tolist()))[0]
    return out / np.abs(wo[..., 2].astype(np.float64))


def ours(expression: str, values: Values, wi, wo) -> np.ndarray:
    """Values ``(sets, pairs)`` in float64, every set with its own parameters."""
    model = Model(expression)
    with jax.enable_x64(True):
        xyz = (np.asarray(d, dtype=np.float64)[..., k] for d in (wi, wo) for k in range(3))
        geometry = jax.tree.map(jnp.asarray, from_components(*xyz))
        given = {
            n: jnp.asarray(np.broadcast_to(values[n], SETS), dtype=jnp.float64)
            for n in model.parameters()
        }
        return np.asarray(jax.jit(jax.vmap(model))(given, geometry))


def agree(name: str, got: np.ndarray, expected: np.ndarray, rtol: float) -> None:
    assert got.shape == expected.shape == (SETS, PAIRS)
    # Below 1e-6 of a set's largest value, float32 rounds the skirts in its exponents.
    seen = expected > 1e-6 * expected.max(axis=1, keepdims=True)
    assert np.mean(seen) > 0.5
    error = np.abs(got - expected)[seen] / expected[seen]
    print(f"{name}: largest {error.max():.2g}, median {np.median(error):.2g}")
    assert error.max() < rtol


def widths(rng: np.random.Generator, anisotropic: bool) -> tuple[np.ndarray, np.ndarray]:
    """Float32 widths, above where Mitsuba's rounded half vector shows."""
    x, y = np.exp(rng.uniform(np.log(0.01), 0.0, (2, SETS))).astype(np.float32)
    return x, y if anisotropic else x


def width_values(lobe: str, x, y, anisotropic: bool) -> Values:
    if not anisotropic:
        return {f"{lobe}.alpha": x}
    return {f"{lobe}.alpha_x": x, f"{lobe}.alpha_y": y, f"{lobe}.angle": np.zeros(1)}


def uniform(rng: np.random.Generator, low: float, high: float) -> np.ndarray:
    return rng.uniform(low, high, SETS).astype(np.float32)


both_kinds = pytest.mark.parametrize("anisotropic", [False, True], ids=["iso", "aniso"])


def test_lambert(mitsuba: ModuleType):
    rng = np.random.default_rng(1)
    albedo = uniform(rng, 0.01, 1.0)
    wi, wo = directions(rng, *widths(rng, False))

    def scene(i: int) -> dict[str, Any]:
        return {"type": "diffuse", "reflectance": grey(albedo[i])}

    expected = theirs(mitsuba, scene, wi, wo)
    agree("lambert", ours("lambert", {"lambert.albedo": albedo}, wi, wo), expected, 1e-6)


def grey(value) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(value)] * 3}


def g1_ratio(cosine: np.ndarray, width2: np.ndarray) -> np.ndarray:
    """Walter et al. 2007, the rational ``G1`` of their eq. 27 over the exact eq. 26."""
    a = cosine / np.sqrt(width2)
    fitted = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    exact = 2 / (1 + erf(a) + np.exp(-(a**2)) / (a * np.sqrt(np.pi)))
    return np.where(a < 1.6, fitted, 1.0) / exact


@both_kinds
@pytest.mark.parametrize("lobe", ["ggx", "beckmann"])
def test_rough_conductor(mitsuba: ModuleType, lobe: str, anisotropic: bool):
    """Mitsuba's Beckmann has the rational ``G1``, up to 0.3 % off and above 1."""
    rng = np.random.default_rng(2)
    x, y = widths(rng, anisotropic)
    eta, k = uniform(rng, 0.1, 4.0), uniform(rng, 0.5, 8.0)
    wi, wo = directions(rng, x, y)

    def scene(i: int) -> dict[str, Any]:
        return {
            "type": "roughconductor", "distribution": lobe,
            "alpha_u": float(x[i]), "alpha_v": float(y[i]),
            "eta": grey(eta[i]), "k": grey(k[i]),
        }  # fmt: skip

    expected = theirs(mitsuba, scene, wi, wo)
    kind = "aniso, " if anisotropic else ""
    values = width_values(lobe, x, y, anisotropic)
    values |= {f"{lobe}.eta": eta, f"{lobe}.k": k, f"{lobe}.scale": np.ones(1)}
    got = ours(f"{lobe}({kind}uncorrelated, conductor)", values, wi, wo)
    if lobe == "beckmann":
        agree("beckmann, exact G1", got, expected, 6.4e-3)
        for w in (wi.astype(np.float64), wo.astype(np.float64)):
            width2 = (x[:, None] * w[..., 0]) ** 2 + (y[:, None] * w[..., 1]) ** 2
            got = got * g1_ratio(w[..., 2], width2)
    agree(f"{lobe}({kind}conductor)", got, expected, 1e-5)


@both_kinds
def test_rough_dielectric(mitsuba: ModuleType, anisotropic: bool):
    """The reflected half of Mitsuba's rough glass."""
    rng = np.random.default_rng(3)
    x, y = widths(rng, anisotropic)
    eta = uniform(rng, 1.2, 3.0)
    wi, wo = directions(rng, x, y)

    def scene(i: int) -> dict[str, Any]:
        return {
            "type": "roughdielectric", "distribution": "ggx",
            "alpha_u": float(x[i]), "alpha_v": float(y[i]),
            "int_ior": float(eta[i]), "ext_ior": 1.0,
        }  # fmt: skip

    expected = theirs(mitsuba, scene, wi, wo)
    kind = "aniso, " if anisotropic else ""
    values = width_values("ggx", x, y, anisotropic)
    values |= {"ggx.eta": eta, "ggx.scale": np.ones(1)}
    got = ours(f"ggx({kind}uncorrelated, dielectric)", values, wi, wo)
    agree(f"ggx({kind}dielectric)", got, expected, 1e-5)


def test_interfaced_lambert(mitsuba: ModuleType):
    """The body of Mitsuba's smooth plastic, whose surface shines in one direction only.

    Mitsuba has a fitted internal reflectance (Egan and Hilgeman 1973), off by up
    to 0.0014.
    """
    rng = np.random.default_rng(6)
    eta, albedo = uniform(rng, 1.2, 2.2), uniform(rng, 0.01, 0.9)
    wi, wo = directions(rng, *widths(rng, False))

    def scene(i: int) -> dict[str, Any]:
        return {
            "type": "plastic", "nonlinear": True, "diffuse_reflectance": grey(albedo[i]),
            "int_ior": float(eta[i]), "ext_ior": 1.0,
        }  # fmt: skip

    expected = theirs(mitsuba, scene, wi, wo)
    values = {"interfaced_lambert.eta": eta, "interfaced_lambert.albedo": albedo}
    got = ours("interfaced_lambert", values, wi, wo)
    agree("interfaced_lambert, exact inside", got, expected, 5e-3)
    n, rho = eta.astype(np.float64), albedo.astype(np.float64)
    c = np.polynomial.legendre.leggauss(200)
    cos, weight = 0.5 * (c[0][:, None] + 1), 0.5 * c[1][:, None]
    ct = np.sqrt(1 - (1 - cos**2) / n**2)
    f = 0.5 * (
        ((cos - n * ct) / (cos + n * ct)) ** 2 + ((n * cos - ct) / (n * cos + ct)) ** 2
    )
    exact = 1 - (1 - np.sum(2 * f * cos * weight, axis=0)) / n**2
    fitted = -1.4399 / n**2 + 0.7099 / n + 0.6681 + 0.0636 * n
    got = got * ((1 - rho * exact) / (1 - rho * fitted))[:, None]
    agree("interfaced_lambert", got, expected, 1e-5)


def principled(values: Values, i: int) -> dict[str, Any]:
    """Mitsuba's principled material; its ``flatness`` is Disney's ``subsurface``."""
    own = {n.removeprefix("disney."): float(v[i]) for n, v in values.items()}
    own.pop("angle", None)
    return {
        "type": "principled",
        "base_color": grey(own.pop("base_color")),
        "flatness": own.pop("subsurface"),
        **own,
    }


@both_kinds
def test_disney(mitsuba: ModuleType, anisotropic: bool):
    """All terms but the clear coat.

    Off the metal Mitsuba has the exact Fresnel of the index that ``specular`` stands for,
    where Disney has Schlick's: the one term is put in place of the other.
    """
    rng = np.random.default_rng(4)
    values = {
        f"disney.{n}": uniform(rng, 0.0, 1.0)
        for n in ("metallic", "subsurface", "sheen", "base_color")
    }
    values["disney.specular"] = uniform(rng, 0.2, 1.0)
    values["disney.roughness"] = uniform(rng, 0.2, 1.0)
    values["disney.clearcoat"] = values["disney.clearcoat_gloss"] = np.zeros(SETS)
    aspect = np.ones(SETS)
    if anisotropic:
        values |= {"disney.anisotropic": uniform(rng, 0, 1), "disney.angle": np.zeros(SETS)}
        aspect = np.sqrt(1 - 0.9 * values["disney.anisotropic"])
    # A share of metal of exactly 0 or 1 takes other ways through Mitsuba.
    values["disney.metallic"][:40] = np.repeat([0.0, 1.0], 20)
    width = values["disney.roughness"].astype(np.float64) ** 2
    x, y = width / aspect, width * aspect
    wi, wo = directions(rng, x, y)
    expected = theirs(mitsuba, lambda i: principled(values, i), wi, wo)
    kind = "aniso, " if anisotropic else ""
    got = ours("disney(aniso)" if anisotropic else "disney", values, wi, wo)
    f0 = 0.08 * values["disney.specular"].astype(np.float64)
    shape = width_values("ggx", x, y, anisotropic)
    exact = {"ggx.eta": 2 / (1 - np.sqrt(f0)) - 1, "ggx.scale": np.ones(1)}
    schlick = {"ggx.f0": f0, "ggx.f90": np.ones(1)}
    more = ours(f"ggx({kind}uncorrelated, dielectric)", shape | exact, wi, wo)
    less = ours(f"ggx({kind}uncorrelated)", shape | schlick, wi, wo)
    body = 1 - values["disney.metallic"].astype(np.float64)[:, None]
    agree(f"disney({kind})", got + body * (more - less), expected, 1e-5)


def test_disney_clear_coat(mitsuba: ModuleType):
    """Mitsuba leaves ``1 / (4 cos_i cos_o)`` out of the clear coat, Disney does not.

    What the clear coat adds to a black metal; the difference costs float32 two digits.
    """
    rng = np.random.default_rng(5)
    names = ("subsurface", "specular", "sheen", "base_color")
    values = {f"disney.{n}": np.zeros(SETS) for n in names}
    values["disney.metallic"] = np.ones(SETS)
    values["disney.roughness"] = uniform(rng, 0.2, 1.0)
    values["disney.clearcoat"] = uniform(rng, 0.1, 1.0)
    values["disney.clearcoat_gloss"] = uniform(rng, 0.0, 0.5)
    width = np.full(SETS, 0.1)
    wi, wo = directions(rng, width, width)
    without = values | {"disney.clearcoat": np.zeros(SETS)}
    expected = theirs(mitsuba, lambda i: principled(values, i), wi, wo)
    expected -= theirs(mitsuba, lambda i: principled(without, i), wi, wo)
    got = ours("disney", values, wi, wo) - ours("disney", without, wi, wo)
    got *= 4.0 * wi[..., 2].astype(np.float64) * wo[..., 2].astype(np.float64)
    agree("disney, clear coat", got, expected, 3e-4)


def on_both_sides(rng: np.random.Generator, wi, wo, eta) -> tuple[Vectors, Vectors]:
    """The pairs with each direction on a side of its own; two of three of those that are
    on different ones with the second where the facet between them refracts the first."""
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    above = rng.random((SETS, PAIRS)) < 0.5
    index = np.where(above, eta[:, None], 1 / eta[:, None])
    i = np.sum(wi * h, axis=-1)
    t2 = 1 - (1 - i * i) / index**2
    through = (i / index - np.sqrt(np.maximum(t2, 0)))[..., None] * h - wi / index[
        ..., None
    ]
    bent = (t2 > 0) & (through[..., 2] < -0.05) & (rng.random((SETS, PAIRS)) < 0.67)
    passes = rng.random((SETS, PAIRS)) < 0.6
    flip = np.array([1.0, 1.0, -1.0])
    wo = np.where(
        (passes & bent)[..., None], through, np.where(passes[..., None], wo * flip, wo)
    )
    turn = np.where(above[..., None], np.ones(3), flip)
    return (wi * turn).astype(np.float32), (wo * turn).astype(np.float32)


@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
def test_rough_glass_on_all_ways(mitsuba: ModuleType, distribution: str):
    """All four ways of light; Mitsuba's Beckmann has the rational ``G1``.

    A BSDF of Mitsuba in radiance has the detector as ``wi`` and the source as ``wo``.
    """
    rng = np.random.default_rng(11)
    alpha, eta = np.exp(uniform(rng, np.log(0.05), 0.0)), uniform(rng, 1.1, 2.5)
    source, detector = on_both_sides(rng, *directions(rng, alpha, alpha), eta)

    def scene(i: int) -> dict[str, Any]:
        return {
            "type": "roughdielectric", "distribution": distribution,
            "alpha": float(alpha[i]), "int_ior": float(eta[i]), "ext_ior": 1.0,
        }  # fmt: skip

    expected = theirs(mitsuba, scene, detector, source)
    lobe = "rough_dielectric" + ("(beckmann)" if distribution == "beckmann" else "")
    one = np.ones(1)
    values = {
        "rough_dielectric.alpha": alpha, "rough_dielectric.eta": eta,
        "rough_dielectric.reflected": one, "rough_dielectric.transmitted": one,
    }  # fmt: skip
    got = ours(lobe, values, source, detector)
    if distribution == "beckmann":
        for w in (source, detector):
            c2 = w[..., 2].astype(np.float64) ** 2
            got = got * g1_ratio(np.sqrt(c2), alpha[:, None] ** 2 * (1 - c2))
    seen = expected > 1e-6 * expected.max(axis=1, keepdims=True)
    through = source[..., 2] * detector[..., 2] < 0
    error = np.abs(got - expected)[seen] / expected[seen]
    print(f"{lobe}: largest {error.max():.2g}, median {np.median(error):.2g}")
    assert np.mean(seen & through) > 0.2
    # Mitsuba's Fresnel term takes a root of 1 - sin^2 in float32, and is off by much next
    # to total reflection.
    assert np.quantile(error, 0.99) < 3e-4
    assert np.median(error) < 1e-6
    assert error.max() < 1e-2


def test_thin_dielectric(mitsuba: ModuleType):
    """Both beams of a clear plate at 20,000 angles of incidence, from both sides."""
    rng = np.random.default_rng(12)
    eta = uniform(rng, 1.05, 2.5)
    wi, _ = on_both_sides(rng, *directions(rng, eta, eta), eta)
    context, at = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    r, t, straight = (np.empty((SETS, PAIRS)) for _ in range(3))
    for i in range(SETS):
        plate = {"type": "thindielectric", "int_ior": float(eta[i]), "ext_ior": 1.0}
        bsdf = mitsuba.load_dict(plate)
        for j in range(PAIRS):
            at.wi = mitsuba.Vector3f(*wi[i, j].tolist())
            reflected, of_r = bsdf.sample(context, at, 0.0, [0.5, 0.5])
            passed, of_t = bsdf.sample(context, at, 1.0, [0.5, 0.5])
            r[i, j], t[i, j] = reflected.pdf * of_r[0], passed.pdf * of_t[0]
            straight[i, j] = np.abs(np.asarray(passed.wo) + wi[i, j]).max()
    with jax.enable_x64(True):
        cosine = jnp.abs(jnp.asarray(wi[..., 2], jnp.float64))
        index = jnp.asarray(eta, jnp.float64)[:, None]
        mixed = reflected_and_transmitted(cosine, index, jnp.zeros(()), "mixed")
    assert straight.max() < 1e-6
    for got, expected in zip(mixed, (r, t), strict=True):
        assert np.max(np.abs(np.asarray(got) - expected)) < 2e-5


def test_principled_thin(mitsuba: ModuleType):
    """Mitsuba reflects and transmits with one face's ``F`` and ``1 - F`` there, in place of
    which the plate's, all orders of reflection inside, are put."""
    rng = np.random.default_rng(13)
    roughness, eta = uniform(rng, 0.25, 1.0), uniform(rng, 1.1, 2.0)
    widths_ = (roughness**2, np.maximum((0.65 * eta - 0.35) * roughness, 0.01) ** 2)
    source, detector = directions(rng, *widths_)
    behind = np.where(rng.random((SETS, PAIRS)) < 0.5, -1, 1).astype(np.float32)
    source = np.stack([source[..., 0], source[..., 1], source[..., 2] * behind], axis=-1)

    def scene(i: int) -> dict[str, Any]:
        return {
            "type": "principledthin", "base_color": grey(1.0), "spec_trans": 1.0,
            "roughness": float(roughness[i]), "eta": float(eta[i]), "diff_trans": 0.0,
        }  # fmt: skip

    expected = theirs(mitsuba, scene, detector, source)
    one = np.ones(1)
    values = {
        "thin_slab.alpha": widths_[0], "thin_slab.alpha_t": widths_[1],
        "thin_slab.eta": eta, "thin_slab.optical_depth": np.zeros(1),
        "thin_slab.reflected": one, "thin_slab.transmitted": one,
    }  # fmt: skip
    got = ours("thin_slab(two_widths, mixed)", values, source, detector)
    folded = np.abs(source[..., 2].astype(np.float64))
    across = np.sum(source[..., :2].astype(np.float64) * detector[..., :2], axis=-1)
    cos_d = np.sqrt(0.5 * (1 + across + folded * detector[..., 2]))
    with jax.enable_x64(True):
        terms = dielectric_terms(jnp.asarray(cos_d), jnp.asarray(eta, jnp.float64)[:, None])
        plate = reflected_and_transmitted(
            jnp.asarray(cos_d),
            jnp.asarray(eta, jnp.float64)[:, None],
            jnp.zeros(()),
            "mixed",
        )
        one_face = (terms.reflected, terms.transmitted)
        ratio = [np.asarray(a / b) for a, b in zip(one_face, plate, strict=True)]
    got = got * np.where(behind > 0, *ratio)
    agree("thin_slab", got, expected, 2e-4)
