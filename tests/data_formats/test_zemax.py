"""Zemax tabular BSDF: a polar grid around the specular direction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import made_up_optics as optics
import numpy as np
import pytest

import data_formats
from data_formats import Channel, Measurement, MeasurementError


@pytest.fixture
def read(tmp_path: Path):
    def read_text(text: str) -> Measurement:
        path = tmp_path / "made.bsdf"
        path.write_text(text)
        return data_formats.read(path)

    return read_text


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.mark.parametrize("kind", ["BRDF", "BTDF"])
@pytest.mark.parametrize("symmetry", ["PlaneSymmetrical", "ASymmetrical"])
def test_directions_and_values(read, kind, symmetry):
    m = read(optics.zemax(kind, symmetry))
    assert m.provenance.format == "zemax"
    assert m.valid.all()
    np.testing.assert_allclose(m.value[:, 0], optics.of(m), rtol=1e-8)
    assert m.transmitted.all() if kind == "BTDF" else not m.transmitted.any()
    assert m.symmetry == ("bilateral" if symmetry[0] == "P" else "isotropic")
    # The specular direction, or the one of direct transmission, is there once.
    for incidence in optics.INCIDENCES[1:]:
        theta = 180 - incidence if kind == "BTDF" else incidence
        there = np.isclose(np.rad2deg(m.theta_i), incidence)
        there &= np.isclose(np.rad2deg(m.theta_r), theta)
        there &= np.isclose(np.cos(m.phi_r - m.phi_i), -1)
        assert there.sum() == 1


def test_what_is_left_out_and_said(read):
    m = read(optics.zemax())
    n = {code: count for code, count in codes(m).items() if count}
    assert n == {"below-horizon-left-out": 26, "repeated-rows-left-out": 18}
    assert m.n_rows + sum(n.values()) == 3 * 7 * 6
    sentences = {note.code: note.sentence for note in m.notes}
    assert "all zero" in sentences["below-horizon-left-out"]
    assert "633 nm" in sentences["perhaps-wavelength"]
    assert m.provenance.sample == "made up, lit at 633 nm"
    assert m.provenance.header["tis"] == "0.5 0.5 0.5"
    assert [c.name for c in m.channels] == ["mono"]


def test_zeros_to_the_edge_are_masked_and_others_kept(read):
    text = optics.zemax().split("\n")
    row = text.index("TIS 0.5") + 4
    numbers = text[row].split("\t")
    # Azimuth 90 at normal incidence: radial 0, 2, 10, 40, 80 are above the horizon.
    text[row] = "\t".join([*numbers[:2], "0", numbers[3], "0", "0"])
    m = read("\n".join(text))
    assert codes(m)["edge-zeros-masked"] == 1
    masked = ~m.valid[:, 0]
    assert np.rad2deg(m.theta_r[masked]).tolist() == pytest.approx([80])
    assert (m.value[~masked, 0] == 0).sum() == 1


def test_numbers_below_the_horizon_are_said(read):
    text = optics.zemax().split("\n")
    row = text.index("TIS 0.5") + 1
    text[row] = "\t".join([*text[row].split("\t")[:-1], "7"])
    sentences = {note.code: note.sentence for note in read("\n".join(text)).notes}
    assert "1 of them are not zero" in sentences["below-horizon-left-out"]


def test_tristimulus_values(read):
    m = read(optics.zemax(content="XYZ"))
    assert [c.name for c in m.channels] == ["X", "Y", "Z"]
    np.testing.assert_allclose(m.value, optics.of(m)[:, None] * [1, 2, 3], rtol=1e-8)


def test_rotations_of_the_sample_are_azimuths_of_the_source(read):
    one = optics.zemax(symmetry="ASymmetrical4D").split("\n")
    data = one[one.index("DataBegin") + 1 : one.index("DataEnd")]
    at = one.index("SampleRotation  1")
    one[at : at + 2] = ["SampleRotation 2", "0 45"]
    text = "\n".join(one).replace("DataEnd", "\n".join([*data, "DataEnd"]))
    m = read(text)
    assert m.symmetry == "anisotropic"
    assert np.unique(np.rad2deg(m.phi_i).round(9)).tolist() == [0, 45]
    np.testing.assert_allclose(m.value[:, 0], optics.in_plane_frame(m), rtol=1e-8)
    assert codes(m)["sample-rotation"] == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("TIS 0.5", "TES 0.5", r"line 17: found 'TES'; expected TIS"),
        ("PlaneSymmetrical", "Round", r"line 3: Symmetry is 'Round'; expected one of"),
        ("\n0\n", "\nx\n", r"line 7: found 'x' among 1 angles of SampleRotation"),
        (
            "0 25 60",
            "0 25 95",
            r"angles of AngleOfIncidence from 0 to 95; expected 0",
        ),
        (
            "AngleOfIncidence  3",
            "AngleOfIncidence  0",
            r"found '0' as the number of",
        ),
        ("DataEnd", "", r"the file ends where DataEnd is expected"),
        ("DataEnd", "1 2 DataEnd", r"found '1'; expected DataEnd"),
        ("DataEnd", "DataEnd\nMonochrome", r"found 'Monochrome' after the last DataEnd"),
        ("Monochrome\nDataBegin", "TristimulusX\nDataBegin", r"expected Monochrome"),
        ("ScatterType  BRDF", "", r"found 'Monochrome'; expected one of scattertype"),
    ],
)
def test_errors(read, old, new, message):
    text = optics.zemax()
    assert old in text
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text.replace(old, new, 1))
    assert "made.bsdf" in str(caught.value)


def test_cut_short(read):
    with pytest.raises(MeasurementError, match=r"ends after \d+ of 42 values after a TIS"):
        read(optics.zemax()[:-200])


def same(again: Measurement, m: Measurement) -> None:
    """Values and masks to the last bit, angles to the rounding of the file."""
    assert (again.symmetry, again.channels) == (m.symmetry, m.channels)
    np.testing.assert_array_equal(again.value, m.value)
    np.testing.assert_array_equal(again.valid, m.valid)
    for theta, phi in (("theta_i", "phi_i"), ("theta_r", "phi_r")):
        vectors = [
            optics.unit(np.rad2deg(getattr(x, theta)), np.rad2deg(getattr(x, phi)))
            for x in (again, m)
        ]
        np.testing.assert_allclose(vectors[0], vectors[1], atol=1e-10)


@pytest.mark.parametrize(
    "options",
    [
        *[("BRDF",), ("BTDF",), ("BRDF", "ASymmetrical")],
        ("BTDF", "Asymmetrical", "XYZ"),
    ],
)
def test_what_is_written_is_what_was_read(read, tmp_path, options):
    m = read(optics.zemax(*options))
    data_formats.write(m, tmp_path / "again.bsdf")
    same(data_formats.read(tmp_path / "again.bsdf"), m)


def test_azimuths_that_do_not_begin_at_zero(read, tmp_path):
    m = read(optics.zemax(symmetry="ASymmetrical"))
    pole = np.isclose(m.theta_r, m.theta_i) & np.isclose(np.cos(m.phi_r - m.phi_i), -1)
    pole |= (m.theta_r == 0) & (m.theta_i == 0)
    half = m.select(pole | (np.sin(m.theta_r) * np.sin(m.phi_r) < -1e-9))
    data_formats.write(half, tmp_path / "again.bsdf")
    again = data_formats.read(tmp_path / "again.bsdf")
    assert again.provenance.header["scatterazimuth"] == "210 240 270 300 330"
    same(again, replace(half, symmetry="bilateral"))


def test_the_written_integral(read, tmp_path):
    """Of a matt surface it is the albedo; mirrored or not, it is the same."""
    found = []
    for symmetry in ("PlaneSymmetrical", "ASymmetrical"):
        m = read(optics.zemax(symmetry=symmetry))
        m = replace(m, value=np.full(m.value.shape, 0.4 / np.pi))
        data_formats.write(m, tmp_path / "again.bsdf")
        header = data_formats.read(tmp_path / "again.bsdf").provenance.header
        found.append([float(x) for x in header["tis"].split()])
    assert found[0] == pytest.approx(found[1], rel=1e-5)
    # The made-up grid has steps of 40 degrees.
    assert found[0] == pytest.approx([0.4] * 3, rel=0.2)


def test_what_cannot_be_written(read, tmp_path, write_astm, ramped_rows):
    m = read(optics.zemax())
    path = tmp_path / "again.bsdf"
    rgb = read(optics.zemax(content="XYZ"))
    rgb = replace(rgb, channels=tuple(map(Channel, "RGB")))
    inside = np.abs(np.rad2deg(m.theta_r) - 10) < 1e-6
    with pytest.raises(MeasurementError, match="that is wrong for 7 values"):
        data_formats.write(replace(m, valid=m.valid & ~inside[:, None]), path)
    with pytest.raises(MeasurementError, match="the channels are R"):
        data_formats.write(rgb, path)
    with pytest.raises(MeasurementError, match="reflected light alone"):
        data_formats.write(replace(m, theta_i=np.pi - m.theta_i), path)
    leds = data_formats.read(write_astm(ramped_rows[:, :5], "theta_i,phi_i,theta_s,Y"))
    with pytest.raises(MeasurementError, match="grids around the specular direction"):
        data_formats.write(leds, path)
    assert not path.exists()


REAL = {
    "AnoBlackEC1onAlum": ([10, 30, 50, 70], 706, 134, 59),
    "aeroglaze": ([10, 30, 50, 70], 716, 568, 72),
    "test_13_planesymmetric_brdf_zemax": (list(range(15, 76, 5)), 2131, 352, 88),
}


@pytest.mark.parametrize("name", REAL)
def test_real_files(real_data: Path, tmp_path, name):
    incidences, n_rows, below, masked = REAL[name]
    m = data_formats.read(real_data / f"zemax/{name}.bsdf")
    assert np.unique(np.rad2deg(m.theta_i).round(9)).tolist() == incidences
    assert (m.n_rows, (~m.valid).sum()) == (n_rows, masked)
    assert codes(m)["below-horizon-left-out"] == below
    assert codes(m)["edge-zeros-masked"] == masked
    assert (m.value[m.valid] > 0).all()
    data_formats.write(m, tmp_path / "again.bsdf")
    same(data_formats.read(tmp_path / "again.bsdf"), m)
    # Brightest in the plane of incidence, on the specular side.
    for incidence in np.unique(m.theta_i[m.theta_i > np.deg2rad(22)]):
        rows = np.flatnonzero((m.theta_i == incidence) & m.valid[:, 0])
        top = rows[np.argmax(m.value[rows, 0])]
        assert np.cos(m.phi_r[top] - m.phi_i[top]) == pytest.approx(-1)
        assert m.theta_r[top] >= incidence - 1e-9


def test_the_stated_integrals(real_data: Path):
    """TIS of the file against the values, at the incidences where little is at grazing."""
    m = data_formats.read(real_data / "zemax/test_13_planesymmetric_brdf_zemax.bsdf")
    stated = [float(x) for x in m.provenance.header["tis"].split()]
    azimuths = np.deg2rad([float(x) for x in m.provenance.header["scatterazimuth"].split()])
    for incidence, tis in zip(range(15, 36, 5), stated, strict=False):
        rows = (np.abs(np.rad2deg(m.theta_i) - incidence) < 1e-6) & m.valid[:, 0]
        wo = optics.unit(np.rad2deg(m.theta_r), np.rad2deg(m.phi_r - m.phi_i))[:, rows]
        specular = optics.unit(incidence, 180)
        off = np.arccos(np.clip(specular @ wo, -1, 1)).round(9)
        rings = np.unique(off)
        around = [np.mean((m.value[rows, 0] * wo[2])[off == ring]) for ring in rings]
        share = [(off == r).sum() / len(azimuths) if r else 1 for r in rings]
        integral = 2 * np.pi * np.trapezoid(np.sin(rings) * around * share, rings)
        assert integral == pytest.approx(tis, rel=0.1)
