"""Fits that others published, evaluated by our lobes: their numbers, their formulas."""

from __future__ import annotations

import csv
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
import synthetic

from fitting import fit
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.predict import predict_geometry

Columns = dict[str, np.ndarray]


def table(path: Path) -> tuple[list[str], Columns]:
    """Materials of a published table, and its columns of numbers ``(materials,)``."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {
        n: np.array([float(r[n]) for r in rows])
        for n in rows[0]
        if n not in ("material", "alt_name")
    }
    return [r["material"] for r in rows], columns


def channels_of(columns: Columns, name: str) -> np.ndarray:
    """Red, green and blue of all materials, one after the other ``(3 materials,)``."""
    return np.stack([columns[f"{name}_{c}"] for c in "rgb"], axis=1).ravel()


def some_angles(count: int, up_to_deg: float, mirror: float):
    """Angles in radians; a share of the pairs is within 3 degrees of the mirror."""
    rng = np.random.default_rng(11)
    ti, tr = np.radians(rng.uniform(0.0, up_to_deg, (2, count)))
    phi = rng.uniform(0.0, 2 * np.pi, count)
    near = rng.random(count) < mirror
    tr = np.where(near, np.abs(ti + np.radians(rng.uniform(-3, 3, count))), tr)
    tr = np.minimum(tr, np.radians(up_to_deg))
    phi = np.where(near, np.pi + np.radians(rng.uniform(-3, 3, count)), phi)
    return ti, tr, phi


def half_way(ti, tr, phi) -> tuple[np.ndarray, np.ndarray]:
    """``tan^2`` of the half vector's polar angle; cosine of the difference angle."""
    h = np.stack([np.sin(ti) + np.sin(tr) * np.cos(phi), np.sin(tr) * np.sin(phi)])
    up = np.cos(ti) + np.cos(tr)
    return np.sum(h**2, axis=0) / up**2, 0.5 * np.sqrt(np.sum(h**2, axis=0) + up**2)


def published_sgd(values: Columns, ti, tr, phi) -> np.ndarray:
    """The formula of Bagher, Soler and Holzschuch 2012, ``(n, fits)``."""
    v = values
    tan2, cos_d = (x[:, None] for x in half_way(ti, tr, phi))
    ax = v["alpha"] + tan2 / v["alpha"]
    d = v["K_ap"] * np.exp(-ax) / (np.pi * ax ** v["p"]) * (1 + tan2) ** 2
    f = v["F0"] - v["F1"] * cos_d + (1 - v["F0"]) * (1 - cos_d) ** 5
    for theta in (ti[:, None], tr[:, None]):
        with np.errstate(over="ignore"):
            grown = np.exp(v["c"] * np.maximum(theta - v["theta0"], 0.0) ** v["k"])
        shade = np.clip(1 + v["lambda"] * (1 - grown), 0.0, 1.0)
        d = d * shade / np.cos(theta)
    return (v["rho_d"] + v["rho_s"] * f * d) / np.pi


def shadow_constant(values: Columns) -> np.ndarray:
    """The ``c`` with which ``G1`` is 0 at the horizon."""
    v = values
    logarithm = np.log(np.log1p(1 / v["lambda"])) - v["k"] * np.log(np.pi / 2 - v["theta0"])
    return np.exp(logarithm)


def from_published(values: Columns) -> Columns:
    """Parameters of ``lambert + sgd``, whose lobe has the exact normaliser instead of K."""
    v = values
    area = [
        float(a * mp.gammainc(1 - p, a)) for a, p in zip(v["alpha"], v["p"], strict=True)
    ]
    ks = v["rho_s"] * v["K_ap"] * np.array(area)
    return {
        "lambert.albedo": v["rho_d"],
        "sgd.f0": ks * (v["F0"] - v["F1"]),
        "sgd.f90": ks,
        "sgd.f1": ks * v["F1"],
        **{f"sgd.{n}": v[n] for n in ("alpha", "p", "lambda", "k", "theta0")},
    }


SGD = ("rho_d", "rho_s", "alpha", "p", "F0", "F1", "K_ap", "lambda", "c", "k", "theta0")
ORIGINAL = ("kd", "ks", "alpha", "p", "eta0", "eta1", "K", "Lambda", "c", "k", "theta0")


def sgd_fits(folder: Path, file: str, names: tuple[str, ...]) -> tuple[list[str], Columns]:
    """Materials, and the 300 values of each of the paper's parameters."""
    materials, columns = table(folder / "published_fits" / file)
    assert len(materials) == 100
    return materials, {n: channels_of(columns, c) for n, c in zip(SGD, names, strict=True)}


def last_digit(x: np.ndarray) -> np.ndarray:
    """Half a unit of the sixth significant digit, the last that is printed."""
    return 0.5 * 10.0 ** (np.floor(np.log10(np.abs(x))) - 5)


def test_sgd_constants_follow_from_the_other_parameters(real_data: Path):
    """``c`` and, where ``p < 1``, ``K_AP`` as the lobe has them, to the printed digits."""
    _, v = sgd_fits(real_data, "sgd_original.csv", ORIGINAL)
    elevation = np.pi / 2 - v["theta0"]
    rounded = (
        np.abs(np.log(elevation)) * last_digit(v["k"])
        + v["k"] / elevation * last_digit(v["theta0"])
        + last_digit(v["lambda"]) / v["lambda"]
        + last_digit(v["c"]) / v["c"]
    )
    assert np.all(np.abs(np.log(shadow_constant(v) / v["c"])) <= rounded)
    ratio = from_published(v)["sgd.f90"] / v["rho_s"]
    assert np.count_nonzero(v["p"] < 1) == 282
    np.testing.assert_allclose(ratio[v["p"] < 1], 1.0, rtol=1e-5)


def test_sgd_of_all_materials(real_data: Path):
    """100 materials and 3 channels, 60 pairs each: to rounding, and as it is printed."""
    _, v = sgd_fits(real_data, "sgd_original.csv", ORIGINAL)
    model, parameters = Model("lambert + sgd"), from_published(v)
    for up_to_deg, printed in ((75.0, 1e-5), (85.0, 1e-4)):
        ti, tr, phi = some_angles(60, up_to_deg, mirror=0.4)
        got = predict_geometry(model, parameters, from_angles(ti, 0.3, tr, 0.3 + phi))
        exact = published_sgd(v | {"c": shadow_constant(v)}, ti, tr, phi)
        assert got.shape == (60, 300)
        np.testing.assert_allclose(got, exact, rtol=1e-11)
        np.testing.assert_allclose(got, published_sgd(v, ti, tr, phi), rtol=printed)


def test_sgd_of_another_table(real_data: Path):
    """The table of another program, which capped what overflows a float32 at 1e38."""
    _, v = sgd_fits(real_data, "sgd.csv", SGD)
    kept = v["c"] < 1e38
    assert np.count_nonzero(kept) > 270
    v = {n: x[kept] for n, x in v.items()}
    ti, tr, phi = some_angles(60, 75.0, mirror=0.4)
    got = predict_geometry(
        Model("lambert + sgd"), from_published(v), from_angles(ti, 0.3, tr, 0.3 + phi)
    )
    np.testing.assert_allclose(got, published_sgd(v, ti, tr, phi), rtol=1e-5)


def goniometer() -> tuple[np.ndarray, ...]:
    """Rings of 5 degrees up to 75, and finer steps through the highlight."""
    ti, tr = np.radians([10.0, 25, 40, 55, 70]), np.radians(np.arange(0.0, 76.0, 5.0))
    rings = [(i, 0.0, r, p) for i in ti for r in tr for p in np.pi * np.arange(13) / 12]
    rings = [row for row in rings if row[2] > 0 or row[3] == 0]
    steps = np.radians([-3.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0])
    fine = [(i, 0.0, i + d, np.pi) for i in ti for d in steps]
    return tuple(np.array(rings + fine).T)


@pytest.mark.slow
def test_sgd_comes_back_from_a_fit(real_data: Path):
    """Green of seven materials as a goniometer would see it: within 1 % everywhere."""
    materials, v = sgd_fits(real_data, "sgd.csv", SGD)
    names = ["alum-bronze", "nylon", "gold-metallic-paint", "red-fabric", "pvc", "teflon"]
    angles, expression = goniometer(), "lambert + sgd"
    for name in (*names, "white-paint"):
        green = 3 * materials.index(name) + 1
        truth = {n: float(x[green]) for n, x in from_published(v).items()}
        measured = synthetic.measurement(expression, truth, angles=angles)
        found = fit(measured, expression, cross_validate=False).values
        got = predict_geometry(Model(expression), found, from_angles(*angles))
        error = np.abs(got.ravel() / measured.value.ravel() - 1)
        print(f"{name}: median {np.median(error):.2g}, largest {np.max(error):.2g}")
        assert np.max(error) < 0.01
