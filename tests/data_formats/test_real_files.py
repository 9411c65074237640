"""Facts about measured files of others, which are not part of the project."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import data_formats
from data_formats import Measurement

CORNELL = ["acryl_blue", "cayman", "garnet_red", "krylon_blue"]
MINIDIFF = [
    *["C10_Copper", "C14_NavyBlue", "C1_White", "C2_Black", "C3_Red", "C8_Silver"],
    *["C9_Gold", "Char_Pink", "Metal_Blue", "Metal_Red"],
]


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def specular_offsets(m: Measurement, channel: int) -> list[float]:
    """|phi_r - phi_i| of the brightest row of each oblique incidence, in degrees."""
    offsets = []
    for incidence in np.unique(np.round(m.theta_i, 4)):
        rows = np.flatnonzero((np.abs(m.theta_i - incidence) < 1e-3) & m.valid[:, channel])
        if incidence > 0.3:
            top = rows[np.argmax(m.value[rows, channel])]
            cosine = np.cos(m.phi_r[top] - m.phi_i[top])
            offsets.append(float(np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))))
    return offsets


@pytest.mark.parametrize("name", CORNELL)
def test_cornell_spectral(real_data: Path, name):
    m = data_formats.read(real_data / f"cornell/{name}.astm")
    assert (m.n_rows, m.n_channels) == (1439, 31)
    assert m.wavelengths.tolist() == list(range(400, 701, 10))
    assert m.valid.all(axis=1).sum() == m.valid.any(axis=1).sum() == 1435
    assert codes(m)["cornell-shadow-masked"] == 4
    assert m.symmetry == "bilateral"
    assert (m.value >= 0).all()
    assert codes(m)["clamped-zeros"] == np.count_nonzero(m.value == 0)
    assert m.provenance.instrument == "Cornell/Kodak gonioreflectometer"
    assert specular_offsets(m, 15) == pytest.approx([180] * 7, abs=1e-3)


def test_cornell_counts_of_garnet_red(real_data: Path):
    m = data_formats.read(real_data / "cornell/garnet_red.astm")
    incidences, rows = np.unique(np.round(np.rad2deg(m.theta_i)), return_counts=True)
    assert incidences.tolist() == [10, 20, 30, 40, 50, 60, 70, 80]
    assert rows.tolist() == [178, 179, 179, 180, 181, 180, 180, 182]
    assert "cornell-noisy-blue" in codes(m)
    assert m.provenance.sample == "Garnet Red"
    assert m.provenance.date == ""


@pytest.mark.parametrize("name", ["garnet_red", "krylon_blue"])
def test_cornell_rgb_keeps_negatives(real_data: Path, name):
    m = data_formats.read(real_data / f"cornell/{name}_RGB.astm")
    assert (m.n_rows, m.n_channels) == (1439, 3)
    assert [c.name for c in m.channels] == ["R", "G", "B"]
    assert m.valid.all(axis=1).sum() == 1435
    assert codes(m)["negative-values"] == {"garnet_red": 222, "krylon_blue": 943}[name]


@pytest.mark.parametrize("name", ["garnet_red", "krylon_blue"])
def test_one_material_in_two_containers(real_data: Path, name):
    astm = data_formats.read(real_data / f"cornell/{name}.astm")
    pbrt = data_formats.read(real_data / f"pbrt/{name}.brdf")
    assert pbrt.provenance.format == "pbrt"
    assert pbrt.equals(astm)
    assert pbrt.notes == astm.notes


@pytest.mark.parametrize("name", MINIDIFF)
def test_minidiff(real_data: Path, name):
    m = data_formats.read(real_data / f"minidiff/{name}.astm")
    assert (m.n_rows, m.n_channels) == (12964, 3)
    assert m.wavelengths.tolist() == [465, 525, 630]
    assert m.valid.all(axis=1).sum() == m.valid.any(axis=1).sum() == 10804
    assert m.theta_r[m.valid.any(axis=1)].max() == pytest.approx(np.deg2rad(75))
    assert codes(m)["ramp-masked"] == 2160
    assert codes(m)["phi-s-inserted"] == 0
    assert m.symmetry == "isotropic"
    np.testing.assert_allclose(m.phi_i, np.pi)
    assert specular_offsets(m, 1) == pytest.approx([180] * 3, abs=10.1)


def test_in_plane_table(real_data: Path):
    m = data_formats.read(real_data / "csv/test_brdf_viewer_2D_data.csv")
    assert (m.n_rows, m.n_channels) == (329, 35)
    assert (m.wavelengths[0], m.wavelengths[-1]) == (390, 730)
    assert m.valid.all(axis=1).sum() == 303
    assert codes(m)["zeros-at-retro-masked"] == 26
    assert "perhaps-brf" in codes(m)
    assert specular_offsets(m, 10) == pytest.approx([180] * 4)
    brf = data_formats.read(real_data / "csv/test_brdf_viewer_2D_data.csv", quantity="brf")
    np.testing.assert_array_equal(brf.value, m.value / np.pi)


def test_reflectance_factor_table(real_data: Path):
    path = real_data / "csv/20250210_S7_sample_final.txt"
    m = data_formats.read(path)
    assert (m.n_rows, m.n_channels) == (19, 11)
    assert m.wavelengths[0] == 385.65
    assert m.valid.all()
    assert np.median(m.value) * np.pi == pytest.approx(1.0, abs=0.05)
    assert codes(m)["duplicate-directions"] == 1
    assert "brf-divided-by-pi" in codes(m)
    assert "perhaps-brf" not in codes(m)
    assert data_formats.read(path, quantity="brf").equals(m)
    as_brdf = data_formats.read(path, quantity="brdf")
    assert not {"brf-divided-by-pi", "perhaps-brf"} & set(codes(as_brdf))
    np.testing.assert_array_equal(as_brdf.value / np.pi, m.value)
    assert "BRF Values" in m.provenance.header["preamble"]


@pytest.mark.parametrize("suffix", [".astm", ".csv", ".h5"])
@pytest.mark.parametrize(
    "name",
    ["cornell/krylon_blue_RGB.astm", "minidiff/C2_Black.astm", "pbrt/garnet_red.brdf"],
)
def test_conversion_loses_nothing(real_data: Path, tmp_path, name, suffix):
    m = data_formats.read(real_data / name)
    data_formats.write(m, tmp_path / f"m{suffix}")
    again = data_formats.read(tmp_path / f"m{suffix}")
    assert again.equals(m)
    assert (again.notes, again.provenance) == (m.notes, m.provenance)


def test_speed(real_data: Path):
    path = real_data / "minidiff/C2_Black.astm"
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        data_formats.read(path)
        best = min(best, time.perf_counter() - start)
    assert best < 0.3
