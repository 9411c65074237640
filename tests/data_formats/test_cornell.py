"""MATLAB files in the layouts of the Cornell laboratory, written by scipy and h5py."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import data_formats
from data_formats import Measurement, MeasurementError, mat_file

NM = np.arange(400.0, 701, 10)


def unit_vectors(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    return np.column_stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )


def save_7_3(path: Path, variables: dict[str, np.ndarray]) -> None:
    """As MATLAB does: HDF5 behind a block of text, axes in reverse order."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, array in variables.items():
            file[name] = np.atleast_2d(array).T
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(126) + b"\x02IM")


@pytest.fixture
def variables(shadowed_rows) -> dict[str, np.ndarray]:
    return {
        "dir_in": unit_vectors(shadowed_rows[:, 0], shadowed_rows[:, 1]),
        "dir_out": unit_vectors(shadowed_rows[:, 2], shadowed_rows[:, 3]),
        "fr": shadowed_rows[:, 4:],
        "wavelength": NM,
    }


@pytest.fixture
def save(tmp_path: Path):
    def save_as(version: str, variables: dict[str, np.ndarray]) -> Path:
        path = tmp_path / "made.mat"
        if version == "7.3":
            save_7_3(path, variables)
        else:
            options = {"format": version[0], "do_compression": version == "5c"}
            savemat(path, variables, **options)
        return path

    return save_as


def check(m: Measurement, rows: np.ndarray) -> None:
    np.testing.assert_allclose(m.theta_i, rows[:, 0], atol=1e-15)
    np.testing.assert_allclose(m.theta_r, rows[:, 2], atol=1e-15)
    np.testing.assert_allclose(np.cos(m.phi_r), np.cos(rows[:, 3]), atol=1e-15)
    assert (m.value == rows[:, 4:]).all()
    assert m.wavelengths.tolist() == NM.tolist()


@pytest.mark.parametrize("version", ["4", "5", "5c", "7.3"])
@pytest.mark.parametrize("turned", [(), ("dir_in", "dir_out"), ("fr", "wavelength")])
def test_vectors_in_all_versions_and_orientations(
    version, turned, save, variables, shadowed_rows
):
    for name in turned:
        variables[name] = np.atleast_2d(variables[name]).T
    m = data_formats.read(save(version, variables))
    check(m, shadowed_rows)
    assert m.provenance.format == "cornell"
    assert m.symmetry == "bilateral"
    assert (~m.valid).all(axis=1).sum() == 4
    assert "cornell-shadow-masked" in [n.code for n in m.notes]


@pytest.mark.parametrize("dtype", ["f4", "f8", "i2", "u1", "u2", "i4"])
@pytest.mark.parametrize("version", ["4", "5", "5c"])
def test_number_types_agree_with_scipy(dtype, version, save):
    table = np.arange(12).reshape(4, 3).astype(dtype)
    path = save(version, {"fr": table, "text": "abc", "z": np.array([1j])})
    found = mat_file.variables(path.read_bytes(), lambda name: True)
    assert list(found) == ["fr"]
    assert (found["fr"] == table).all()


def test_missing_values_and_low_vectors(save, variables):
    variables["fr"] = variables["fr"].copy()
    variables["fr"][5, 3] = np.nan
    m = data_formats.read(save("5", variables))
    assert not m.valid[5, 3]
    # A receiver a hair below the horizon is on it.
    variables["dir_out"] = unit_vectors(np.full(len(m.value), np.pi / 2 + 1e-4), m.phi_r)
    assert (data_formats.read(save("5", variables)).theta_r == np.pi / 2).all()


@pytest.mark.parametrize("in_degrees", [True, False])
def test_house_paint_as_measured(save, in_degrees):
    unit = 1.0 if in_degrees else np.pi / 180
    theta, phi = np.array([0.0, 30, 60, 85]), np.array([0.0, 90, 180, 270])
    variables: dict[str, np.ndarray] = {"wavelengths": NM[:5]}
    for k, incidence in enumerate(("00", "20", "85")):
        variables[f"theta{incidence}"] = theta * unit
        variables[f"phi{incidence}"] = phi * unit
        variables[f"brdf{incidence}"] = np.arange(20.0).reshape(5, 4) / 100 + k
    m = data_formats.read(save("4", variables))
    assert (m.n_rows, m.n_channels) == (12, 5)
    np.testing.assert_allclose(m.theta_i[::4], np.deg2rad([0, 20, 85]))
    np.testing.assert_allclose(m.theta_r[:4], np.deg2rad(theta))
    np.testing.assert_allclose(m.phi_r[:4], np.deg2rad(phi))
    assert m.value[5].tolist() == pytest.approx([1.01, 1.05, 1.09, 1.13, 1.17])
    assert "phi-i-absent" in [n.code for n in m.notes]


def test_house_paint_cleaned(save):
    theta, phi = np.meshgrid(np.arange(0.0, 91, 5), np.arange(0.0, 361, 5), indexing="ij")
    variables = {"theta": theta, "phi": phi}
    for incidence in ("00", "35"):
        for nm in (450, 550):
            variables[f"brdf{incidence}_{nm}"] = theta / 100 + phi + nm
    m = data_formats.read(save("5", variables))
    assert (m.n_rows, m.n_channels) == (2 * 19 * 73, 2)
    assert m.wavelengths.tolist() == [450, 550]
    expected = np.rad2deg(m.theta_r) / 100 + np.rad2deg(m.phi_r)
    np.testing.assert_allclose(m.value, expected[:, None] + [450, 550], rtol=1e-13)
    assert "interpolated-values" in [n.code for n in m.notes]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dir_in": None}, "expected the variables dir_in"),
        ({"wavelength": None}, "no variable wavelength"),
        ({"wavelength": np.zeros(31)}, "no variable wavelength with positive"),
        ({"wavelength": NM[:7]}, "fr has the shape .* one side of 7"),
        ({"dir_in": np.ones((7, 3))}, "dir_in has the shape"),
        ({"dir_out": np.zeros((1520, 3))}, "dir_out has the shape"),
        ({"fr": np.full((1520, 31), np.nan)}, "none of the 47120 values is valid"),
    ],
)
@pytest.mark.parametrize("version", ["4", "5", "7.3"])
def test_errors(change, message, version, save, variables):
    variables = {k: v for k, v in (variables | change).items() if v is not None}
    path = save(version, variables)
    with pytest.raises(MeasurementError, match=message) as caught:
        data_formats.read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("version", ["4", "5", "5c", "7.3"])
@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9, 0.999])
def test_cut_short(version, kept, save, variables):
    path = save(version, variables)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(MeasurementError, match=r"made\.mat"):
        data_formats.read(path)


@pytest.mark.parametrize("version", ["4", "5"])
def test_a_declared_shape_allocates_nothing(version, save, variables):
    path = save(version, variables)
    content = bytearray(path.read_bytes())
    shape = np.array(variables["fr"].shape, dtype="<i4").tobytes()
    at = content.find(shape)
    content[at : at + 8] = np.array([2**31 - 1, 2**31 - 1], dtype="<i4").tobytes()
    path.write_bytes(content)
    with pytest.raises(MeasurementError, match="damaged"):
        data_formats.read(path)


def test_the_text_form_is_read_as_well(write_astm, shadowed_rows):
    names = "theta_i,phi_i,theta_s,phi_s," + ",".join(f"{w:g}nm" for w in NM)
    path = write_astm(shadowed_rows, names, ("SYSTEM_NAME Cornell/Kodak",))
    m = data_formats.read(path, format="cornell")
    check(m, shadowed_rows)
    assert m.equals(data_formats.read(path))
    assert m.provenance.format == "astm"
    assert m.provenance.instrument == "Cornell/Kodak"
