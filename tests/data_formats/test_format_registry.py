"""Which formats there are, how a file's format is found, and what is refused by name."""

from __future__ import annotations

import gzip
import importlib
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import data_formats
from data_formats import Channel, Measurement, MeasurementError, registry


@pytest.fixture
def small() -> Measurement:
    return Measurement(
        theta_i=np.array([0.5, 0.5]),
        phi_i=np.zeros(2),
        theta_r=np.array([0.5, 0.7]),
        phi_r=np.array([np.pi, 1.0]),
        value=np.array([[0.3], [0.2]]),
        valid=np.ones((2, 1), bool),
        channels=(Channel.at(550),),
    )


def test_registry_agrees_with_the_files():
    folder = Path(data_formats.__file__).parent
    formats = {p.stem for p in folder.glob("*.py") if "def sniff(" in p.read_text()}
    assert set(registry.FORMATS) == formats - {"registry"}


@pytest.mark.parametrize("name", registry.FORMATS)
def test_a_format_keeps_the_contract(name):
    module = importlib.import_module(f"data_formats.{name}")
    assert name == module.NAME
    assert all(s.startswith(".") and s.islower() for s in module.SUFFIXES)
    assert module.sniff(b"") is False
    assert callable(module.read)


def test_formats_are_listed():
    infos = {info.name: info for info in data_formats.formats()}
    assert tuple(infos) == registry.FORMATS
    assert {name for name, info in infos.items() if info.can_write} == {
        "alta",
        "astm",
        "csv",
        "hdf5",
        "mbsdf",
        "merl",
        "ssdd",
        "window",
        "zemax",
    }
    assert all(info.description.endswith(".") for info in infos.values())


def test_import_loads_neither_jax_nor_scipy():
    code = (
        "import sys, data_formats; "
        "[__import__(f'data_formats.{n}') for n in data_formats.registry.FORMATS]; "
        "print([m for m in ('jax', 'scipy', 'pandas', 'fitting') if m in sys.modules])"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == "[]"


UNSUPPORTED = {
    "tensor_file": b"tensor_file\0\1\0",
    "SCATFUN": b"SCATFUN\x01",
    "ALTA function": b"#DIM 2 1\n#FUNC nonlinear_function_lafortune\n",
    "LightTools": b"Symmetry Asymmetric\nScatterRadial 2\n0 10\nDataBegin\n",
    "Disney": b"analytic\n::begin parameters\n",
    ".xlsx": b"PK\x03\x04\x14\0",
}


@pytest.mark.parametrize("name", UNSUPPORTED)
@pytest.mark.parametrize("suffix", [".txt", ".brdf", ""])
def test_known_formats_without_a_reader_are_refused_by_name(name, suffix, tmp_path):
    path = tmp_path / f"file{suffix}"
    path.write_bytes(UNSUPPORTED[name])
    with pytest.raises(MeasurementError, match="recognised but not supported") as caught:
        data_formats.read(path)
    assert name in str(caught.value)
    assert str(path) in str(caught.value)


def test_unknown_content_is_shown(tmp_path):
    path = tmp_path / "x.foo"
    path.write_bytes(b"\x01\x02 strange")
    with pytest.raises(MeasurementError, match=r"begins with b'\\x01\\x02 strange'.*astm"):
        data_formats.read(path)


def test_unknown_format_name(tmp_path, small):
    path = tmp_path / "x.astm"
    data_formats.write(small, path)
    with pytest.raises(MeasurementError, match="no format is called 'zzz'"):
        data_formats.read(path, format="zzz")
    with pytest.raises(TypeError):
        data_formats.read(path, flavour="sweet")


def test_content_beats_suffix_and_format_beats_both(tmp_path, small):
    path = tmp_path / "really_csv.astm"
    data_formats.write(small, path, format="csv")
    assert data_formats.read(path).equals(small)
    with pytest.raises(MeasurementError, match="no line begins with VARS"):
        data_formats.read(path, format="astm")


@pytest.mark.parametrize(
    "name", ["m.ASTM", "m.csv.gz", "m.astm.gz", "m.tsv", "m.nc", "m.h5"]
)
def test_write_by_suffix(name, tmp_path, small):
    path = tmp_path / name
    data_formats.write(small, path)
    assert data_formats.read(path).equals(small)
    assert path.read_bytes().startswith(b"\x1f\x8b") == name.endswith(".gz")
    assert list(tmp_path.iterdir()) == [path]


def test_write_refuses_what_it_cannot(tmp_path, small):
    for name in ("m.brdf", "m.foo", "m"):
        with pytest.raises(MeasurementError, match="no writer"):
            data_formats.write(small, tmp_path / name)
    with pytest.raises(MeasurementError, match=r"drop \.gz"):
        data_formats.write(small, tmp_path / "m.h5.gz")
    with pytest.raises(MeasurementError, match="cannot be written"):
        data_formats.write(small, tmp_path / "no_such_folder" / "m.astm")
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file(tmp_path, small, monkeypatch):
    path = tmp_path / "m.csv"
    path.write_text("old")

    def fail(measurement, path):
        Path(path).write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("data_formats.csv.write", fail)
    with pytest.raises(MeasurementError, match="No space left"):
        data_formats.write(small, path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_installed_package_can_add_a_format(tmp_path, small, monkeypatch):
    plugin = ModuleType("plugin", "A format of others.")
    plugin.NAME, plugin.SUFFIXES = "elsewhere", (".else",)
    plugin.sniff = lambda head: head.startswith(b"tensor_file")
    plugin.read = lambda path: small

    class Entry:
        def load(self):
            return plugin

    monkeypatch.setattr(registry, "entry_points", lambda group: [Entry()])
    path = tmp_path / "x.bin"
    path.write_bytes(UNSUPPORTED["tensor_file"])
    assert data_formats.read(path) is small
    assert data_formats.formats()[-1].name == "elsewhere"


def test_gzip_is_unwrapped_and_hashed_as_it_is(tmp_path, small):
    data_formats.write(small, tmp_path / "m.csv")
    packed = tmp_path / "m.csv.gz"
    content = gzip.compress((tmp_path / "m.csv").read_bytes())
    packed.write_bytes(content + gzip.compress(b"\n"))  # two members, as `cat` makes them
    assert data_formats.read(packed).equals(small)
