"""Our readers read back what is written for tables, to the precision of the format."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import SPECTRAL, result_of
from scipy.integrate import quad

import data_formats
from fitting.export import export
from fitting.export.abg import integrated

ALBEDO = [0.5, 0.15, 0.05]


@pytest.fixture(scope="module")
def paint():
    return result_of(
        "lambert + ggx", SPECTRAL, lambert__albedo=np.linspace(0.1, 0.5, 6), ggx__alpha=0.2,
        ggx__f0=0.05,
    )  # fmt: skip


def evaluated(result, m):
    return result.evaluate(m.theta_i, m.phi_i, m.theta_r, m.phi_r)


@pytest.mark.parametrize(
    ("target", "suffix"), [("csv", ".csv"), ("hdf5", ".h5"), ("astm", ".astm")]
)
def test_our_tables(paint, tmp_path, target, suffix):
    path = tmp_path / f"paint{suffix}"
    report = export(paint, target, path)
    m = data_formats.read(path)
    np.testing.assert_allclose(m.value, evaluated(paint, m), rtol=1e-12)
    assert [c.name for c in m.channels] == [c.name for c in SPECTRAL]
    assert m.valid.all()
    assert m.symmetry == "bilateral"
    assert {n.sentence for n in m.notes} >= set(report.conventions)
    assert any("theta_i 0 to 80 in steps of 10" in c for c in report.conventions)
    assert report.residual is None
    assert not report.exact


def test_a_grid_of_ones_own(paint, tmp_path):
    export(
        paint, "csv", tmp_path / "a.csv", theta_i=(45.0,), theta_r=(0.0, 44.0, 45.0, 46.0),
        phi_r=(180.0,), channels=("550 nm",),
    )  # fmt: skip
    m = data_formats.read(tmp_path / "a.csv")
    assert m.n_rows == 4
    assert [c.name for c in m.channels] == ["550 nm"]
    np.testing.assert_allclose(np.degrees(m.theta_r), [0, 44, 45, 46], atol=1e-9)


def test_a_narrow_peak_wants_a_finer_grid(tmp_path):
    report = export(result_of("ggx", ggx__alpha=0.005), "csv", tmp_path / "a.csv")
    assert any("--theta-r" in r for r in report.remarks)


def test_transmitted_light_and_both_sides_are_in_the_table(tmp_path):
    result = result_of("lambert + lambert_transmission + lambert(back)")
    export(result, "csv", tmp_path / "a.csv")
    m = data_formats.read(tmp_path / "a.csv")
    assert m.transmitted.any()
    assert m.from_back.any()
    np.testing.assert_allclose(m.value, evaluated(result, m), rtol=1e-12)


def test_merl(tmp_path):
    """Every bin that is above the horizon, to the last digits of float64."""
    result = result_of("lambert + ggx", lambert__albedo=ALBEDO, ggx__alpha=0.3)
    report = export(result, "merl", tmp_path / "a.binary")
    assert report.residual.relative_rms < 0.1
    m = data_formats.read(tmp_path / "a.binary")
    assert m.valid.all()
    assert m.n_rows > 1_000_000
    some = m.select(np.random.default_rng(0).choice(m.n_rows, 2000, replace=False))
    np.testing.assert_allclose(some.value, evaluated(result, some), rtol=1e-9)


def test_merl_knows_no_azimuth():
    with pytest.raises(ValueError, match="azimuth of the sample"):
        export(result_of("ggx(aniso)"), "merl")


def test_zemax_of_one_wavelength(paint, tmp_path):
    report = export(paint, "zemax", tmp_path / "a.bsdf", channels=("550nm",))
    assert report.channels == ["550 nm"]
    m = data_formats.read(tmp_path / "a.bsdf")
    np.testing.assert_allclose(m.value, evaluated(paint, m)[:, 3:4], rtol=1e-9)
    # The specular direction is in the table, and beside it what shows its width.
    at = m.select(np.abs(m.theta_i - np.radians(30.0)) < 1e-9)
    mirror = np.abs(at.theta_r - at.theta_i) < 1e-9
    mirror &= np.cos(at.phi_r - at.phi_i) < -1 + 1e-9
    assert np.count_nonzero(mirror) == 1
    assert at.value[mirror] > 0.95 * at.value.max()


def test_zemax_in_colour(paint, tmp_path):
    """X Y Z of D65: the perfect diffuser has Y = 1 / pi."""
    white = result_of("lambert", SPECTRAL, lambert__albedo=1.0)
    report = export(white, "zemax", tmp_path / "a.bsdf")
    assert report.channels == ["X", "Y", "Z"]
    m = data_formats.read(tmp_path / "a.bsdf")
    np.testing.assert_allclose(
        m.value * np.pi, np.tile([0.9505, 1.0, 1.0888], (m.n_rows, 1)), atol=2e-3
    )


def test_zemax_of_transmitted_light(tmp_path):
    result = result_of("lambert + lambert_transmission", channels=SPECTRAL[:1])
    report = export(result, "zemax", tmp_path / "a.bsdf", representation="btdf")
    m = data_formats.read(tmp_path / "a.bsdf")
    assert m.transmitted.all()
    np.testing.assert_allclose(m.value, 0.3 / np.pi, rtol=1e-9)
    assert any("other ways" in r for r in report.remarks)


def lines_of(path) -> list[list[str]]:
    return [x.split("\t") for x in path.read_text().splitlines() if not x.startswith("#")]


def test_abg_of_polished_optics(tmp_path):
    """The numbers of the table, in the formula of its manual, are the fit."""
    result = result_of(
        "lambert + abg + harvey_shack", SPECTRAL[:2], lambert__albedo=[0.01, 0.02],
        abg__shoulder=0.02, abg__g=1.7, abg__b0=[3.0, 5.0], harvey_shack__slope=-2.0,
        harvey_shack__b0=0.7,
    )  # fmt: skip
    report = export(result, "abg", tmp_path / "a.txt")
    assert report.exact
    theta_i, theta_r = np.radians(20.0), np.radians(np.linspace(0, 80, 50))
    far = np.abs(np.sin(theta_r) - np.sin(theta_i))
    expected = result.evaluate(theta_i, 0.0, theta_r, np.pi)
    found = np.zeros_like(expected)
    names = [c.name for c in SPECTRAL[:2]]
    for channel, _, um, _, *numbers in lines_of(tmp_path / "a.txt"):
        a, b, g, tis = map(float, numbers)
        k = names.index(channel)
        assert float(um) * 1000 == SPECTRAL[k].wavelength_nm
        found[:, k] += a / (b + far**g)
        integral = quad(lambda x, a=a, b=b, g=g: 2 * np.pi * a / (b + x**g) * x, 0, 1)[0]
        assert tis == pytest.approx(integral, rel=1e-5)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_integrated_scatter_at_its_ends():
    assert integrated(0.2, 1.0, 0.0) == pytest.approx(0.1 * np.pi)
    assert integrated(0.2, 0.0, 1.0) == pytest.approx(0.4 * np.pi)
    assert integrated(0.2, 0.0, 2.0) == np.inf


@pytest.mark.slow
def test_abg_is_refitted(tmp_path):
    """A real refit: a Harvey-Shack skirt of another slope, close to ABg."""
    result = result_of(
        "harvey_shack", SPECTRAL[:1], harvey_shack__shoulder=0.05, harvey_shack__slope=-1.6,
        harvey_shack__b0=2.0,
    )  # fmt: skip
    report = export(result, "abg", tmp_path / "a.txt")
    assert not report.exact
    assert report.residual.relative_rms < 0.2
    assert any("refitted" in r for r in report.remarks)
    (line,) = [x for x in lines_of(tmp_path / "a.txt") if x[1] == "abg"]
    assert float(line[6]) == pytest.approx(1.6, abs=0.15)
