"""Delimited tables with named columns, in the forms that people export."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import data_formats
from data_formats import Measurement, MeasurementError


@pytest.fixture
def read(tmp_path: Path):
    """Read a text as a `.csv` file."""

    def read_text(text: str, **options) -> Measurement:
        path = tmp_path / "made.csv"
        path.write_text(text)
        return data_formats.read(path, **options)

    return read_text


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.mark.parametrize(
    "names",
    [
        "theta_i_deg,phi_i_deg,theta_r_deg,phi_r_deg,550nm",
        "theta_i (deg),phi_i (deg),theta_s (deg),phi_s (deg),550 nm",
        "Theta_I [degrees],Phi_I [°],Theta_O deg,Phi_O deg,0.55 um",
        "theta-in,phi-in,theta-out,phi-out,550nm",
        "sza,saa,vza,vaa,brdf_550nm",
        '"src_z","src_a","view_z","view_a","550nm"',
        "# theta_i,phi_i,theta_v,phi_v,550nm",
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_names_units_and_separators(read, names, separator):
    if separator == " " and " " in names.removeprefix("# "):
        pytest.skip("blanks in the names cannot be told from the separator")
    text = f"{names}\n30,0,40,180,0.2\n30,0,20,-90,0.3\n".replace(",", separator)
    m = read(text)
    np.testing.assert_allclose(m.theta_i, np.pi / 6, rtol=1e-15)
    np.testing.assert_allclose(m.theta_r, np.deg2rad([40, 20]), rtol=1e-15)
    np.testing.assert_allclose(m.phi_r, np.deg2rad([180, -90]), rtol=1e-15)
    assert m.value.tolist() == [[0.2], [0.3]]
    assert m.channels[0].wavelength_nm == 550
    assert m.provenance.format == "csv"


def test_radians_and_mixed_units(read):
    m = read("theta_i_rad,phi_i_rad,theta_r_rad,phi_r_rad,R\n1,2,0.5,9,1\n")
    assert [m.theta_i[0], m.phi_i[0], m.theta_r[0], m.phi_r[0]] == [1, 2, 0.5, 9]
    m = read("theta_i_deg,phi_i_rad,theta_r_deg,phi_r_rad,R\n1,2,0.5,3,1\n")
    assert [m.theta_i[0], m.phi_r[0]] == [np.deg2rad(1), 3]
    m = read("theta_i,theta_r,phi_r,R\n1,1.2,3,1\n", degrees=True)
    assert m.theta_i[0] == np.deg2rad(1)


def test_decimal_comma(read):
    m = read("theta_i_deg;theta_r_deg;dphi_deg;550,5nm\n30;40;180;0,25\n30,5;40;0;1\n")
    assert m.value.tolist() == [[0.25], [1]]
    assert m.wavelengths.tolist() == [550.5]
    assert m.theta_i[1] == np.deg2rad(30.5)


def test_azimuth_difference_only(read):
    m = read("theta_i_deg,theta_r_deg,dphi_deg,brdf\n30,40,180,0.2\n30,40,90,0.1\n")
    assert m.phi_i.tolist() == [0, 0]
    assert m.phi_r.tolist() == [np.pi, np.pi / 2]
    assert "dphi-only" in codes(m)


def test_in_plane_table_with_a_signed_angle(read):
    text = " Incident_angle,Measure_angle, 450nm , 550nm\n"
    text += "".join(
        f"30,{a},{0 if -41 < a < -19 else 0.2},{0.1 * (abs(a + 30) > 10.5)}\n"
        for a in range(-80, 81, 5)
    )
    m = read(text)
    forward = m.phi_r == np.pi
    np.testing.assert_allclose(m.theta_r[forward], np.deg2rad(range(5, 81, 5)))
    assert (m.phi_r[~forward] == 0).all()
    assert codes(m)["in-plane"] == 0
    assert codes(m)["zeros-at-retro-masked"] == 5
    hidden = ~m.valid.any(axis=1)
    np.testing.assert_allclose(m.theta_r[hidden], np.deg2rad([40, 35, 30, 25, 20]))
    assert (m.phi_r[hidden] == 0).all()


def test_reflectance_factors(read):
    text = "theta_i_deg,theta_r_deg,dphi_deg,550nm,sigma\n30,40,180,0.9,0.1\n"
    assert codes(read(text))["perhaps-brf"] == 0
    m = read(text, quantity="brf")
    assert m.value[0, 0] == 0.9 / np.pi
    assert m.sigma[0, 0] == 0.1 / np.pi
    assert "brf-divided-by-pi" in codes(m)
    assert "perhaps-brf" not in codes(m)
    assert "perhaps-brf" not in codes(read(text.replace("0.9", "0.3")))
    with pytest.raises(MeasurementError, match="quantity is 'radiance'"):
        read(text, quantity="radiance")


def test_preamble_is_kept(read):
    m = read(
        "A report about theta_i and theta_r, written by hand\n"
        "SAMPLE_NAME: Tile 7\n"
        "; operator = me\n\n"
        "theta_i_deg,theta_r_deg,dphi_deg,550nm\n30,40,180,0.2\n"
    )
    assert m.provenance.sample == "Tile 7"
    assert m.provenance.header["operator"] == "me"
    assert m.provenance.header["preamble"].startswith("A report about")


def test_missing_marker(read):
    text = (
        "theta_i_deg,theta_r_deg,dphi_deg,450nm,550nm\n30,40,180,-1,0.2\n30,0,0,0.1,0.2\n"
    )
    assert read(text).value[0, 0] == -1
    m = read(text, missing=-1)
    assert m.valid.tolist() == [[False, True], [True, True]]


def test_a_given_mask(read):
    m = read("theta_i,theta_r,dphi,R,G,valid_R,valid_G\n1,1,1,3,4,1,0\n1,1,0,5,6,1,1\n")
    assert m.valid.tolist() == [[True, False], [True, True]]
    assert m.value[0, 1] == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,height\nx,3\n", "none of the first lines names the columns"),
        ("theta_i,theta_r,dphi,R\n", "no data rows after line 1"),
        ("theta_i,theta_r,dphi,height\n1,1,1,1\n", "line 1: no column is a channel"),
        ("theta_i,theta_r,dphi,R\n1,1,1,1\n1,1,1\n", "line 3: the row has 3 fields"),
        ("theta_i,theta_r,dphi,R\n1,1,1,red\n", "line 2, column R: 'red' is not a number"),
        ("theta_i,phi_i,theta_r,R\n1,1,1,1\n", "the angles found are"),
        ("theta_i_deg,theta_r_deg,dphi,R\n195,1,1,1\n", "line 2: theta_i is 195 degrees"),
        ("theta_i,theta_r,dphi,R\n1,1,1,nan\n", "none of the 1 values is valid"),
        (
            "theta_i,theta_r,dphi,550nm,550 nm\n1,1,1,1,1\n",
            "columns 4 and 5 are both 550 nm",
        ),
    ],
)
def test_errors_name_file_and_line(read, text, message):
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text)
    assert "made.csv" in str(caught.value)
