"""Measured BSDF of NVIDIA's MDL: cells of theta_i, theta_r and phi."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import made_up_optics as optics
import numpy as np
import pytest

import data_formats
from data_formats import Measurement, MeasurementError


@pytest.fixture
def read(tmp_path: Path):
    def read_bytes(content: bytes) -> Measurement:
        path = tmp_path / "made.mbsdf"
        path.write_bytes(content)
        return data_formats.read(path)

    return read_bytes


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


@pytest.mark.parametrize("parts", [("",), ("REFLECTION",), ("TRANSMISSION", "REFLECTION")])
@pytest.mark.parametrize("k", [1, 3])
def test_directions_and_values(read, parts, k):
    m = read(optics.mbsdf(parts, (5, 4), k))
    assert m.provenance.format == "mbsdf"
    assert m.n_rows == len(parts) * 5 * 5 * 4
    assert [c.name for c in m.channels] == (["R", "G", "B"] if k == 3 else ["mono"])
    expected = optics.of(m)[:, None] * np.arange(1, k + 1)
    np.testing.assert_allclose(m.value, expected, rtol=1e-6)
    assert m.transmitted.sum() == 100 * ("TRANSMISSION" in parts)
    assert m.symmetry == "bilateral"
    assert m.valid.all()
    assert m.provenance.header == {"name": "made up"}


def test_copies_at_grazing_are_masked(read):
    content = bytearray(optics.mbsdf(("REFLECTION",), (5, 4), 1))
    start = content.index(b"REFLECTION=\n") + 12 + 12
    table = np.frombuffer(content[start : start + 400], "<f4").reshape(5, 5, 4).copy()
    table[4] = table[3]
    content[start : start + 400] = table.tobytes()
    m = read(bytes(content))
    assert codes(m)["copies-masked"] == 20
    assert np.rad2deg(m.theta_i[~m.valid[:, 0]]).min() == pytest.approx(81)
    # A table that is the same everywhere is one of a matt surface.
    content[start : start + 400] = np.full(100, 0.3, "<f4").tobytes()
    assert read(bytes(content)).valid.all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"NVIDIA ARC MBSDF V1", b"NVIDIA ARC MBSDF V2", "expected the line 'NVIDIA ARC"),
        (b'name="made up"', b"no metadata", "offset 20: found b'no metadata'; expected"),
        (b"TRANSMISSION=", b"REFLECTION=", "a second block of reflection; expected one"),
        (
            b"REFLECTION=\n\1",
            b"REFLECTION=\n\2",
            "offset 58: the table is of type 2 with 5",
        ),
        (b"\1\0\0\0\5\0\0\0\4", b"\1\0\0\0\xff\xff\xff\xff\4", "is the file cut short"),
    ],
)
def test_errors(read, old, new, message):
    content = optics.mbsdf()
    assert old in content
    with pytest.raises(MeasurementError, match=message) as caught:
        read(content.replace(old, new, 1))
    assert "made.mbsdf" in str(caught.value)


def test_cut_short(read):
    content = optics.mbsdf(("REFLECTION",))
    with pytest.raises(
        MeasurementError, match=r"1180 bytes are left; a table of 5 x 5 x 4 x 3"
    ):
        read(content[:-21])
    with pytest.raises(MeasurementError, match="ends before the size of the table"):
        read(content[: content.index(b"REFLECTION=\n") + 15])
    with pytest.raises(MeasurementError, match="no block of data"):
        read(b"NVIDIA ARC MBSDF V1\n")


@pytest.mark.parametrize("suffix", [".mbsdf", ".mbsdf.gz"])
@pytest.mark.parametrize("parts", [("REFLECTION",), ("REFLECTION", "TRANSMISSION")])
@pytest.mark.parametrize("k", [1, 3])
def test_what_is_written_is_what_was_read(read, tmp_path, parts, k, suffix):
    content = optics.mbsdf(parts, (5, 4), k)
    m = read(content)
    path = tmp_path / f"again{suffix}"
    data_formats.write(m, path)
    assert data_formats.read(path).equals(m)
    packed = path.read_bytes()
    assert packed.startswith(b"\x1f\x8b") == suffix.endswith(".gz")
    # But for the metadata, the same bytes.
    assert suffix.endswith(".gz") or packed == content.replace(b'name="made up"\n', b"")


def test_what_cannot_be_written(read, tmp_path, write_astm, ramped_rows):
    m = read(optics.mbsdf(("REFLECTION",), (5, 4), 1))
    path = tmp_path / "again.mbsdf"
    masked = m.valid.copy()
    masked[7] = False
    with pytest.raises(MeasurementError, match="MBSDF has no masks"):
        data_formats.write(replace(m, valid=masked), path)
    with pytest.raises(
        MeasurementError, match="99 rows would leave holes in a grid of 5 x 1"
    ):
        data_formats.write(m.select(np.arange(100) != 50), path)
    with pytest.raises(MeasurementError, match="the reflection has other angles"):
        data_formats.write(m.select(m.theta_i < 1), path)
    leds = data_formats.read(
        write_astm(ramped_rows, "theta_i,phi_i,theta_s,465nm,525nm,630nm")
    )
    with pytest.raises(MeasurementError, match="the channels are 465 nm, 525 nm, 630 nm"):
        data_formats.write(leds, path)
    assert not path.exists()


@pytest.mark.parametrize(
    ("name", "channels", "last"),
    [
        ("scalar_theta_2_phi_3", 1, [11]),
        ("reflection_scalar_theta_2_phi_3", 1, [11]),
        ("rgb_theta_2_phi_3", 3, [33, 34, 35]),
    ],
)
def test_fixtures_of_the_format(real_data: Path, name, channels, last):
    m = data_formats.read(real_data / f"mbsdf/test_{name}.mbsdf")
    assert (m.n_rows, m.n_channels) == (12, channels)
    assert m.value[-1].tolist() == last
    angles = np.rad2deg([m.theta_i, m.theta_r, m.phi_r]).T.round(9)
    # phi runs fastest, then theta_r, then theta_i.
    assert angles[[0, 2, 3, -1]].tolist() == [
        *([22.5, 22.5, 30], [22.5, 22.5, 150], [22.5, 67.5, 30], [67.5, 67.5, 150])
    ]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "file_format_error",
            "begins with b'file format error.*expected the line 'NVIDIA ARC",
        ),
        ("none", "the file has no block of data; expected one of MBSDF_DATA="),
    ],
)
def test_fixtures_that_are_refused(real_data: Path, name, message):
    with pytest.raises(MeasurementError, match=message) as caught:
        data_formats.read(real_data / f"mbsdf/test_{name}.mbsdf")
    assert "\n" not in str(caught.value)


def test_car_paint(real_data: Path, tmp_path):
    m = data_formats.read(real_data / "mbsdf/carpaint_blue.mbsdf")
    assert (m.n_rows, m.n_channels) == (45 * 45 * 90, 3)
    # 11 of 45 incidences and 4 of 45 other angles are copies of those before.
    assert codes(m)["copies-masked"] == (45 * 45 - 34 * 41) * 90
    assert (~m.valid).all(axis=1).sum() == codes(m)["copies-masked"]
    assert codes(m)["negative-values"] == np.count_nonzero(m.valid & (m.value < 0)) > 0
    # The brightest cell is the specular one, or its neighbour towards grazing.
    for incidence in np.unique(m.theta_i)[10:34:4]:
        rows = np.flatnonzero((m.theta_i == incidence) & m.valid[:, 1])
        top = rows[np.argmax(m.value[rows, 1])]
        assert np.rad2deg(m.phi_r[top] - m.phi_i[top]) == pytest.approx(179)
        assert np.rad2deg(m.theta_r[top] - incidence) == pytest.approx(2)
    data_formats.write(m, tmp_path / "again.mbsdf")
    assert data_formats.read(tmp_path / "again.mbsdf").equals(m)
    original = (real_data / "mbsdf/carpaint_blue.mbsdf").read_bytes()
    assert (tmp_path / "again.mbsdf").read_bytes() == original + b"\n"
    # It is blue.
    assert (np.median(m.value[m.valid.all(axis=1)], axis=0).argmax()) == 2
