"""UTIA tables: each number is where the published index says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import data_formats
from data_formats import MeasurementError

SIZE = 1_990_656


@pytest.fixture
def file(tmp_path: Path) -> Path:
    numbers = np.arange(3 * 288 * 288, dtype=float) / 1000
    numbers[5] = -0.25
    path = tmp_path / "made_up.bin"
    path.write_bytes(numbers.tobytes())
    assert path.stat().st_size == SIZE
    return path


def test_every_number_is_at_its_directions(file):
    m = data_formats.read(file)
    assert m.provenance.format == "utia"
    it_i, ip_i, it_v, ip_v = (
        np.rint(np.rad2deg(angle) / step).astype(int)
        for angle, step in (
            (m.theta_i, 15),
            (m.phi_i, 7.5),
            (m.theta_r, 15),
            (m.phi_r, 7.5),
        )
    )
    index = 288 * (48 * it_i + ip_i) + 48 * it_v + ip_v
    for plane in range(3):
        expected = (index + plane * 288 * 288) / 1000
        expected[index + plane * 288 * 288 == 5] = -0.25
        np.testing.assert_array_equal(m.value[:, plane], expected)
    assert (it_i.max(), ip_i.max(), m.n_rows) == (5, 47, 82_944)
    assert m.symmetry == "anisotropic"
    codes = {note.code: note.count for note in m.notes}
    assert codes["negative-values"] == 1
    assert "scale-uncertain" in codes
    assert m.valid.all()


def test_scale_and_decoding(file):
    plain = data_formats.read(file)
    scaled = data_formats.read(file, scale=100 / 140)
    np.testing.assert_allclose(scaled.value, plain.value * 100 / 140, rtol=1e-15)
    decoded = data_formats.read(file, decode="srgb")
    # Colour 128 of 255 is 21.6 % of white (IEC 61966-2-1); the straight part is x / 12.92.
    at = np.argmin(np.abs(plain.value[:, 0] - 0.502))
    assert decoded.value[at, 0] == pytest.approx(0.2158, abs=2e-4)
    assert decoded.value[5, 0] == pytest.approx(-0.25 / 12.92)
    for options in ({"decode": "gamma"}, {"scale": 0}, {"scale": "x"}):
        with pytest.raises(MeasurementError, match=r"made_up\.bin: (?:decode|scale) is"):
            data_formats.read(file, **options)


def test_what_is_not_finite_is_masked(file):
    numbers = np.fromfile(file)
    numbers[[9000, 90_000]] = np.nan, np.inf
    file.write_bytes(numbers.tobytes())
    m = data_formats.read(file)
    assert np.count_nonzero(~m.valid) == 2
    assert "not-finite-masked" in {note.code for note in m.notes}
    file.write_bytes(np.full(SIZE // 8, np.nan).tobytes())
    with pytest.raises(MeasurementError, match="none of the 248832 values is valid"):
        data_formats.read(file)


@pytest.mark.parametrize("size", [SIZE - 1, SIZE + 1, 70_000, 100])
def test_another_size_is_refused(size, file):
    file.write_bytes((file.read_bytes() + b"\0")[:size])
    with pytest.raises(MeasurementError, match=f"has {size} bytes.*has {SIZE}"):
        data_formats.read(file)


def test_text_is_not_taken_for_numbers(tmp_path):
    path = tmp_path / "x.foo"
    path.write_bytes(b"0.25 0.5 1.5\n" * 9000)
    with pytest.raises(MeasurementError, match="not recognised"):
        data_formats.read(path)
