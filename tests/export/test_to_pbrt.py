"""pbrt-v4 has no wheel: the syntax is checked against its grammar, and the numbers by
evaluating the materials of the file with formulas written out here."""

from __future__ import annotations

import numpy as np
import pbrt_grammar
import pytest
from made_up import RGB, SPECTRAL, WAVELENGTHS, directions, geometry_of, result_of

from fitting.export import export
from fitting.model import Model
from fitting.predict import predict_geometry

ALBEDO = [0.5, 0.3, 0.05]


def conductor(c, eta, k):
    """Unpolarised reflectance by complex arithmetic."""
    n = eta + 1j * k
    t = np.sqrt(n * n - (1 - c * c))
    rs = (c - t) / (c + t)
    rp = (n * n * c - t) / (n * n * c + t)
    return 0.5 * (abs(rs) ** 2 + abs(rp) ** 2)


def value(materials, name, wi, wo) -> np.ndarray:
    """BRDF ``(n, 3)`` of a material of a file, as pbrt-v4 is documented to compute it."""
    m = materials[name]
    get = {n: np.asarray(v[1]) for n, v in m.parameters.items()}
    if m.kind == "mix":
        first, second = m.parameters["materials"][1]
        amount = float(get["amount"][0])
        return (1 - amount) * value(materials, first, wi, wo) + amount * value(
            materials, second, wi, wo
        )
    if m.kind == "diffuse":
        return np.broadcast_to(get["reflectance"] / np.pi, (len(wi), 3))
    assert m.kind == "conductor"
    assert not get["remaproughness"][0]
    ax = float(get.get("uroughness", get.get("roughness"))[0])
    ay = float(get.get("vroughness", get.get("roughness"))[0])
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)

    def lam(w):
        tan2 = ((w[:, 0] * ax) ** 2 + (w[:, 1] * ay) ** 2) / w[:, 2] ** 2
        return 0.5 * (np.sqrt(1 + tan2) - 1)

    e = ((h[:, 0] / ax) ** 2 + (h[:, 1] / ay) ** 2) / h[:, 2] ** 2
    d = 1 / (np.pi * ax * ay * h[:, 2] ** 4 * (1 + e) ** 2)
    g = 1 / (1 + lam(wi) + lam(wo))
    c = np.sum(wi * h, axis=1)[:, None]
    shared = (d * g / (4 * wi[:, 2] * wo[:, 2]))[:, None]
    return shared * conductor(c, get["eta"], get["k"])


EXACT = {
    "lambert": {"lambert__albedo": ALBEDO},
    "lambert + ggx(conductor)": {
        "lambert__albedo": [0.2, 0.1, 0.0], "ggx__alpha": 0.2, "ggx__eta": 0.2,
        "ggx__k": 3.0, "ggx__scale": 0.7,
    },
    "ggx(aniso, dielectric)": {"ggx__alpha_x": 0.1, "ggx__alpha_y": 0.3, "ggx__angle": 0.0},
}  # fmt: skip


@pytest.mark.parametrize("expression", EXACT)
def test_exact_models(tmp_path, expression):
    result = result_of(expression, **EXACT[expression])
    report = export(result, "pbrt", tmp_path / "paint.pbrt")
    assert report.exact
    materials = pbrt_grammar.parse((tmp_path / "paint.pbrt").read_text())
    assert list(materials)[-1] == "paint"
    wi, wo = (w.astype(float) for w in directions(1))
    expected = predict_geometry(Model(result.model), result.values, geometry_of(wi, wo))
    got = value(materials, "paint", wi, wo)
    np.testing.assert_allclose(got, expected, rtol=1e-6)


def test_a_gloss_over_a_bright_base_ends_at_what_is_left(tmp_path):
    """Weights add up to 1, and the largest deviation is towards grazing."""
    result = result_of("lambert + ggx", lambert__albedo=ALBEDO, ggx__alpha=0.1)
    report = export(result, "pbrt", tmp_path / "paint.pbrt", representation="mix")
    assert not report.exact
    assert report.residual.theta_i_deg > 60
    assert any("towards grazing" in r for r in report.remarks)
    materials = pbrt_grammar.parse((tmp_path / "paint.pbrt").read_text())
    wi, wo = (w.astype(float) for w in directions(2, lowest=0.7))
    expected = predict_geometry(Model(result.model), result.values, geometry_of(wi, wo))
    np.testing.assert_allclose(value(materials, "paint", wi, wo), expected, rtol=0.05)


def test_plastic_is_coated_diffuse(tmp_path):
    result = result_of(
        "interfaced_lambert + ggx(dielectric)", interfaced_lambert__albedo=ALBEDO
    )
    report = export(result, "pbrt", tmp_path / "paint.pbrt")
    assert report.residual.relative_rms < 1e-9
    materials = pbrt_grammar.parse((tmp_path / "paint.pbrt").read_text())
    found = materials["paint"]
    assert found.kind == "coateddiffuse"
    assert found.parameters["eta"] == ("float", [1.5])
    assert found.parameters["roughness"] == ("float", [0.2])
    assert any("walks at random" in r for r in report.remarks)


def test_both_sides_and_spectra(tmp_path):
    result = result_of(
        "lambert + lambert_transmission", SPECTRAL,
        lambert__albedo=np.linspace(0.1, 0.4, 6), lambert_transmission__transmittance=0.3,
    )  # fmt: skip
    report = export(result, "pbrt", tmp_path / "leaf.pbrt", spectral=True)
    assert report.exact
    found = pbrt_grammar.parse((tmp_path / "leaf.pbrt").read_text())["leaf"]
    assert found.kind == "diffusetransmission"
    kind, numbers = found.parameters["reflectance"]
    assert kind == "spectrum"
    assert numbers[2:-2:2] == list(WAVELENGTHS)
    np.testing.assert_allclose(numbers[3:-2:2], np.linspace(0.1, 0.4, 6))


@pytest.mark.slow
def test_another_lobe_is_refitted(tmp_path):
    result = result_of("phong", RGB, phong__exponent=40.0)
    report = export(result, "pbrt", tmp_path / "a.pbrt", representation="coateddiffuse")
    assert any("refitted" in r for r in report.remarks)
    pbrt_grammar.parse((tmp_path / "a.pbrt").read_text())
