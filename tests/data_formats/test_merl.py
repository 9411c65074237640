"""MERL tables: the published look-up finds each value where the reader says it lies."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import data_formats
from data_formats import Channel, Measurement, MeasurementError

SHAPE = (3, 90, 90, 180)
SIZE = 34_992_012


def look_up(theta_i: float, phi_i: float, theta_o: float, phi_o: float) -> int:
    """Index of a pair of directions in one colour's table, by rotations step by step."""

    def turned(v, axis, angle):
        cos, sin, dot = (
            math.cos(angle),
            math.sin(angle),
            sum(a * b for a, b in zip(v, axis, strict=True)),
        )
        cross = np.cross(axis, v)
        return [v[k] * cos + axis[k] * dot * (1 - cos) + cross[k] * sin for k in range(3)]

    def unit(theta, phi):
        return np.array(
            [
                math.sin(theta) * math.cos(phi),
                math.sin(theta) * math.sin(phi),
                math.cos(theta),
            ]
        )

    wi, wo = unit(theta_i, phi_i), unit(theta_o, phi_o)
    half = (wi + wo) / np.linalg.norm(wi + wo)
    theta_h, phi_h = math.acos(min(half[2], 1)), math.atan2(half[1], half[0])
    d = turned(turned(wi, [0, 0, 1], -phi_h), [0, 1, 0], -theta_h)
    theta_d, phi_d = math.acos(min(d[2], 1)), math.atan2(d[1], d[0])
    if phi_d < 0:
        phi_d += math.pi
    i = min(int(math.sqrt(theta_h / (math.pi / 2) * 90 * 90)), 89)
    j = min(int(theta_d / (math.pi / 2) * 90), 89)
    return min(int(phi_d / math.pi * 180), 179) + 180 * (j + 90 * i)


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """Each number is its own index (plus 1, 2, 3 million), one in 97 is -1."""
    index = np.arange(90 * 90 * 180, dtype=float)
    table = np.stack([index + 1e6 * k for k in (1, 2, 3)])
    table[:, ::97] = -1
    path = tmp_path_factory.mktemp("merl") / "made_up.binary"
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + table.tobytes())
    assert path.stat().st_size == SIZE
    return path


@pytest.fixture(scope="module")
def m(file: Path) -> Measurement:
    return data_formats.read(file)


def test_the_published_look_up_finds_every_value(m):
    rows = np.random.default_rng(0).choice(m.n_rows, 400)
    for row in rows:
        angles = (m.theta_i[row], m.phi_i[row], m.theta_r[row], m.phi_r[row])
        index = look_up(*angles)
        assert m.valid[row].all() == (index % 97 != 0)
        if m.valid[row].all():
            expected = (index + 1e6 * np.array([1, 2, 3])) * [1, 1.15, 1.66] / 1500
            np.testing.assert_allclose(m.value[row], expected, rtol=1e-12)


def test_what_it_says(m):
    codes = {note.code: note.count for note in m.notes}
    assert [c.name for c in m.channels] == ["R", "G", "B"]
    assert (m.phi_i == 0).all()
    assert m.theta_i.max() < np.pi / 2 > m.theta_r.max()
    assert m.symmetry == "bilateral"
    assert m.n_rows + codes["below-horizon"] == 90 * 90 * 180
    assert codes["negative-masked"] == np.count_nonzero(~m.valid)
    assert {"bin-centres", "reciprocal-by-format", "perhaps-extrapolated"} <= set(codes)
    assert m.provenance.format == "merl"


def test_what_is_written_is_at_its_place_and_minus_one_elsewhere(m, file, tmp_path):
    rows = np.random.default_rng(1).choice(m.n_rows, 20_000, replace=False)
    few = m.select(rows)
    data_formats.write(few, tmp_path / "few.binary")
    raw = np.fromfile(tmp_path / "few.binary", "<f8", offset=12)
    original = np.fromfile(file, "<f8", offset=12)
    written = np.flatnonzero(raw != -1)
    assert len(written) == few.valid.sum()
    np.testing.assert_allclose(raw[written], original[written], rtol=1e-15)


def test_what_cannot_be_written(m, tmp_path):
    few = m.select(np.flatnonzero(m.valid.all(axis=1))[:3])
    named = tuple(map(Channel, "XYZ"))
    for bad, message in (
        (replace(few, channels=named), "holds the channels R, G, B; found X, Y, Z"),
        (replace(few, theta_i=few.theta_i + 0.01), "3 of 3 rows are elsewhere"),
        (replace(few, theta_r=np.pi - few.theta_r), "reflection from the front alone"),
        (few.select([0, 1, 1]), "two rows are in one bin"),
    ):
        with pytest.raises(MeasurementError, match=message):
            data_formats.write(bad, tmp_path / "bad.binary")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_360_azimuths(tmp_path):
    table = np.full((3, 90, 90, 360), -1.0)
    table[:, 10, 20, 200] = 1500
    path = tmp_path / "pqba.binary"
    path.write_bytes(struct.pack("<3i", 90, 90, 360) + table.tobytes())
    m = data_formats.read(path)
    assert m.symmetry == "isotropic"
    assert "reciprocal-by-format" not in {note.code for note in m.notes}
    (row,) = np.flatnonzero(m.valid.any(axis=1))
    np.testing.assert_allclose(m.value[row], [1, 1.15, 1.66])
    # Source and detector exchanged is the same bin of a table with 180 azimuths.
    there = look_up(m.theta_i[row], 0, m.theta_r[row], m.phi_r[row])
    assert there == 20 + 180 * (20 + 90 * 10)


@pytest.mark.parametrize("size", [12, 13, 1000, SIZE - 1, SIZE + 1])
def test_another_size_is_refused(size, file, tmp_path):
    path = tmp_path / "cut.binary"
    path.write_bytes((file.read_bytes() + b"\0")[:size])
    with pytest.raises(MeasurementError, match=f"has {size} bytes.*has {SIZE}") as caught:
        data_formats.read(path)
    assert str(path) in str(caught.value)


def test_other_errors(tmp_path):
    path = tmp_path / "x.binary"
    path.write_bytes(struct.pack("<3i", 45, 45, 90) + bytes(100))
    with pytest.raises(MeasurementError, match="begins with the sizes 90, 90, 180"):
        data_formats.read(path)
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + np.full(SHAPE, np.nan).tobytes())
    with pytest.raises(MeasurementError, match=r"none of the .* values is valid"):
        data_formats.read(path)
