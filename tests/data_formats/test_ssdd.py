"""Surface scattering distribution data: three parametrisations, text and binary."""

from __future__ import annotations

from pathlib import Path

import made_up_optics as optics
import numpy as np
import pytest

import data_formats
from data_formats import Measurement, MeasurementError

HEAD = optics.SSDD_HEAD


@pytest.fixture
def read(tmp_path: Path):
    def read_bytes(content: bytes) -> Measurement:
        path = tmp_path / "made.ssdd"
        path.write_bytes(content)
        return data_formats.read(path)

    return read_bytes


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("kind", ["brdf", "btdf"])
@pytest.mark.parametrize("system", ["spherical", "specular"])
def test_directions_and_values(read, system, kind, binary):
    m = read(HEAD + optics.ssdd(system, kind, binary))
    assert m.provenance.format == "ssdd"
    assert m.provenance.sample == "made up"
    assert m.provenance.date == "2020-01-16"
    assert m.wavelengths is not None
    assert m.wavelengths.tolist() == [450, 650]
    np.testing.assert_allclose(m.value, optics.of(m)[:, None] * [1, 2], rtol=1e-6)
    assert m.transmitted.all() if kind == "btdf" else not m.transmitted.any()
    # 3 x 3 x 8, the pole of each of the three incidences once.
    below = codes(m).get("below-horizon-left-out", 0)
    assert m.n_rows == 72 - 3 * 7 - below
    assert (below > 0) == (system == "specular")


def test_reflected_and_transmitted_light_in_one_file(read):
    m = read(HEAD + optics.ssdd(binary=True) + optics.ssdd("specular", "btdf"))
    np.testing.assert_allclose(m.value, optics.of(m)[:, None] * [1, 2], rtol=1e-6)
    assert 0 < m.transmitted.sum() < m.n_rows


def test_azimuths_of_incidence(read):
    lists = "PARAM0_LIST 30\nPARAM1_LIST 0 90\nPARAM2_LIST 0 40\nPARAM3_LIST 0 120 240\n"
    text = "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\n"
    values = " ".join(map(str, range(1, 13)))
    for system in ("spherical", "specular", "half_difference"):
        kind = f"PARAM_TYPE {system}_coordinate_system\n"
        m = read(f"{text}{kind}{lists}DATA ascii\n{values}\n".encode())
        assert m.symmetry == "anisotropic"
        # Turning the sample by 90 degrees turns both directions.
        first, second = m.select(m.value[:, 0] % 2 == 1), m.select(m.value[:, 0] % 2 == 0)
        turn = second.phi_i - first.phi_i
        np.testing.assert_allclose(np.cos(turn), 0, atol=1e-12)
        # Spherical coordinates are those of the sample, not of the plane of incidence.
        turn = 0 * turn if system == "spherical" else turn
        np.testing.assert_allclose(np.cos(second.phi_r - first.phi_r - turn), 1)


def test_half_and_difference_angles(read):
    lists = "PARAM0_LIST 0 20\nPARAM2_LIST 0 30\nPARAM3_LIST 0 90\n"
    text = "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL rgb\nREDUCTION_TYPE reciprocity\n"
    kind = "PARAM_TYPE half_difference_coordinate_system\n"
    rows = "\n".join(f"{k} {k} {k}" for k in range(1, 9))
    m = read(f"{text}{kind}{lists}DATA ascii\n{rows}\n".encode())
    assert [c.name for c in m.channels] == ["R", "G", "B"]
    assert m.symmetry != "anisotropic"
    for row, k in enumerate(m.value[:, 0].astype(int) - 1):
        theta_h, theta_d, phi_d = 20 * (k & 1), 15 * (k & 2), 22.5 * (k & 4)
        wi = optics.unit(np.rad2deg(m.theta_i[row]), np.rad2deg(m.phi_i[row]))
        wo = optics.unit(np.rad2deg(m.theta_r[row]), np.rad2deg(m.phi_r[row]))
        half = (wi + wo) / np.linalg.norm(wi + wo)
        assert half[2] == pytest.approx(np.cos(np.deg2rad(theta_h)))
        assert wi @ half == pytest.approx(np.cos(np.deg2rad(theta_d)))
        # The normal's component of the difference: all of it at phi_d 0, none at 90.
        along = (wi - wo)[2] / 2
        expected = -np.sin(np.deg2rad(theta_h)) * np.sin(np.deg2rad(theta_d))
        assert along == pytest.approx(expected * np.cos(np.deg2rad(phi_d)), abs=1e-12)


def test_specular_tables_are_left_out_and_said(read):
    extra = b"DATA_TYPE specular_reflectance\nCOLOR_MODEL monochrome\n"
    extra += b"PARAM0_LIST 0 90\nDATA ascii\n0.05\n1\n"
    m = read(HEAD + optics.ssdd() + extra)
    assert codes(m)["specular-left-out"] == 1
    with pytest.raises(MeasurementError, match="neither a brdf nor a btdf"):
        read(HEAD + extra)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "DATA_TYPE brdf",
            "DATA_TYPE brdf\nSIZE 3",
            "line 5: found 'SIZE 3'; expected a key",
        ),
        (
            "COLOR_MODEL spectrum",
            "COLOR_MODEL hsv",
            "COLOR_MODEL is 'hsv'; expected one of",
        ),
        (
            "spherical_coordinate",
            "distorted_coordinate",
            "PARAM_TYPE of the brdf is 'distort",
        ),
        ("PARAM0_LIST 0 25 60", "PARAM0_LIST", "PARAM0_LIST is missing or empty"),
        ("PARAM0_LIST 0 25 60", "PARAM0_LIST 0 25 x", "'x' in PARAM0_LIST is not a number"),
        (
            "PARAM0_LIST 0 25 60",
            "PARAM0_LIST 0 25 95",
            "has 95; expected at most 90 degrees",
        ),
        ("PARAM0_LIST 0 25 60", "PARAM0_LIST 0 25", "144 values follow; expected 96"),
        ("DATA ascii", "DATA hex", "DATA is 'hex'; expected ascii or binary"),
        ("DATA ascii", "DATA binary", "bytes follow|is missing|found|horizon"),
        ("WAVELENGTH_LIST 450", "WAVELENGTH_LIST -450", "must have wavelengths in nm"),
        ("WAVELENGTH_LIST 450", "PARAM4_LIST 1\nWAVELENGTH_LIST 450", "PARAM4_LIST has 1"),
    ],
)
def test_errors(read, old, new, message):
    text = (HEAD + optics.ssdd()).decode()
    assert old in text
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text.replace(old, new, 1).encode())
    assert "made.ssdd" in str(caught.value)


def test_cut_short_and_repeated(read):
    content = HEAD + optics.ssdd(binary=True)
    with pytest.raises(MeasurementError, match=r"bytes follow; 144 values have 576"):
        read(content[:-50])
    with pytest.raises(MeasurementError, match="a table lacks its DATA"):
        read(content + b"DATA_TYPE btdf\nCOLOR_MODEL rgb\n")
    with pytest.raises(MeasurementError, match="stand in the file twice"):
        read(content + optics.ssdd())
    with pytest.raises(MeasurementError, match=r"found 'x' among 144 values"):
        read(HEAD + optics.ssdd().rstrip().rpartition(b"\t")[0] + b"\tx\n")
