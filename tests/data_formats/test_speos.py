"""Speos / OPTIS text: tables of theta by phi, proportional to a BSDF."""

from __future__ import annotations

from pathlib import Path

import made_up_optics as optics
import numpy as np
import pytest

import data_formats
from data_formats import Measurement, MeasurementError


@pytest.fixture
def read(tmp_path: Path):
    def read_text(text: str, **options) -> Measurement:
        path = tmp_path / "made.anisotropicbsdf"
        path.write_text(text)
        return data_formats.read(path, **options)

    return read_text


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.mark.parametrize("flags", [(1, 0), (0, 1), (1, 1)])
def test_directions_and_values(read, flags):
    m = read(optics.speos(flags, factor=3))
    assert m.provenance.format == "speos"
    shown = m.valid[:, 0]
    np.testing.assert_allclose(m.value[shown, 0], 3 * optics.of(m)[shown], rtol=1e-8)
    sides = sum(flags)
    # 12 azimuths and 360 degrees, and one pole; the horizon belongs to both sides.
    once, stored = 3 * (3 * 12 + 1), 3 * 4 * 13
    horizon = 3 * 12 if sides == 2 else 0
    assert m.n_rows == sides * once - horizon
    assert codes(m)["repeated-rows-left-out"] == sides * (stored - once) + horizon
    assert codes(m)["edge-zeros-masked"] == (~shown).sum() == 3 * 4
    assert m.transmitted.sum() == flags[1] * 3 * (2 * 12 + 1)
    assert "only-proportional" in codes(m)
    assert m.provenance.header["description"] == "Two lines of text."
    assert m.provenance.header["anisotropy vector"] == "0 1 0"


def test_scale_on_request(read):
    as_written = read(optics.speos((1, 0), percent=20))
    scaled = read(optics.speos((1, 0), percent=20), scale="stated")
    ratio = scaled.value[as_written.valid] / as_written.value[as_written.valid]
    np.testing.assert_allclose(ratio, ratio[0])
    assert "scaled" in codes(scaled)
    assert "only-proportional" not in codes(scaled)
    rows = np.abs(np.rad2deg(scaled.theta_i) - 25) < 1e-9
    value = np.where(scaled.valid, scaled.value, 0.0)[rows, 0]
    theta = np.rad2deg(scaled.theta_r)[rows].round(6)
    # Trapezoids of 30 degrees in theta; the mean over phi, as phi has equal steps.
    rings = np.array([value[theta == t].mean() for t in (0, 30, 60, 90)])
    weight = np.sin(np.deg2rad([0, 30, 60, 90])) * np.cos(np.deg2rad([0, 30, 60, 90]))
    integral = 2 * np.pi * np.trapezoid(rings * weight, dx=np.pi / 6)
    assert integral == pytest.approx(0.2, rel=1e-9)


def test_intensities_are_divided_by_the_cosine(read):
    lines = optics.speos((1, 0)).split("\n")
    lines[8] = "0"
    m = read("\n".join(lines))
    bsdf = read(optics.speos((1, 0)))
    # Next to the horizon a cosine is not divided by.
    seen = m.valid[:, 0]
    assert np.rad2deg(m.theta_r[seen]).max() == pytest.approx(60)
    both = seen & bsdf.valid[:, 0]
    cosine = np.cos(m.theta_r[both])
    np.testing.assert_allclose(m.value[both, 0] * cosine, bsdf.value[both, 0])
    assert "cosine-divided" in codes(m)


def test_anisotropy_angles(read):
    lines = optics.speos((1, 0)).split("\n")
    at = lines.index("1", 9)
    counts = lines[at + 2 : at + 4]
    lines[at : at + 4] = ["2", "0 30", *counts, *counts]
    tables = lines[lines.index("850\t25") + 1 : lines.index("End of file")]
    m = read("\n".join(lines).replace("End of file", "\n".join(tables)))
    assert m.symmetry == "anisotropic"
    assert np.unique(np.rad2deg(m.phi_i).round(9)).tolist() == [150, 180]
    # The plane of incidence turns, and the scattered directions with it.
    seen = m.valid[:, 0]
    wi = optics.unit(np.rad2deg(m.theta_i), 180.0)
    wo = optics.unit(np.rad2deg(m.theta_r), np.rad2deg(m.phi_r - m.phi_i) + 180)
    np.testing.assert_allclose(m.value[seen, 0], 3 * optics.bsdf(wi, wo)[seen], rtol=1e-8)


def test_spectral_file(tmp_path):
    path = tmp_path / "made.brdf"
    path.write_text(optics.speos_spectral())
    m = data_formats.read(path)
    assert m.provenance.format == "speos"
    assert m.wavelengths is not None
    assert m.wavelengths.tolist() == [450, 650]
    np.testing.assert_allclose(m.value, optics.of(m)[:, None] * [0.7, 1.4], rtol=1e-8)
    scaled = data_formats.read(path, scale="stated")
    np.testing.assert_allclose(scaled.value[:, 1], 2 * scaled.value[:, 0], rtol=1e-7)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("v8.0\n0", "v8.0\n1", "line 2: this is a binary file of Speos, which is not read"),
        (
            "v8.0",
            "v6.0",
            "expected an OPTIS anisotropic BSDF or brdf surface file of version",
        ),
        ("Anisotropic BSDF", "Coated", "the file begins with 'OPTIS - Coated surface file"),
        ("1\t0\n1\n", "0\t0\n1\n", "line 8: the file says that it holds no data"),
        ("1\t0\n1\n", "1\t0\n7\n", "line 9: the type of values is 7; expected 1 or 0"),
        ("0\t25\t60", "0\t25", r"line 13: found 2 words, '0 25'; expected incidences, 3"),
        ("0\t25\t60", "0\t25\t99", "line 13: incidences from 0 to 99; expected at most 90"),
        ("4 13", "5 13", r"expected theta and the values of a table, 14 numbers"),
        (
            "4 13",
            "0 13",
            r"the numbers of theta and phi is \[0\.0, 13\.0\]; expected whole",
        ),
        (
            "\n30\t",
            "\n130\t",
            "theta is 130 degrees in a table of reflection; expected 0 to",
        ),
        ("End of file", "1 2 3", "found '1 2 3' after the last table"),
    ],
)
def test_errors(read, old, new, message):
    text = optics.speos((1, 0))
    assert old in text
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text.replace(old, new, 1))
    assert "made.anisotropicbsdf" in str(caught.value)


def test_other_errors(read, tmp_path):
    text = optics.speos((1, 0))
    with pytest.raises(MeasurementError, match="the file ends where"):
        read(text[: len(text) // 2].rpartition("\n")[0])
    with pytest.raises(
        MeasurementError, match=r"scale is 'big'; expected one of 'as-written'"
    ):
        read(text, scale="big")
    with pytest.raises(MeasurementError, match="do not give a scale"):
        read(text.replace("350\t25", "350\t20"), scale="stated")
    path = tmp_path / "binary.brdf"
    path.write_bytes(b"OPTIS - brdf surface file v9.0\n1\n" + bytes(range(256)))
    with pytest.raises(MeasurementError, match="this is a binary file of Speos"):
        data_formats.read(path)


def test_real_file_is_proportional_to_the_same_sample_in_zemax(real_data: Path):
    name = "test_13_planesymmetric_brdf"
    path = real_data / f"speos/{name}_speos_reference.anisotropicbsdf"
    speos = data_formats.read(path)
    zemax = data_formats.read(real_data / f"zemax/{name}_zemax.bsdf")
    incidences = np.arange(15, 76, 5)
    assert np.unique(np.rad2deg(speos.theta_i).round(6)).tolist() == incidences.tolist()
    assert speos.n_rows == 13 * (18 * 36 + 1)
    assert "only-proportional" in codes(speos)
    found: list[dict] = []
    for m in (speos, zemax):
        x, y, z = optics.unit(np.rad2deg(m.theta_r), np.rad2deg(m.phi_r - m.phi_i))
        incidence = np.rad2deg(m.theta_i).round(6)
        keys = zip(incidence, x.round(6), abs(y).round(6), z.round(6), strict=True)
        usable = zip(keys, m.valid[:, 0], m.value[:, 0], strict=True)
        found.append({k: value for k, valid, value in usable if valid})
    both = found[0].keys() & found[1].keys()
    assert len(both) > 180
    # One factor per incidence, to the last digit, at all directions that both have.
    for incidence in incidences:
        ratio = [found[0][k] / found[1][k] for k in both if k[0] == incidence]
        assert len(ratio) >= 10
        np.testing.assert_allclose(ratio, np.median(ratio), rtol=1e-9)
    scaled = data_formats.read(path, scale="stated")
    factor = scaled.value[scaled.valid].max() / speos.value[speos.valid].max()
    # The writer of this file left out a division by pi.
    assert factor == pytest.approx(1 / np.pi, rel=1e-3)
