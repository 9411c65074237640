"""E1392-style text in every dialect that was seen, and some that were not."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import data_formats
from data_formats import Measurement, MeasurementError

HEADER = "LAB_NAME Somewhere\nSAMPLE_NAME Tile\nNUM_POINTS 2\n"
VARS = "VARS theta_i,phi_i,theta_s,phi_s,450nm,550nm\n\n"
ROWS = "0.5,0,0.6,3.1,0.25,0.35\n0.5,0,0.7,-0.1,0.24,0.34\n"


@pytest.fixture
def read(tmp_path: Path):
    """Read a text, or bytes, as an `.astm` file."""

    def read_text(text: str | bytes, **options) -> Measurement:
        path = tmp_path / "made.astm"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return data_formats.read(path, **options)

    return read_text


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.fixture
def plain(read) -> Measurement:
    return read(HEADER + VARS + ROWS)


def test_plain_file(plain):
    assert plain.theta_i.tolist() == [0.5, 0.5]
    assert plain.theta_r.tolist() == [0.6, 0.7]
    assert plain.phi_r.tolist() == [3.1, -0.1]
    assert plain.value.tolist() == [[0.25, 0.35], [0.24, 0.34]]
    assert plain.wavelengths.tolist() == [450, 550]
    assert plain.valid.all()
    assert plain.notes == ()
    p = plain.provenance
    assert (p.format, p.sample, p.instrument, p.date) == ("astm", "Tile", "", "")
    assert p.header["LAB_NAME"] == "Somewhere"
    assert len(p.sha256) == 64


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t.replace("\n", "\r\n"),
        lambda t: t.replace("\n", "\r"),
        lambda t: t.rstrip("\n"),
        lambda t: "\ufeff" + t,
        lambda t: t.replace("\n\n", "\n"),
        lambda t: "\n\n  \n" + t,
        lambda t: t.replace("0.5,0,0.7", "# comment\n; more\n! and\n% more\n\n0.5,0,0.7"),
        lambda t: t.replace("Somewhere", 'Zürich\u2028, \x85 & "co"'),
        lambda t: t.replace("0.35\n", "0.35,\n").replace("0.34\n", "0.34,\n"),
        lambda t: t.replace("0.35\n", "0.35,\n"),
        lambda t: t.replace("0.35\n", "0.35\t\n"),
        lambda t: t.replace("0.35\n", "0.35  \t\n"),
        lambda t: t.replace("theta_s", "theta_r").replace("phi_s", "phi_r"),
        lambda t: t.replace("theta_s", "theta_o").replace("phi_s", "phi_v"),
        lambda t: t.replace("450nm", " 450 NM").replace("550nm", '"0.55um" \t'),
        lambda t: t.replace("0.25", "2.5D-1").replace("0.35", "+.35e0"),
        lambda t: t.replace(VARS, VARS.replace(",", " ")),
        lambda t: t.split("0.5")[0] + t[t.index("0.5") :].replace(",", " , "),
        lambda t: t.split("0.5")[0] + t[t.index("0.5") :].replace(",", "\t"),
        lambda t: t.split("0.5")[0] + t[t.index("0.5") :].replace(",", "  "),
        lambda t: t.split("0.5")[0] + t[t.index("0.5") :].replace(",", ";"),
        lambda t: (
            t.split("0.5")[0] + t[t.index("0.5") :].replace(",", ";").replace(".", ",")
        ),
        lambda t: (
            t.split("0.5")[0] + t[t.index("0.5") :].replace(",", "\t").replace(".", ",")
        ),
        lambda t: (
            t.split("0.5")[0] + t[t.index("0.5") :].replace(",", " ").replace(".", ",")
        ),
    ],
)
def test_dialects_say_the_same(read, plain, change):
    assert read(change(HEADER + VARS + ROWS)).equals(plain)


def test_latin_1_and_utf_16(read, plain):
    text = HEADER.replace("Tile", "Grün") + VARS + ROWS
    for encoding in ("latin-1", "utf-8", "utf-16"):
        again = read(text.encode(encoding), format="astm")
        assert again.equals(plain)
        assert again.provenance.sample == "Grün"


def test_header_ends_at_vars_wherever_it_stands(read, plain):
    long = "".join(f"KEY_{k} value {k}, and more\n" for k in range(50))
    again = read(long + HEADER + VARS + ROWS)
    assert again.equals(plain)
    assert again.provenance.header["KEY_49"] == "value 49, and more"


@pytest.mark.parametrize("stated", ["NUM_POINTS 7\n", "NUM_POINTS many\n", ""])
def test_wrong_row_count(read, plain, stated):
    text = HEADER.replace("NUM_POINTS 2\n", stated) + VARS + ROWS
    again = read(text)
    assert again.equals(plain)
    assert codes(again) == {"num-points": 2}
    with pytest.raises(MeasurementError, match="the file has 2 rows"):
        read(text, strict=True)


def test_three_angles(read):
    m = read("NUM_POINTS 1\nVARS theta_i,theta_s,phi_s,R,G,B\n0.1,0.2,0,1,2,3\n")
    assert (m.phi_i[0], m.phi_r[0]) == (0, 0)
    assert [c.name for c in m.channels] == ["R", "G", "B"]
    assert codes(m) == {"phi-i-absent": 0}


def test_bands(read):
    m = read("NUM_POINTS 1\nVARS theta_i,phi_i,theta_s,phi_s,X,Y,Z\n0,0,0,0,1,2,3\n")
    assert [c.name for c in m.channels] == ["X", "Y", "Z"]
    assert m.wavelengths is None
    text = "VARS theta_i,phi_i,theta_s,phi_s,Integrated [300,700]\n0,0,0,0,1\n"
    assert read(text).channels[0].name == "Integrated [300,700]"


def test_channels_are_sorted_by_wavelength(read):
    m = read("NUM_POINTS 1\nVARS theta_i,phi_i,theta_s,phi_s,0.65um,450nm\n0,0,0,0,1,2\n")
    assert m.wavelengths.tolist() == [450, 650]
    assert m.value.tolist() == [[2, 1]]
    assert codes(m) == {"channels-sorted": 0}


@pytest.mark.parametrize(
    "columns",
    ["sigma_450nm,sigma_550nm", "450nm_sigma,550nm_sigma", "sigma_450 nm,sigma_550 nm"],
)
def test_uncertainties(read, columns):
    names = VARS.strip() + f",{columns},temperature\n"
    rows = "0.5,0,0.6,3.1,0.25,0.35,0.01,0.02,21\n0.5,0,0.7,1,0.25,0.35,0.03,0.04,22\n"
    m = read(HEADER + names + rows)
    assert m.sigma.tolist() == [[0.01, 0.02], [0.03, 0.04]]
    assert m.auxiliary["temperature"].tolist() == [21, 22]


def test_one_uncertainty_for_all_channels(read):
    names = VARS.strip() + ",sigma\n"
    m = read(HEADER + names + "0.5,0,0.6,3.1,0.25,0.35,0.01\n0.5,0,0.7,1,0.2,0.3,0.02\n")
    assert m.sigma.tolist() == [[0.01, 0.01], [0.02, 0.02]]
    with pytest.raises(MeasurementError, match=r"made\.astm: sigma is not a positive"):
        read(HEADER + names + "0.5,0,0.6,3.1,0.25,0.35,0\n0.5,0,0.7,1,0.2,0.3,0.02\n")


def test_phi_s_missing_from_vars(read):
    text = "NUM_POINTS 1\nVARS theta_i,phi_i,theta_s,465nm\n0.1,3.14,0.2,3.14,7\n"
    m = read(text)
    assert (m.theta_r[0], m.phi_r[0], m.value[0, 0]) == (0.2, 3.14, 7)
    assert codes(m) == {"phi-s-inserted": 0}


def test_degrees(read, plain):
    text = HEADER + VARS + "30,0,40,180,0.25,0.35\n30,0,0,-170,0.24,0.34\n"
    m = read(text)
    np.testing.assert_allclose(m.theta_i, np.pi / 6, rtol=1e-15)
    np.testing.assert_allclose(m.phi_r, [np.pi, np.deg2rad(-170)], rtol=1e-15)
    assert "degrees-converted" in codes(m)
    with pytest.raises(MeasurementError, match="line 6"):
        read(text, degrees=False)
    assert read(HEADER + VARS + ROWS, degrees=True).theta_i[0] == np.deg2rad(0.5)


def test_one_row_beyond_the_range_is_no_unit(read):
    with pytest.raises(MeasurementError, match=r"line 8: .* cannot be radians, but most"):
        read(HEADER + VARS + ROWS + ROWS.replace("0.6", "61"))


@pytest.mark.parametrize(
    ("angle", "message"),
    [
        ("3.15,0,0.5,0", "line 6: theta_i is 180.482 degrees; expected 0 to 180"),
        ("-0.1,0,0.5,0", "line 6: theta_i is -5.72958 degrees"),
        ("0.1,0,-0.5,0", "line 6: theta_r is -28.6479 degrees; expected 0 to 180"),
        ("nan,0,0.5,0", "line 6: theta_i is not a number"),
        ("0.1,0,0.5,", "line 6: phi_r is not a number"),
        ("0.1,0,0.5,inf", "line 6: phi_r is not a number"),
        ("0.1,0,0.5,#", "line 6, column phi_s: '#' is not a number"),
        ("0.1,0,0.5,1_0", "line 6, column phi_s: '1_0' is not a number"),
    ],
)
def test_directions_must_be_usable(read, angle, message):
    with pytest.raises(MeasurementError, match=f"made.astm, {message}"):
        read(HEADER + VARS + angle + ",1,1\n" + ROWS)


def test_the_horizon_with_few_digits(read):
    m = read(HEADER + VARS + "1.571,0,1.5708,0,1,1\n1.5707963267949,0,3,0,1,1\n")
    assert m.theta_i.tolist() == [np.pi / 2, np.pi / 2]
    assert m.theta_r.tolist() == [np.pi / 2, 3]
    assert codes(m)["theta-rounded"] == 2


@pytest.mark.parametrize(
    "word", ["", "nan", "NaN", "-nan(ind)", "inf", "-1.#IND", "1.#QNAN", "n/a", " ", "---"]
)
def test_what_stands_for_no_value(read, plain, word):
    m = read(HEADER + VARS + ROWS.replace("0.34", word))
    assert codes(m) == {"not-finite-masked": 1}
    assert m.valid.tolist() == [[True, True], [True, False]]
    assert np.isnan(m.value[1, 1])
    assert (m.value[m.valid] == plain.value[m.valid]).all()


def test_negatives_and_duplicates_are_kept_and_counted(read):
    m = read("NUM_POINTS 4\n" + VARS + ROWS.replace("0.25", "-0.25") + ROWS)
    assert m.value[0, 0] == -0.25
    assert m.n_rows == 4
    assert codes(m) == {"negative-values": 1, "duplicate-directions": 2}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEADER + ROWS, "no line begins with VARS"),
        (HEADER + VARS, "no data rows after line 4"),
        (HEADER + "VARS\n" + ROWS, "line 4: VARS is followed by 0 characters"),
        (
            HEADER + VARS + ROWS + "0.1,0,0.1,0,1\n",
            "line 8: the row has 5 fields; expected 6",
        ),
        (HEADER + VARS + ROWS + "0.1,0,0.1,0,1,1,1\n", "line 8: the row has 7 fields"),
        (
            HEADER + VARS + ROWS + "a,b,c,d,e,f\n",
            "line 8, column theta_i: 'a' is not a num",
        ),
        (
            HEADER + VARS.replace("550nm", "450nm") + ROWS,
            "line 4: columns 5 and 6 are both",
        ),
        (
            HEADER + VARS.replace("550nm", "0.45um") + ROWS,
            "line 4: columns 5 and 6 are both",
        ),
        (HEADER + VARS.replace("phi_s", "phi_i") + ROWS, "phi_i and phi_i are the same"),
        (HEADER + VARS.replace("phi_s", "x") + ROWS, "the angles found are"),
        (
            HEADER + VARS.replace("450nm", "a").replace("550nm", "a") + ROWS,
            "two columns are",
        ),
        (
            HEADER + VARS.replace("450nm", "u").replace("550nm", "v") + ROWS,
            "no column is a ch",
        ),
        (
            HEADER + VARS + ROWS + "SAMPLE_NAME Other\n" + ROWS,
            "line 8: header field SAMPLE_N",
        ),
    ],
)
def test_errors_name_file_and_line(read, text, message):
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text, format="astm")
    assert "made.astm" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_valid_value(read):
    text = HEADER + VARS + "0.1,0,0.1,0,nan,inf\n0.1,0,0.1,0,,\n"
    with pytest.raises(MeasurementError, match="none of the 4 values is valid"):
        read(text)


def test_symmetry_as_seen_in_the_directions(read):
    names = "NUM_POINTS 2\nVARS theta_i,phi_i,theta_s,phi_s,R\n"
    assert read(names + "0.5,0,0.5,1,1\n0.5,0,0.5,-1,1\n").symmetry == "isotropic"
    assert read(names + "0.5,0,0.5,1,1\n0.5,0,0.5,0.5,1\n").symmetry == "bilateral"
    assert read(names + "0.5,0,0.5,1,1\n0.5,0.2,0.5,0.5,1\n").symmetry == "anisotropic"
    assert read(names + "0.5,3.14159265,0.5,1,1\n0.5,-3.14159265,1,-1,1\n").symmetry == (
        "isotropic"
    )
    assert read(names + "0,0,0.5,1,1\n0,2,0.5,-1,1\n").symmetry == "isotropic"


def test_a_damaged_description_is_said(read, plain, tmp_path):
    data_formats.write(plain, tmp_path / "own.astm")
    text = (tmp_path / "own.astm").read_text()
    with pytest.raises(MeasurementError, match="description of the measurement is damaged"):
        read(text.replace('"symmetry"', '"symmetrie"'))
    with pytest.raises(MeasurementError, match="description of the measurement is damaged"):
        read(text.replace("MEASUREMENT_JSON {", "MEASUREMENT_JSON " + "[" * 100_000))


def test_reading_is_fast(write_astm, ramped_rows):
    rows = np.tile(ramped_rows, (20, 1))
    path = write_astm(rows, "theta_i,phi_i,theta_s,phi_s,465nm,525nm,630nm")
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        data_formats.read(path)
        best = min(best, time.perf_counter() - start)
    assert len(rows) > 10_000
    assert best < 0.5
