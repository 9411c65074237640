"""RGL files: at the directions that the reader finds Mitsuba gives the same values."""

from __future__ import annotations

import re

import numpy as np
import pytest
from tensor_files import rgl_fields, write_tensor_file

import data_formats
from data_formats import MeasurementError

TURN = np.linspace(-np.pi, np.pi, 6)
HALF = np.linspace(-np.pi, 0, 5)


@pytest.fixture(scope="module")
def mitsuba():
    mi = pytest.importorskip("mitsuba")
    before = mi.variant()
    mi.set_variant("scalar_spectral")
    yield mi
    if before is not None:
        mi.set_variant(before)


def codes(m) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def as_mitsuba_says(mi, plugin: dict, m, rows) -> np.ndarray:
    """(rows, channels) BSDF; Mitsuba's values have the cosine in them."""
    bsdf = mi.load_dict(plugin)
    out = []
    for k in rows:
        vectors = [
            [np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)]
            for t, p in ((m.theta_i[k], m.phi_i[k]), (m.theta_r[k], m.phi_r[k]))
        ]
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*vectors[0])
        values = []
        for channel in m.channels:
            si.wavelengths = [channel.wavelength_nm] * 4
            value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*vectors[1]))
            values.append(float(value[0]) / vectors[1][2])
        out.append(values)
    return np.array(out)


@pytest.mark.parametrize("phi_i", [[0.0], TURN, HALF], ids=["isotropic", "turn", "half"])
@pytest.mark.parametrize("jacobian", [0, 1])
def test_mitsuba_agrees(mitsuba, phi_i, jacobian, tmp_path):
    fields = rgl_fields(list(phi_i)) | {"jacobian": np.array([jacobian], "u1")}
    path = write_tensor_file(tmp_path / "made.bsdf", fields)
    m = data_formats.read(path)
    inside = m.valid.all(axis=1) & (m.theta_r < np.deg2rad(80))
    # At the normal, and at the ends of the half vector's circle, nodes coincide.
    inside &= np.abs(np.sin(m.phi_r - m.phi_i)) > 1e-3
    half = sum(
        np.sin(t) * np.exp(1j * p) for t, p in ((m.theta_i, m.phi_i), (m.theta_r, m.phi_r))
    )
    inside &= np.abs(np.angle(-half)) > 1e-3
    if len(phi_i) > 2:
        inside &= np.abs(np.sin(m.phi_i)) > 1e-3
    rows = np.random.default_rng(0).permutation(np.flatnonzero(inside))[:40]
    found = as_mitsuba_says(mitsuba, {"type": "measured", "filename": str(path)}, m, rows)
    np.testing.assert_allclose(m.value[rows], found, rtol=3e-3)


def test_what_it_says(tmp_path):
    m = data_formats.read(write_tensor_file(tmp_path / "made.bsdf", rgl_fields([0.0])))
    assert m.wavelengths is not None
    assert m.wavelengths.tolist() == [400, 500, 650]
    assert (m.provenance.sample, m.provenance.format) == ("made-up paint", "rgl")
    assert m.symmetry == "isotropic"
    assert m.n_rows + codes(m)["below-horizon"] == 3 * 16
    assert codes(m)["grazing-masked"] == np.count_nonzero(~m.valid.all(axis=1))
    assert m.theta_r[m.valid.all(axis=1)].max() <= np.deg2rad(84)
    assert "cosine-divided" in codes(m)
    m = data_formats.read(write_tensor_file(tmp_path / "half.bsdf", rgl_fields(list(HALF))))
    assert m.symmetry == "anisotropic"
    assert "azimuths-in-part" in codes(m)


def test_rgb_and_numbers_that_are_none(tmp_path):
    fields = rgl_fields([0.0])
    colours = fields.pop("spectra")
    fields["rgb"] = colours
    del fields["wavelengths"]
    colours[0, 1, 2, 1, 2] = np.nan
    colours[0, 0, 0, 0, 0] = -0.1
    m = data_formats.read(write_tensor_file(tmp_path / "made.bsdf", fields))
    assert [c.name for c in m.channels] == ["R", "G", "B"]
    assert codes(m)["not-finite-masked"] == np.isnan(m.value).sum() == 1
    assert codes(m)["negative-values"] == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vndf": np.ones((1, 2, 4, 4), "<f4")}, "field 'vndf' has the shape"),
        ({"vndf": -np.ones((1, 3, 4, 4), "<f4")}, "negative or infinite"),
        ({"theta_i": np.array([0.1, 0.6, 2], "<f4")}, "runs from 0.1 to 2 rad"),
        ({"theta_i": np.array([0.6, 0.1, 1], "<f4")}, "do not increase"),
        ({"theta_i": np.zeros((0, 3), "<f4")}, r"shape \(0, 3\); expected the 3 nodes"),
        ({"spectra": np.ones((1, 3, 4, 4), "<f4")}, "expected phi_i by theta_i"),
        ({"spectra": np.full((1, 3, 3, 4, 4), np.nan, "<f4")}, "none of the .* is valid"),
        ({"sigma": np.ones(3, "<f4")}, "field 'sigma' has the shape"),
        ({"jacobian": None}, "no field 'jacobian' in the file; found description"),
        ({"wavelengths": None}, "no field 'wavelengths'"),
    ],
)
def test_errors(change, message, tmp_path):
    fields = {k: v for k, v in (rgl_fields([0.0]) | change).items() if v is not None}
    path = write_tensor_file(tmp_path / "made.bsdf", fields)
    with pytest.raises(MeasurementError, match=message) as caught:
        data_formats.read(path)
    assert str(path) in str(caught.value)


def test_other_containers_are_refused_by_name(tmp_path):
    path = write_tensor_file(tmp_path / "made.bsdf", {"a": np.zeros(3, "<f4")})
    with pytest.raises(MeasurementError, match=r"tensor_file.*not supported"):
        data_formats.read(path)
    with pytest.raises(MeasurementError, match="no field 'rgb' in the file; found a"):
        data_formats.read(path, format="rgl")
    whole = write_tensor_file(path, rgl_fields([0.0])).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(MeasurementError, match=r"ends at byte .* cut short"):
        data_formats.read(path)
    path.write_bytes(whole[:60])
    with pytest.raises(MeasurementError, match=re.escape(str(path))):
        data_formats.read(path, format="rgl")
