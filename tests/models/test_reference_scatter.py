"""Scatter lobes: closed forms of their integrals, and the fits that others published."""

from __future__ import annotations

import csv
import functools
import math
from pathlib import Path

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from fitting.albedo import albedo_basis
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.models import fresnel, lobe_class
from fitting.predict import predict_geometry

LOBES = {
    "abg": lobe_class("abg")(),
    "harvey_shack": lobe_class("harvey_shack")(),
    "spectral": lobe_class("harvey_shack")(spectral=True),
    "abc": lobe_class("abc")(),
    "abc_smooth": lobe_class("abc_smooth")(),
}


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


@functools.cache
def compiled(name: str, nodes: int):
    return jax.jit(lambda s, mu: albedo_basis(LOBES[name], s, mu, nodes=nodes)[0])


def albedo(name: str, cos_theta, *, nodes: int = 128, **shape: float) -> np.ndarray:
    values = {n: jnp.asarray(float(v)) for n, v in shape.items()}
    return np.asarray(compiled(name, nodes)(values, jnp.asarray(cos_theta)))


def some_pairs(count: int, up_to_deg: float = 89.0):
    """Angles in radians, half of them next to the mirror direction."""
    rng = np.random.default_rng(3)
    ti, tr = np.radians(rng.uniform(0, up_to_deg, (2, count)))
    phi = rng.uniform(0, 2 * np.pi, count)
    near = np.arange(count) % 2 == 0
    tr = np.where(near, np.abs(ti + rng.normal(0, 0.01, count)), tr)
    tr = np.minimum(tr, np.radians(up_to_deg))
    return ti, tr, np.where(near, np.pi + rng.normal(0, 0.01, count), phi)


def values_at(name: str, pairs, **shape: float) -> np.ndarray:
    ti, tr, phi = pairs
    geometry = jax.tree.map(jnp.asarray, from_angles(ti, 0.2, tr, 0.2 + phi))
    own = {n: jnp.asarray(float(v)) for n, v in shape.items()}
    return np.asarray(LOBES[name].basis(own, geometry)[0])


@pytest.mark.parametrize(
    ("mu", "value"), [(1.0, 0.0217044933), (0.7, 0.0194733283), (0.3, 0.0144704473)]
)
def test_albedo_of_the_abc_spectrum(mu: float, value: float):
    """1 / (1 + 1000 q), which is Harvey-Shack with the slope -2."""
    found = albedo("harvey_shack", [mu], shoulder=1000**-0.5, slope=-2)
    np.testing.assert_allclose(found, value, atol=6e-11)


@pytest.mark.parametrize("b", [1.0, 10.0, 1e3, 1e5])
def test_albedo_of_the_abc_spectrum_at_any_angle(b: float):
    """Low et al. 2012, eq. 19: the integral for c = 1 in closed form."""
    mu = np.array([0.05, 0.3, 0.6, 0.9, 1.0])
    r2 = 1 - mu**2
    root = np.sqrt(1 + 2 * b * (1 + r2) + (b * mu**2) ** 2)
    exact = np.pi / b * np.log(0.5 * (1 + b * mu**2 + root))
    found = albedo("harvey_shack", mu, shoulder=b**-0.5, slope=-2)
    np.testing.assert_allclose(found, exact, rtol=1e-6)


@pytest.mark.parametrize("c", [0.2, 0.7, 1.3, 2.0, 3.0])
@pytest.mark.parametrize("b", [10.0, 1e4])
def test_albedo_of_the_abc_spectrum_at_normal_incidence(b: float, c: float):
    exact = math.pi * (1 - (1 + b) ** (1 - c)) / (b * (c - 1))
    found = albedo("harvey_shack", [1.0], shoulder=b**-0.5, slope=-2 * c)
    np.testing.assert_allclose(found, exact, rtol=1e-7)


@pytest.mark.parametrize("g", [0.5, 1.0, 1.7, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("shoulder", [0.01, 0.1, 1.0])
def test_total_scatter_of_abg(shoulder: float, g: float):
    """At normal incidence (pi A / B) 2F1(1, 2 / g; 1 + 2 / g; -1 / B)."""
    b = mp.mpf(shoulder) ** g
    exact = mp.pi * mp.hyp2f1(1, 2 / mp.mpf(g), 1 + 2 / mp.mpf(g), -1 / b)
    if g == 2.0:
        assert abs(exact - mp.pi * b * mp.log(1 + 1 / b)) < 1e-12
    found = albedo("abg", [1.0], shoulder=shoulder, g=g)
    np.testing.assert_allclose(found, float(exact), rtol=1e-6)


@pytest.mark.parametrize("shoulder", [1e-5, 1e-2, 1.0])
def test_abg_is_harvey_shack_for_a_square(shoulder: float):
    pairs = some_pairs(200)
    np.testing.assert_allclose(
        values_at("abg", pairs, shoulder=shoulder, g=2),
        values_at("harvey_shack", pairs, shoulder=shoulder, slope=-2),
        rtol=1e-13,
    )


def test_abg_is_half_at_the_shoulder():
    """Normal incidence, where |beta - beta_0| is the sine of the polar angle."""
    pairs = np.zeros(3), np.arcsin([0.0, 0.02, 0.2]), np.zeros(3)
    found = values_at("abg", pairs, shoulder=0.02, g=3)
    np.testing.assert_allclose(found, [1, 0.5, 1 / 1001], rtol=1e-13)


def test_spectral_at_its_reference_is_the_plain_lobe():
    pairs = some_pairs(100)
    shape = {"shoulder": 0.03, "slope": -1.7}
    np.testing.assert_array_equal(
        values_at("spectral", pairs, wavelength=550, **shape),
        values_at("harvey_shack", pairs, **shape),
    )


@pytest.mark.parametrize("wavelength", [275.0, 1100.0, 10600.0])
def test_total_scatter_falls_with_the_square_of_the_wavelength(wavelength: float):
    """The total of Rayleigh-Rice, (4 pi sigma / l)^2, if the skirt ends in the hemisphere;
    in closed form if it does not."""
    shoulder, slope = 1e-3, -4.0
    ratio = 550 / wavelength
    found = albedo("spectral", [1.0], shoulder=shoulder, slope=slope, wavelength=wavelength)
    plain = albedo("harvey_shack", [1.0], shoulder=shoulder, slope=slope)
    np.testing.assert_allclose(found / plain, ratio**2, rtol=1e-3)
    width2 = (shoulder / ratio) ** 2
    exact = math.pi * ratio**4 * width2 * (1 - 1 / (1 + 1 / width2))
    np.testing.assert_allclose(found, exact, rtol=1e-7)


@pytest.mark.parametrize("slope", [-1.5, -2.5])
def test_skirt_of_a_power_law_surface(slope: float):
    """Far from the mirror a spectrum ~ frequency^slope scatters as l^-(4 + slope)."""
    pairs = np.zeros(2), np.radians([30.0, 60.0]), np.zeros(2)
    blue, red = (
        values_at("spectral", pairs, shoulder=1e-5, slope=slope, wavelength=nm)
        for nm in (400.0, 800.0)
    )
    np.testing.assert_allclose(blue / red, 2 ** (4 + slope), rtol=1e-6)


def test_only_the_spectral_lobe_asks_for_the_wavelength():
    assert [p.name for p in LOBES["spectral"].parameters() if p.given] == ["wavelength"]
    assert not any(p.given for p in LOBES["harvey_shack"].parameters())


def test_abc_smooth_is_a_spectrum_times_fresnel():
    """The reflectance is that of half the difference of the projected directions."""
    ti, tr, phi = some_pairs(200)
    apart = np.sin(ti) ** 2 + np.sin(tr) ** 2 - 2 * np.sin(ti) * np.sin(tr) * np.cos(phi)
    f = fresnel.dielectric(jnp.asarray(np.sqrt(1 - apart / 4)), jnp.asarray(1.6))
    np.testing.assert_allclose(
        values_at("abc_smooth", (ti, tr, phi), b=400, c=0.8, eta=1.6),
        values_at("harvey_shack", (ti, tr, phi), shoulder=0.05, slope=-1.6) * f,
        rtol=1e-9,
    )


def test_abc_stays_finite_at_the_horizon():
    """Where one direction grazes it has a limit; where both do, mirrored, a pole."""
    near = np.pi / 2 - np.array([1e-3, 1e-5, 1e-7, 0.0])
    shape = {"b": 100.0, "c": 1.0, "eta": 1.5}
    one = values_at("abc", (near, np.full(4, 0.7), np.full(4, 2.0)), **shape)
    np.testing.assert_allclose(one[1:], one[3], rtol=1e-4)
    both = values_at("abc", (near[:3], near[:3], np.full(3, np.pi)), **shape)
    np.testing.assert_allclose(both, [1e6 / np.pi, 1e10 / np.pi, 1e12 / np.pi], rtol=0.01)


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("abg", {"shoulder": s, "g": g})
        for s in (1e-3, 0.03, 1.0)
        for g in (0.5, 1.5, 2.0, 2.5, 4.0)
    ]
    + [("abc", {"b": b, "c": c, "eta": 1.5}) for b in (1, 1e4, 1e6) for c in (0.2, 1, 2.5)]
    + [("abc_smooth", {"b": b, "c": 1.0, "eta": 1.5}) for b in (1, 1e4, 1e6)],
)
def test_error_of_the_quadrature(name: str, shape: dict[str, float]):
    """16 nodes serve a penalty, 64 a report, for narrow and wide shoulders."""
    mu = [0.02, 0.1, 0.3, 0.6, 1.0]
    few, many, most = (albedo(name, mu, nodes=n, **shape) for n in (16, 64, 192))
    np.testing.assert_allclose(few, most, rtol=0.03)
    np.testing.assert_allclose(many, most, rtol=3e-4)


def published(path: Path) -> dict[str, np.ndarray]:
    """Columns of numbers of 100 materials, one value per material and colour."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 100

    def column(name: str) -> np.ndarray:
        names = [f"{name}_{c}" for c in "rgb"] if f"{name}_r" in rows[0] else [name] * 3
        return np.array([[float(r[n]) for n in names] for r in rows]).ravel()

    index = "ior" if "ior" in rows[0] else "eta"
    return {"kd": column("kd"), **{n: column(n) for n in "ABC"}, "eta": column(index)}


def unpolarised(cosine, eta):
    """Fresnel's formulas with the refracted cosine."""
    inside = np.sqrt(1 - (1 - cosine**2) / eta**2)
    rs = (cosine - eta * inside) / (cosine + eta * inside)
    rp = (eta * cosine - inside) / (eta * cosine + inside)
    return (rs**2 + rp**2) / 2


@pytest.mark.parametrize(
    ("lobe", "file"), [("abc", "abc.csv"), ("abc_smooth", "low_lowsmooth_E2.csv")]
)
def test_published_fits(real_data: Path, lobe: str, file: str):
    """All materials at fixed angles, in extended precision as the paper prints them."""
    v = published(real_data / "published_fits" / file)
    angles = some_pairs(80, 85.0)
    got = predict_geometry(
        Model(f"lambert + {lobe}"),
        {
            "lambert.albedo": v["kd"],
            f"{lobe}.a": v["A"],
            **{f"{lobe}.{n.lower()}": v[n] for n in ("B", "C", "eta")},
        },
        from_angles(angles[0], 0.0, angles[1], angles[2]),
    )
    ti, tr, phi = (np.asarray(x, np.longdouble)[:, None] for x in angles)
    wi = np.stack([np.sin(ti), 0 * ti, np.cos(ti)])
    wo = np.stack([np.sin(tr) * np.cos(phi), np.sin(tr) * np.sin(phi), np.cos(tr)])
    if lobe == "abc":
        h = (wi + wo) / np.sqrt(np.sum((wi + wo) ** 2, axis=0))
        cd = np.sum(wi * h, axis=0)
        d = v["A"] / (1 + v["B"] * (1 - h[2])) ** v["C"]
        g = np.minimum(1, np.minimum(2 * h[2] * wi[2] / cd, 2 * h[2] * wo[2] / cd))
        own = unpolarised(cd, v["eta"]) * d * g / (np.pi * wi[2] * wo[2])
    else:
        q = np.sum((wi + wo)[:2] ** 2, axis=0)
        ct = np.sqrt(1 - np.sum((wi - wo)[:2] ** 2, axis=0) / 4)
        own = v["A"] * unpolarised(ct, v["eta"]) / (1 + v["B"] * q) ** v["C"]
    assert got.shape == (80, 300)
    np.testing.assert_allclose(got, v["kd"] / np.pi + own, rtol=1e-9)
