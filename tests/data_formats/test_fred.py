"""FRED tables: blocks of a specular direction and its scattered ones."""

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
        path = tmp_path / "made.txt"
        path.write_text(text)
        return data_formats.read(path, **options)

    return read_text


@pytest.mark.parametrize("angles", ["deg", "sin"])
@pytest.mark.parametrize("values", ["value", "log"])
@pytest.mark.parametrize("scale", [1, 0.25])
def test_directions_and_values(read, angles, values, scale):
    m = read(optics.fred(angles, values, scale))
    assert m.provenance.format == "fred"
    np.testing.assert_allclose(m.value[:, 0], optics.of(m), rtol=1e-12)
    assert m.n_rows == 3 * 4 * 8
    assert m.symmetry == "anisotropic"
    noted = {note.code for note in m.notes}
    assert ("log-converted" in noted) == (values == "log")
    assert ("scaled" in noted) == (scale != 1)
    np.testing.assert_allclose(np.unique(np.rad2deg(m.theta_i).round(9)), [0, 25, 60])


def test_signed_angles_in_the_plane(read):
    text = "TYPE bsdf_data\nformat angles=deg bsdf=value\n30 0\n-80,0,1\n30,0,5\n80,0,2\n"
    m = read(text)
    np.testing.assert_allclose(np.rad2deg(m.theta_i), 30)
    np.testing.assert_allclose(np.rad2deg(m.theta_r), [80, 30, 80])
    # The specular side is at phi_i + 180, the other one at phi_i.
    np.testing.assert_allclose(np.cos(m.phi_r - m.phi_i), [1, -1, -1])
    assert m.value[:, 0].tolist() == [1, 5, 2]


def test_transmitted_light_and_factors(read):
    m = read(optics.fred(), side="transmitted")
    assert m.transmitted.all()
    np.testing.assert_allclose(np.rad2deg(m.theta_r).min(), 100)
    factors = read(optics.fred(), quantity="brf")
    np.testing.assert_array_equal(factors.value, read(optics.fred()).value / np.pi)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("type bsdf_data", "type bsdf_data x", "no line names the columns|first line"),
        ("format ", "formal ", "does not begin with `format`"),
        (
            "angles=deg",
            "angles=rad",
            "line 2: angles=rad; expected angles=deg or angles=",
        ),
        ("bsdf=value", "", r"line 2: bsdf=; expected bsdf=value or bsdf=log"),
        ("scale=1", "scale=-1", "scale=-1; expected a positive number"),
        ("0\t0\n", "", "line 3: a scattered direction comes before any specular one"),
        ("20\t45", "20\t45\t1", "line 13: the line has 4 fields; expected two"),
        ("20\t45", "20\tx", "line 13: 'x' is not a number"),
        ("20\t45", "200\t45", "line 13: theta_r is 200 degrees"),
    ],
)
def test_errors(read, old, new, message):
    text = optics.fred()
    assert old in text
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text.replace(old, new, 1))
    assert "made.txt" in str(caught.value)


def test_direction_sines_of_no_direction(read):
    with pytest.raises(MeasurementError, match=r"line 4: the direction sines 0\.9, 0\.9"):
        read("type bsdf_data\nformat angles=sin bsdf=value\n0 0\n0.9 0.9 1\n")


def test_real_file_agrees_with_the_same_sample_in_zemax(real_data: Path):
    fred = data_formats.read(real_data / "fred/AnoBlackEC1onAlum.txt")
    zemax = data_formats.read(real_data / "zemax/AnoBlackEC1onAlum.bsdf")
    assert (fred.n_rows, fred.n_channels) == (1144, 1)
    assert fred.valid.all()
    directions = []
    for m in (fred, zemax):
        x, y, z = optics.unit(np.rad2deg(m.theta_r), np.rad2deg(m.phi_r - m.phi_i))
        keys = zip(m.theta_i.round(6), x.round(6), abs(y).round(6), z.round(6), strict=True)
        usable = zip(keys, m.valid[:, 0], m.value[:, 0], strict=True)
        directions.append({k: value for k, valid, value in usable if valid})
    both = directions[0].keys() & directions[1].keys()
    assert len(both) == 64
    # The grids are the same measurement, resampled: equal but for interpolation.
    ratio = [directions[0][k] / directions[1][k] for k in both]
    assert np.median(np.abs(np.array(ratio) - 1)) < 0.02
    assert 0.8 < min(ratio) < max(ratio) < 1.25
    # In the specular direction FRED's table has the mean of repeats.
    for incidence in np.unique(fred.theta_i):
        found = []
        for m in (fred, zemax):
            there = np.abs(m.theta_i - incidence) + np.abs(m.theta_r - incidence) < 1e-6
            there &= np.cos(m.phi_r - m.phi_i) < -1 + 1e-9
            found.append(m.value[there, 0].item())
        assert found[0] == pytest.approx(found[1], rel=0.05)
