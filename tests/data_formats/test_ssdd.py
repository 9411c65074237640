"""Surface scattering distribution data: three parametrisations, text and binary."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import made_up_optics as optics
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import data_formats
from data_formats import Channel, Measurement, MeasurementError

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


@pytest.mark.parametrize("parts", [("brdf",), ("brdf", "btdf")])
def test_what_is_written_is_what_was_read(read, tmp_path, parts):
    m = read(HEAD + b"".join(optics.ssdd(kind=kind, binary=True) for kind in parts))
    data_formats.write(m, tmp_path / "again.ssdd")
    again = data_formats.read(tmp_path / "again.ssdd")
    assert again.equals(m)
    assert again.provenance.sample == "made up"
    # The list of azimuths closes the circle, for programs that interpolate.
    assert "PARAM3_LIST 0 45 90 135 180 225 270 315 360\n" in (
        (tmp_path / "again.ssdd").read_text()
    )


def axis(most: int, least: int = 0):
    return st.lists(st.integers(least, most), min_size=1, max_size=3, unique=True)


@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    axes=st.tuples(axis(89), axis(359), axis(89, 1), axis(359)),
    channels=st.sampled_from([["mono"], ["R", "G", "B"], ["X", "Y", "Z"], [400, 512.5]]),
    turned=st.booleans(),
    behind=st.booleans(),
    seed=st.integers(0, 999),
)
def test_round_trip_of_grids(axes, channels, turned, behind, seed, tmp_path):
    grid = np.meshgrid(*([a, [0]][k == 1 and not turned] for k, a in enumerate(axes)))
    theta_i, phi_i, theta_r, phi_r = (np.deg2rad(a.ravel().astype(float)) for a in grid)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(theta_i))
    value = rng.normal(size=(len(theta_i), len(channels)))
    m = Measurement(
        theta_i=theta_i[order],
        phi_i=phi_i[order],
        theta_r=np.pi - theta_r[order] if behind else theta_r[order],
        phi_r=phi_r[order],
        value=value,
        valid=np.ones(value.shape, bool),
        channels=[Channel(c) if isinstance(c, str) else Channel.at(c) for c in channels],
        symmetry="anisotropic" if turned else "isotropic",
    )
    path = tmp_path / "again.ssdd"
    data_formats.write(m, path)
    again = data_formats.read(path)
    assert again.channels == m.channels
    keys = []
    for found in (m, again):
        angles = np.rad2deg([found.theta_i, found.phi_i, found.theta_r, found.phi_r])
        rows = zip(*np.round(angles).tolist(), found.value.tolist(), strict=True)
        keys.append({tuple(row[:4]): row[4] for row in rows})
    assert keys[0] == keys[1]
    assert again.n_rows == m.n_rows
    np.testing.assert_allclose(np.unique(again.theta_r), np.unique(m.theta_r), atol=1e-9)


def test_what_cannot_be_written(read, tmp_path):
    m = read(HEAD + optics.ssdd())
    path = tmp_path / "again.ssdd"
    with pytest.raises(MeasurementError, match="1 of 72 pairs of directions have no"):
        data_formats.write(m.select(np.arange(m.n_rows) != 5), path)
    half = m.valid.copy()
    half[3, 0] = False
    with pytest.raises(MeasurementError, match="1 rows are in some only"):
        data_formats.write(replace(m, valid=half), path)
    with pytest.raises(MeasurementError, match="the channels are a, b"):
        data_formats.write(replace(m, channels=(Channel("a"), Channel("b"))), path)
    with pytest.raises(MeasurementError, match="51 rows are lit from the back"):
        data_formats.write(replace(m, theta_i=np.pi - m.theta_i), path)
    twice = replace(m, theta_i=np.where(m.theta_i > 1, m.theta_i.max(), m.theta_i.min()))
    with pytest.raises(MeasurementError, match="repeat the directions of others"):
        data_formats.write(twice, path)
    assert not path.exists()
