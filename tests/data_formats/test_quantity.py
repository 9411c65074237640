"""Whether values are factors or per steradian, as headers say and do not say it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import data_formats
from data_formats import Measurement, MeasurementError

ROWS = "30,40,180,0.9\n30,20,0,0.8\n"


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.fixture
def read(tmp_path: Path):
    """Read a table with some lines before it and a column of values called `name`."""

    def read_table(header: str, name: str = "550nm", **options) -> Measurement:
        path = tmp_path / "made.csv"
        path.write_text(f"{header}\ntheta_i_deg,theta_r_deg,dphi_deg,{name}\n{ROWS}")
        return data_formats.read(path, **options)

    return read_table


FACTORS = [
    ("BRF Values", "550nm"),
    ("brf", "550nm"),
    ("Quantity: BRF", "550nm"),
    ("# values are bidirectional reflectance factors (BRF)", "550nm"),
    ("Spectral radiance factor at 45/0", "550nm"),
    ("units = reflectance factor", "550nm"),
    ("Reflectance-Factor", "550nm"),
    ("BRF Values\nusing C:\\data\\BRDF\\calc_v6.m", "550nm"),
    ("BRF Values\nrelative to the NIST reference panel", "550nm"),
    ("", "brf"),
    ("", "BRF_550nm"),
    ("", "radiance_factor"),
    # A column says it better than a title.
    ("BRDF measurement", "brf_550nm"),
]


@pytest.mark.parametrize(("header", "name"), FACTORS)
def test_factors_are_divided_by_pi(read, header, name):
    m = read(header, name)
    np.testing.assert_array_equal(m.value[:, 0], np.array([0.9, 0.8]) / np.pi)
    assert "brf-divided-by-pi" in codes(m)
    assert "perhaps-brf" not in codes(m)
    assert not m.transmitted.any()
    assert m.channels[0].name in ("550 nm", "brdf")
    kept = read(header, name, quantity="brdf")
    assert kept.value[:, 0].tolist() == [0.9, 0.8]
    assert not {"brf-divided-by-pi", "perhaps-brf"} & set(codes(kept))


@pytest.mark.parametrize(
    ("header", "name"),
    [
        ("BRDF values", "550nm"),
        ("quantity: BRDF", "550nm"),
        ("MEAS_NAME: BRDF", "550nm"),
        ("BSDF, BRDFs and xBRFy", "550nm"),
        ("", "brdf"),
        ("", "brdf_550nm"),
        ("BRFiend", "550nm"),
        ("C:\\BRF\\BRF.txt /data/brf/x", "550nm"),
        ("reflectance distribution function", "550nm"),
    ],
)
def test_brdf_never_triggers_it(read, header, name):
    m = read(header, name)
    assert m.value[:, 0].tolist() == [0.9, 0.8]
    assert "brf-divided-by-pi" not in codes(m)
    # The numbers alone still raise the question.
    assert "perhaps-brf" in codes(m)
    assert "Most values exceed" in next(n.sentence for n in m.notes if "brf" in n.code)


@pytest.mark.parametrize(
    ("header", "name"),
    [
        ("BRF was converted to BRDF", "550nm"),
        ("BRDF in 1/sr; BRF of the white tile 0.99", "550nm"),
        ("Reference panel: BRF 0.99", "550nm"),
        ("not a reflectance factor", "550nm"),
        ("SAMPLE_NAME: BRF standard", "550nm"),
        ("BRF Values", "brdf_550nm"),
        ("quantity: reflectance", "550nm"),
    ],
)
def test_what_is_open_is_asked(read, header, name):
    m = read(header, name)
    assert m.value[:, 0].tolist() == [0.9, 0.8]
    assert "brf-divided-by-pi" not in codes(m)
    note = next(n for n in m.notes if n.code == "perhaps-brf")
    assert "quantity='brf' divides them by pi" in note.sentence
    assert "The file speaks of" in note.sentence


@pytest.mark.parametrize(
    ("header", "name", "options"),
    [
        ("Transmittance factor values", "550nm", {}),
        ("quantity: transmittance factor", "550nm", {}),
        ("", "transmittance_factor", {}),
        ("", "550nm", {"quantity": "btf"}),
        ("quantity: BRF", "550nm", {"side": "transmitted"}),
    ],
)
def test_transmittance_factors(read, header, name, options):
    m = read(header, name, **options)
    np.testing.assert_array_equal(m.value[:, 0], np.array([0.9, 0.8]) / np.pi)
    np.testing.assert_allclose(np.rad2deg(m.theta_r), [140, 160])
    assert {"brf-divided-by-pi", "folded-transmission"} <= set(codes(m))
    assert "transmittance factors" in next(n.sentence for n in m.notes if "brf" in n.code)


def test_transmittance_in_one_word_is_asked_about(read):
    m = read("quantity: transmittance")
    assert m.transmitted.all()
    assert m.value[0, 0] == 0.9
    assert "quantity='btf'" in next(n.sentence for n in m.notes if n.code == "perhaps-brf")


def test_astm_headers_say_it_too(write_astm):
    rows = np.array([[0.5, 0, 0.6, np.pi, 0.9]])
    names = "theta_i,phi_i,theta_s,phi_s,550nm"
    m = data_formats.read(write_astm(rows, names, ("MEAS_NAME BRF",)))
    assert m.value[0, 0] == 0.9 / np.pi
    for meas_name, options in (("BRDF", {}), ("BRF", {"quantity": "bsdf"})):
        path = write_astm(rows, names, (f"MEAS_NAME {meas_name}",))
        assert data_formats.read(path, **options).value[0, 0] == 0.9
    path = write_astm(rows, names, ("MEAS_NAME BRDF",))
    assert data_formats.read(path, quantity="brf").value[0, 0] == 0.9 / np.pi


@pytest.mark.parametrize("suffix", [".astm", ".csv"])
@pytest.mark.parametrize(
    ("header", "name"), [*FACTORS, ("MEAS_NAME: BRF", "550nm"), ("LAB_COMMENTS: BRF", "R")]
)
def test_what_was_divided_is_not_divided_again(read, header, name, suffix, tmp_path):
    """Not even without the line that only this program understands."""
    m = read(header, name)
    path = tmp_path / f"again{suffix}"
    data_formats.write(m, path)
    assert data_formats.read(path).equals(m)
    path.write_text(re.sub(r"(?m)^.*MEASUREMENT_JSON.*\n", "", path.read_text()))
    assert data_formats.read(path).equals(m)


def test_options_are_checked(read):
    with pytest.raises(MeasurementError, match="quantity is 'x'; expected one of 'bsdf'"):
        read("", quantity="x")
