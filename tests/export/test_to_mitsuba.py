"""Mitsuba loads what we export and computes what we say that it computes."""

from __future__ import annotations

import json
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from made_up import RGB, SPECTRAL, directions, geometry_of, result_of

from fitting.export import export
from fitting.export.mitsuba import make
from fitting.export.target import Request
from fitting.model import Model
from fitting.predict import predict_geometry

PAIRS = 2000
ALBEDO = [0.7, 0.3, 0.05]


@pytest.fixture
def mitsuba():
    module = pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
    before = module.variant()
    module.set_variant("scalar_rgb")
    yield module
    if before:
        module.set_variant(before)


def theirs(mi: ModuleType, bsdf: Any, wi, wo) -> np.ndarray:
    """Values ``(n, 3)`` with the source ``wi``, without the cosine of the source."""
    context, at = mi.BSDFContext(), mi.SurfaceInteraction3f()
    out = np.empty((len(wi), 3))
    for j in range(len(wi)):
        # In radiance Mitsuba's wi is the detector.
        at.wi = mi.Vector3f(*wo[j].tolist())
        out[j] = bsdf.eval(context, at, mi.Vector3f(*wi[j].tolist()))
    return out / np.abs(wi[:, 2:].astype(np.float64))


def agree(got: np.ndarray, expected: np.ndarray, rtol: float) -> None:
    """Relative to a value, but for what float32 cannot hold beside the peak."""
    assert got.shape == expected.shape
    floor = 1e-6 * expected.max(axis=0)
    error = np.abs(got - expected) / np.maximum(np.abs(expected), floor)
    assert error.max() < rtol, error.max()


EXACT = {
    "lambert": {"lambert__albedo": ALBEDO},
    "burley": {"burley__albedo": ALBEDO, "burley__roughness": 0.8},
    "interfaced_lambert": {"interfaced_lambert__albedo": ALBEDO},
    "ggx(uncorrelated, dielectric)": {"ggx__alpha": 0.1, "ggx__eta": 1.6},
    "ggx(aniso, uncorrelated, conductor)": {
        "ggx__alpha_x": 0.1, "ggx__alpha_y": 0.3, "ggx__angle": 0.0,
        "ggx__eta": 0.3, "ggx__k": 3.0, "ggx__scale": [0.9, 0.8, 0.7],
    },
    "lambert + burley + ggx(uncorrelated, conductor) + ggx(uncorrelated, dielectric)": {
        "lambert__albedo": ALBEDO, "burley__albedo": [0.2, 0.9, 0.1],
        "ggx1__alpha": 0.1, "ggx2__alpha": 0.4, "ggx1__k": 2.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("expression", EXACT)
def test_exact_models_agree(mitsuba, tmp_path, expression):
    """At 2,000 pairs, of the XML and the dict, to the accuracy of float32."""
    result = result_of(expression, **EXACT[expression])
    wi, wo = directions(1, PAIRS)
    g = geometry_of(wi, wo)
    expected = predict_geometry(Model(result.model), result.values, g)
    report = export(result, "mitsuba", tmp_path / "a.xml")
    assert report.exact
    assert report.residual.relative_rms < 1e-9
    agree(
        theirs(mitsuba, mitsuba.load_file(str(tmp_path / "a.xml")), wi, wo), expected, 2e-5
    )
    export(result, "mitsuba", tmp_path / "a.json")
    material = json.loads((tmp_path / "a.json").read_text())["material"]
    agree(theirs(mitsuba, mitsuba.load_dict(material), wi, wo), expected, 2e-5)


def test_glass_and_opal_on_all_ways(mitsuba, tmp_path):
    """Reflection and transmission from both sides."""
    result = result_of(
        "rough_dielectric + lambert_transmission",
        rough_dielectric__alpha=0.3, rough_dielectric__reflected=[0.9, 0.8, 0.7],
        lambert_transmission__transmittance=ALBEDO,
    )  # fmt: skip
    report = export(result, "mitsuba", tmp_path / "a.xml")
    assert report.exact
    assert not [r for r in report.remarks if "left out" in r]
    wi, wo = directions(2, PAIRS, alpha=0.3)
    sides = np.random.default_rng(3).choice([-1, 1], size=(PAIRS, 2)).astype(np.float32)
    wi[:, 2] *= sides[:, 0]
    wo[:, 2] *= sides[:, 1]
    expected = predict_geometry(Model(result.model), result.values, geometry_of(wi, wo))
    got = theirs(mitsuba, mitsuba.load_file(str(tmp_path / "a.xml")), wi, wo)
    error = np.abs(got - expected) / np.maximum(
        np.abs(expected), 1e-6 * expected.max(axis=0)
    )
    # Next to total reflection Mitsuba's Fresnel term takes a root of 1 - sin^2 in float32.
    assert np.quantile(error, 0.99) < 1e-3
    assert error.max() < 2e-2


@pytest.mark.parametrize(
    "kind",
    ["ggx", *(pytest.param(k, marks=pytest.mark.slow) for k in ("ggx(f82)", "beckmann"))],
)
def test_another_fresnel_term_is_near(mitsuba, tmp_path, kind):
    """What Mitsuba computes is what the report says: a sum of conductors."""
    result = result_of(f"lambert + {kind}", lambert__albedo=ALBEDO, **{
        f"{kind[:kind.find('(')] if '(' in kind else kind}__f0": [0.03, 0.04, 0.05],
    })  # fmt: skip
    report = export(result, "mitsuba", tmp_path / "a.xml")
    assert not report.exact
    assert report.residual.relative_rms < 0.05
    assert any("shadowing" in r for r in report.remarks)
    wi, wo = directions(4, PAIRS, alpha=0.2)
    product = make(result, Request(), tmp_path / "a.xml", lambda _: None)
    expected = product.representation(geometry_of(wi, wo))
    got = theirs(mitsuba, mitsuba.load_file(str(tmp_path / "a.xml")), wi, wo)
    # Walter's rational masking of Beckmann facets is 0.3 % off in both directions.
    agree(got, expected, 7e-3 if kind == "beckmann" else 2e-5)


def test_disney_is_principled(mitsuba, tmp_path):
    """With Mitsuba's exact Fresnel term, which the distance from the fit shows."""
    result = result_of(
        "disney", disney__base_color=ALBEDO, disney__roughness=0.4, disney__clearcoat=0.0
    )
    report = export(result, "mitsuba", tmp_path / "a.xml")
    assert "principled" in report.represented_by
    assert 1e-4 < report.residual.relative_rms < 0.2
    product = make(result, Request(), tmp_path / "a.xml", lambda _: None)
    wi, wo = directions(5, PAIRS, alpha=0.16)
    expected = product.representation(geometry_of(wi, wo))
    got = theirs(mitsuba, mitsuba.load_file(str(tmp_path / "a.xml")), wi, wo)
    agree(got, expected, 2e-5)


@pytest.mark.slow
def test_a_lobe_without_a_plugin_is_refitted(mitsuba, tmp_path):
    """Phong's lobe: the file holds the closest of Mitsuba's own models, and says so."""
    result = result_of("lambert + phong", lambert__albedo=ALBEDO, phong__exponent=40.0)
    report = export(result, "mitsuba", tmp_path / "a.xml", representation="principled")
    assert not report.exact
    assert 0.02 < report.residual.relative_rms < 1.0
    assert any("refitted" in r for r in report.remarks)
    text = (tmp_path / "a.xml").read_text()
    assert str(report.residual) in text
    mitsuba.load_file(str(tmp_path / "a.xml"))


def test_spectra(mitsuba, tmp_path):
    """In a spectral variant every wavelength is that of the fit."""
    albedo = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    result = result_of(
        "lambert + ggx(uncorrelated, conductor)", SPECTRAL, lambert__albedo=albedo,
        ggx__alpha=0.1, ggx__k=np.linspace(2, 4, 6),
    )  # fmt: skip
    report = export(result, "mitsuba", tmp_path / "a.xml", spectral=True)
    assert report.exact
    assert report.channels == [c.name for c in SPECTRAL]
    mitsuba.set_variant("scalar_spectral")
    bsdf = mitsuba.load_file(str(tmp_path / "a.xml"))
    wi, wo = directions(6, 200)
    expected = predict_geometry(Model(result.model), result.values, geometry_of(wi, wo))
    context, at = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    at.wavelengths = [c.wavelength_nm for c in SPECTRAL[1:5]]
    for j in range(len(wi)):
        at.wi = mitsuba.Vector3f(*wi[j].tolist())
        got = np.array(bsdf.eval(context, at, mitsuba.Vector3f(*wo[j].tolist())))
        np.testing.assert_allclose(got / wo[j, 2], expected[j, 1:5], rtol=2e-5)


def test_spectra_become_linear_srgb(tmp_path):
    """White is white, and a colour beyond the gamut is moved to its edge, said so."""
    white = result_of("lambert", SPECTRAL, lambert__albedo=1.0)
    report = export(white, "mitsuba", tmp_path / "a.json")
    material = json.loads((tmp_path / "a.json").read_text())["material"]
    np.testing.assert_allclose(_colour(material["reflectance"]), 1.0, atol=2e-3)
    assert any("D65" in c for c in report.conventions)
    blue = result_of("lambert", SPECTRAL, lambert__albedo=[0, 0, 0.9, 0, 0, 0])
    report = export(blue, "mitsuba", tmp_path / "a.json")
    material = json.loads((tmp_path / "a.json").read_text())["material"]
    assert min(_colour(material["reflectance"])) == 0.0
    assert any("gamut" in r for r in report.remarks)
    assert not report.exact


def _colour(texture: dict) -> list[float]:
    return texture.get("value") or texture["color"]


def test_without_a_file_there_is_still_a_report():
    report = export(result_of("lambert", RGB), "mitsuba")
    assert report.file is None
    assert report.exact
