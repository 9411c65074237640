"""The HDF5 container, read by ourselves and by other programs."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import data_formats
from data_formats import Channel, Measurement, MeasurementError, Note, Provenance


@pytest.fixture
def measurement() -> Measurement:
    rng = np.random.default_rng(7)
    n, c = 7, 3
    value = rng.normal(0.3, 1, (n, c))
    valid = rng.uniform(size=(n, c)) < 0.8
    value[0, 0], valid[0, 0] = np.nan, False
    return Measurement(
        theta_i=rng.uniform(0, 1.5, n),
        phi_i=rng.uniform(-3, 3, n),
        theta_r=rng.uniform(0, 3, n),
        phi_r=rng.uniform(-3, 3, n),
        value=value,
        valid=valid,
        channels=(Channel.at(465), Channel("R"), Channel("long ü", 630.25)),
        sigma=rng.uniform(0.1, 1, (n, c)),
        symmetry="anisotropic",
        provenance=Provenance(
            "a/b.astm", "0" * 64, "astm", "G", "S", "2024", {"KEY": "ü\n\0\ud800"}
        ),
        notes=(Note("a-note", "Said.", 3), Note("b", "")),
        auxiliary={"a/b . c": rng.normal(size=n), "..": np.full(n, np.nan)},
    )


@pytest.fixture
def path(tmp_path: Path, measurement: Measurement) -> Path:
    data_formats.write(measurement, tmp_path / "m.h5")
    return tmp_path / "m.h5"


def test_nothing_is_lost(path, measurement):
    again = data_formats.read(path)
    assert again.equals(measurement)
    assert again.notes == measurement.notes
    assert again.provenance == measurement.provenance


def test_a_measurement_without_origin_gets_the_container_as_origin(path, measurement):
    data_formats.write(replace(measurement, provenance=Provenance(sample="S")), path)
    again = data_formats.read(path).provenance
    assert (again.path, again.format, again.sample) == (str(path), "hdf5", "S")
    assert len(again.sha256) == 64


def test_same_bytes_each_time(path, measurement):
    first = path.read_bytes()
    data_formats.write(measurement, path)
    assert path.read_bytes() == first


@pytest.mark.filterwarnings("default")
def test_xarray_reads_it_as_netcdf(path, measurement):
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert dict(dataset.sizes) == {"row": 7, "channel": 3}
        assert dataset.value.dims == ("row", "channel")
        assert dataset.theta_r.dims == ("row",)
        assert dataset.value.attrs["units"] == "sr-1"
        assert dataset.theta_i.attrs["units"] == "rad"
        assert dataset.wavelength.attrs["units"] == "nm"
        assert list(dataset.channel.values) == ["465 nm", "R", "long ü"]
        np.testing.assert_array_equal(dataset.wavelength, [465, np.nan, 630.25])
        np.testing.assert_array_equal(dataset.value, measurement.value)
        np.testing.assert_array_equal(dataset.sigma, measurement.sigma)
        np.testing.assert_array_equal(dataset.valid == 1, measurement.valid)


@pytest.mark.parametrize("kept", [9, 100, 0.2, 0.5, 0.9, 0.999])
def test_cut_short(path, kept):
    whole = path.read_bytes()
    path.write_bytes(whole[: kept if kept > 1 else int(kept * len(whole))])
    with pytest.raises(MeasurementError, match=r"m\.h5"):
        data_formats.read(path)


def test_flipped_bytes_are_noticed(path, measurement):
    """Checksums cover everything that is read: damage is an error or does not matter."""
    whole = path.read_bytes()
    rng = np.random.default_rng(3)
    for place in rng.integers(0, len(whole), 300):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with contextlib.suppress(MeasurementError):
            assert data_formats.read(path).equals(measurement)


def edit(path: Path, change) -> None:
    with h5py.File(path, "r+") as file:
        change(file)


def remake(name: str, **options):
    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, **options)

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.attrs.__delitem__("measurement_json"), "not written by this program"),
        (lambda f: f.attrs.__setitem__("measurement_json", "{}"), "not written by this"),
        (
            lambda f: f.attrs.__setitem__("measurement_json", np.bytes_("{}")),
            "description of the measurement is damaged",
        ),
        (lambda f: f.__delitem__("theta_r"), "no data set 'theta_r'"),
        (lambda f: f.__delitem__("valid"), "no data set 'valid'"),
        (remake("value", data=np.zeros((7, 2))), r"value has the shape \(7, 2\)"),
        (remake("value", data=[b"x"]), "'value' is of type"),
        (
            remake("value", shape=(10**9, 3), dtype="f8", chunks=(1000, 3)),
            r"declares the shape \(1000000000, 3\)",
        ),
        (remake("valid", data=np.zeros((7, 3), "i1")), "none of the 21 values is valid"),
        (remake("theta_i", data=np.full(7, 9.0)), "theta_i is 9.0 in row 0"),
        (
            lambda f: [f.__delitem__("value"), f.__setitem__("value", h5py.SoftLink("/x"))],
            "no data set 'value'",
        ),
        (
            lambda f: [
                f.__delitem__("value"),
                f.__setitem__("value", h5py.ExternalLink("other.h5", "/value")),
            ],
            "no data set 'value'",
        ),
        (
            lambda f: [
                f.__delitem__("value"),
                f.create_dataset("value", (7, 3), "f8", external=[("other.bin", 0, 168)]),
            ],
            "no data set 'value'",
        ),
    ],
)
def test_another_layout_is_refused(path, change, message):
    edit(path, change)
    with pytest.raises(MeasurementError, match=message) as caught:
        data_formats.read(path)
    assert str(path) in str(caught.value)


def test_any_other_hdf5_file_is_refused(tmp_path):
    with h5py.File(tmp_path / "x.nc", "w") as file:
        file["brdf"] = np.zeros(3)
    with pytest.raises(MeasurementError, match="not written by this program"):
        data_formats.read(tmp_path / "x.nc")
