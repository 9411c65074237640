"""KAIST files: at the directions that the reader finds Mitsuba gives the same values."""

from __future__ import annotations

import numpy as np
import pytest
from tensor_files import kaist_fields, write_tensor_file

import data_formats
from data_formats import MeasurementError


def codes(m) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def test_mitsuba_agrees(tmp_path):
    mi = pytest.importorskip("mitsuba")
    before = mi.variant()
    path = write_tensor_file(tmp_path / "made.pbsdf", kaist_fields())
    m = data_formats.read(path)
    mi.set_variant("scalar_spectral_polarized")
    try:
        bsdf = mi.load_dict({"type": "measured_polarized", "filename": str(path)})
        # In the plane of incidence phi_d is undefined (theta_h or theta_d is 0), or an end.
        inside = (np.abs(np.sin(m.phi_r)) > 1e-3) & (m.theta_i > 0.05)
        rows = np.random.default_rng(0).permutation(np.flatnonzero(inside))[:60]
        for k in rows:
            # Light comes along -wo there and leaves along wi, to the camera.
            light, view = (
                mi.Vector3f(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t))
                for t, p in ((m.theta_i[k], m.phi_i[k]), (m.theta_r[k], m.phi_r[k]))
            )
            si = mi.SurfaceInteraction3f()
            si.wi = view
            si.wavelengths = [450, 500, 600, 650]
            found = np.array(bsdf.eval(mi.BSDFContext(), si, light))[0, 0]
            expected = m.value[k, [0, 1, 3, 4]] * np.cos(m.theta_i[k])
            np.testing.assert_allclose(found, expected, rtol=2e-3)
    finally:
        if before is not None:
            mi.set_variant(before)


def test_what_it_says(tmp_path):
    fields = kaist_fields(n_phi=8, n_theta=4)
    fields["M"][1, 1, 1, 2] = np.nan
    m = data_formats.read(write_tensor_file(tmp_path / "made.pbsdf", fields))
    assert m.wavelengths is not None
    assert m.wavelengths.tolist() == [450, 500, 550, 600, 650]
    assert m.provenance.format == "kaist"
    assert (m.phi_i == 0).all()
    assert m.symmetry == "isotropic"
    assert codes(m)["below-horizon"] + m.n_rows == 8 * 4 * 4
    assert codes(m)["not-finite-masked"] == np.count_nonzero(~m.valid) == 1
    assert "unpolarised-part" in codes(m)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"M": np.ones((9, 5, 5, 5, 3, 3), "<f4")}, "wavelength by 4 by 4"),
        ({"M": np.full((9, 5, 5, 5, 4, 4), np.nan, "<f4")}, "is valid"),
        ({"theta_h": np.zeros((0, 5), "<f4")}, r"'theta_h' has the shape \(0, 5\)"),
        ({"theta_d": np.linspace(0, 3, 5).astype("<f4")}, "theta_d runs from 0 to 3 rad"),
        ({"wvls": np.array([450, 500], "<u2")}, "expected the 5 nodes of an axis"),
        ({"phi_d": None}, "no field 'phi_d' in the file"),
    ],
)
def test_errors(change, message, tmp_path):
    fields = {k: v for k, v in (kaist_fields() | change).items() if v is not None}
    path = write_tensor_file(tmp_path / "made.pbsdf", fields)
    with pytest.raises(MeasurementError, match=message) as caught:
        data_formats.read(path)
    assert str(path) in str(caught.value)


def test_a_real_file_without_its_angles(real_data):
    """The small copy of Spectralon that circulates has axes of the shape (0, 9)."""
    path = real_data / "kaist/spectralon_lowres.pbsdf"
    with pytest.raises(MeasurementError, match=r"shape \(0, 22\); expected the 22 nodes"):
        data_formats.read(path)
