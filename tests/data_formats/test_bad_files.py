"""Bad files end in a `MeasurementError` of one sentence, in bounded time and memory."""

from __future__ import annotations

import functools
import gzip
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import made_up_databases
import made_up_optics
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

import data_formats
from data_formats import MeasurementError, registry

ASTM = b"VARS theta_i,phi_i,theta_s,phi_s,450nm\n\n0.1,0,0.1,0,1\n"
SUFFIXES = [".astm", ".brdf", ".bsdf", ".csv", ".h5", ".mat", ".xml", ".txt.gz", ""]

fuzzing = settings(
    deadline=None,
    max_examples=300,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture(autouse=True, scope="module")
def packages_searched_once() -> Iterator[None]:
    """Every file of no known format has the installed packages searched for more."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "entry_points", functools.cache(registry.entry_points))
        yield


def refuse(path: Path, **options) -> str:
    with pytest.raises(MeasurementError) as caught:
        data_formats.read(path, **options)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    assert len(message) < 1000
    return message


def read_or_refuse(path: Path, content: bytes) -> None:
    """Nothing but a measurement or a `MeasurementError`, soon."""
    path.write_bytes(content)
    start = time.perf_counter()
    try:
        data_formats.read(path)
    except MeasurementError as error:
        message = str(error)
    else:
        message = str(path)
    assert str(path) in message
    assert time.perf_counter() - start < 5


def test_missing_file_and_folder(tmp_path):
    assert "does not exist" in refuse(tmp_path / "none.astm")
    assert "is a folder" in refuse(tmp_path)
    assert "does not exist" in refuse(tmp_path / "none.astm", format="csv")
    with pytest.raises(MeasurementError, match=r"cannot be read|does not exist"):
        data_formats.read("a\0b")
    with pytest.raises(MeasurementError, match=r"cannot be read|does not exist"):
        data_formats.read("x" * 5000)


def test_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "x.astm"
    path.write_bytes(ASTM)

    def deny(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", deny)
    assert "Permission denied" in refuse(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b" \n\t\r\n",
        bytes(10_000),
        bytes(range(256)) * 40,
        b"Dear all,\nplease find attached the measurement.\nRegards\n",
        b"1,2,3\n4,5,6\n",
        b"\x89HDF\r\n\x1a\n",
        b"\x89HDF\r\n\x1a\n" + bytes(3000),
        b"MATLAB 5.0 MAT-file, made up".ljust(128) + bytes(50),
        b"MATLAB 7.3 MAT-file, made up".ljust(512) + b"\x89HDF\r\n\x1a\n",
        b"\x1f\x8b",
        b"\x1f\x8b\x08\0\0\0\0\0\0\xff",
        gzip.compress(ASTM, mtime=0)[:-9],
        gzip.compress(b"", mtime=0),
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n",
        b"VARS\n",
        b"VARS theta_i,phi_i,theta_s,phi_s,450nm",
        b"VARS theta_i,phi_i,theta_s,phi_s,450nm\n" + b"0,0,0,0,nan\n" * 9,
        b"VARS theta_i,phi_i,theta_s,phi_s,450nm\n-2,0,0,0,1\n",
        b"VARS theta_i,phi_i,theta_s,phi_s,450nm,450nm\n0,0,0,0,1,1\n",
        b"theta_i,theta_r,dphi,R\n" + b"\0",
        b"31 " + b"400 " * 31,
        b"tensor_file\0\1\0" + bytes(100),
        b"Z\0\0\0Z\0\0\0\xb4\0\0\0" + bytes(100),
        b"<?xml version='1.0'?><WindowElement/>",
        b"#DIM 1 1\n#PARAM_IN COS_TH\n",
        "VARS θ,φ\n1,2\n".encode(),
    ],
)
def test_no_measurement_in_it(tmp_path, suffix, content):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    refuse(path)


def test_git_lfs_pointer_is_named(tmp_path):
    path = tmp_path / "x.astm"
    path.write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    assert "Git LFS pointer" in refuse(path)


@pytest.mark.parametrize(
    "line",
    [
        b"1," * 5_000_000,
        b"1 " * 5_000_000,
        b"1" * 10_000_000,
        b"a" * 10_000_000,
        b"," * 10_000_000,
        b"[" * 10_000_000,
        b"theta_i," * 1_250_000,
        b"_" * 10_000_000,
        b" " * 9_999_999 + b"x",
    ],
    ids=lambda line: repr(line[:8] + line[-1:]),
)
@pytest.mark.parametrize(
    "head",
    [
        b"",
        b"VARS ",
        b"VARS [,",
        b"VARS theta_i,phi_i,theta_s,phi_s,450nm\n",
        b"theta_i,theta_r,dphi,R\n",
        b"theta_i,theta_r,dphi,",
        b"1 450 0 ",
    ],
)
def test_endless_lines(tmp_path, head, line):
    path = tmp_path / "long.csv"
    path.write_bytes(head + line)
    start = time.perf_counter()
    refuse(path)
    assert time.perf_counter() - start < 10


def test_a_packed_bomb_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("data_formats.source.MAX_BYTES", 1_000_000)
    path = tmp_path / "bomb.astm.gz"
    path.write_bytes(gzip.compress(ASTM + bytes(2_000_000)))
    assert "unpacks to more than" in refuse(path)
    path.write_bytes(ASTM + b" " * 2_000_000)
    assert "is more than the 2 GiB" in refuse(path)


@fuzzing
@given(content=st.binary(max_size=400), suffix=st.sampled_from(SUFFIXES))
def test_random_bytes(content, suffix, tmp_path):
    read_or_refuse(tmp_path / f"x{suffix}", content)


WORDS = st.sampled_from(
    [
        *["VARS ", "theta_i", "phi_i", "theta_s", "phi_s", "450nm", "R", "sigma", "valid"],
        *["NUM_POINTS ", "MEASUREMENT_JSON ", "{", "}", "[", '"', "theta_i_deg", "dphi"],
        *[
            "\n",
            "\n",
            "\r\n",
            ",",
            ",",
            ";",
            "\t",
            " ",
            "#",
            "0.1",
            "1",
            "90",
            "-5",
            "1e999",
        ],
        *["nan", "inf", "1.#IND", "1,5", "0,5", ".", "1e308", "1e-320", "2", "450", "550"],
        *["MEAS_NAME ", "BTDF", "BRF", "quantity: ", "transmittance factor", "3"],
        *["\0", "\ufeff", "é", "\u2028", "#DIM", "OPTIS - ", "\ud7ff", "9" * 30],
    ]
)


@fuzzing
@given(words=st.lists(WORDS, max_size=60), suffix=st.sampled_from(SUFFIXES))
def test_structured_text(words, suffix, tmp_path):
    read_or_refuse(tmp_path / f"x{suffix}", "".join(words).encode())


@fuzzing
@given(
    cells=st.lists(
        st.lists(
            st.sampled_from(
                ["0.1", "0", "1", "nan", "", "1e300", "-1e308", "40", "x", "-1"]
            ),
            min_size=5,
            max_size=6,
        ),
        max_size=9,
    ),
    head=st.sampled_from(
        ["VARS theta_i,phi_i,theta_s,phi_s,", "theta_i,phi_i,theta_r,phi_r,"]
    ),
    channel=st.sampled_from(["450nm", "450nm,sigma", "R,valid", "R", "1e400nm", "0nm"]),
)
def test_nearly_good_tables(cells, head, channel, tmp_path):
    rows = "\n".join(",".join(row) for row in cells)
    read_or_refuse(tmp_path / "x.astm", f"{head}{channel}\n{rows}\n".encode())


def flip(content: bytearray, rng: np.random.Generator) -> None:
    for place in rng.integers(0, len(content), rng.choice([1, 3, 30])):
        content[place] = rng.integers(256)


def flip_early(content: bytearray, rng: np.random.Generator) -> None:
    for place in rng.integers(0, min(len(content), 2000), rng.choice([1, 3, 30])):
        content[place] = rng.choice([0, 255, 127, 44, 10, 35, 57])


def cut(content: bytearray, rng: np.random.Generator) -> None:
    del content[rng.integers(len(content)) :]


def cut_out(content: bytearray, rng: np.random.Generator) -> None:
    start = int(rng.integers(len(content)))
    del content[start : start + int(rng.choice([1, 8, 500]))]


def put_in(content: bytearray, rng: np.random.Generator) -> None:
    start = int(rng.integers(len(content)))
    content[start:start] = rng.bytes(int(rng.choice([1, 8, 100])))


def shuffle_lines(content: bytearray, rng: np.random.Generator) -> None:
    lines = content.split(b"\n")
    first, second = rng.integers(0, len(lines), 2)
    lines[first], lines[second] = lines[second], lines[first]
    content[:] = b"\n".join(lines)


def shuffle_columns(content: bytearray, rng: np.random.Generator) -> None:
    lines = [line.split(b",") for line in content.split(b"\n")]
    widths = {len(fields) for fields in lines}
    order = rng.permutation(max(widths)).tolist()
    of_width = {n: [k for k in order if k < n] for n in widths}
    content[:] = b"\n".join(
        b",".join(map(fields.__getitem__, of_width[len(fields)])) for fields in lines
    )


MUTATIONS = [flip, flip_early, cut, cut_out, put_in, shuffle_lines, shuffle_columns]


@pytest.fixture
def sound_files(tmp_path, write_astm, shadowed_rows, ramped_rows) -> list[Path]:
    """One small good file of each kind, as the instruments and as we write them."""
    folder = tmp_path / "sound"
    folder.mkdir()
    bands = np.hstack([shadowed_rows[::7, :4], shadowed_rows[::7, 4:8]])
    names = "theta_i,phi_i,theta_s,phi_s,400nm,410nm,420nm,430nm"
    cornell = write_astm(bands, names, ("SYSTEM_NAME Cornell",))
    m = data_formats.read(cornell)
    files = [cornell.rename(folder / "cornell.astm")]
    leds = write_astm(ramped_rows, "theta_i,phi_i,theta_s,465nm,525nm,630nm")
    files.append(leds.rename(folder / "ramp.astm"))
    leds = write_astm(
        ramped_rows, "theta_i,phi_i,theta_s,465nm,525nm,630nm", ("MEAS_NAME BTDF",)
    )
    files.append(leds.rename(folder / "folded.astm"))
    for name in ("own.astm", "own.csv", "own.h5", "own.astm.gz"):
        data_formats.write(m, folder / name)
        files.append(folder / name)
    stream = f"4\n400 410 420 430\n{' '.join(f'{x:.6f}' for x in bands.ravel())}\n"
    (folder / "stream.brdf").write_text(stream)
    x, y, z = (np.sin(bands[:, 2]), np.zeros(len(bands)), np.cos(bands[:, 2]))
    vectors = np.column_stack([x, y, z])
    table = {"dir_in": vectors, "dir_out": vectors, "fr": bands[:, 4:]}
    table["wavelength"] = np.array([400.0, 410, 420, 430])
    for version, packed in (("4", False), ("5", False), ("5", True)):
        path = folder / f"version_{version}_{packed}.mat"
        savemat(path, table, format=version, do_compression=packed)
        files.append(path)
    for name, content in (made_up_optics.SOUND | made_up_databases.SOUND).items():
        (folder / name).write_bytes(content)
        files.append(folder / name)
    return [*files, folder / "stream.brdf"]


def mutate_and_read(files: list[Path], target: Path, times: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    contents = [(path, path.read_bytes()) for path in files]
    for _ in range(times):
        for path, content in contents:
            damaged = bytearray(content)
            change: Callable = MUTATIONS[rng.integers(len(MUTATIONS))]
            change(damaged, rng)
            read_or_refuse(target / f"mutated{''.join(path.suffixes)}", bytes(damaged))


def test_sound_files_are_sound(sound_files):
    for path in sound_files:
        assert data_formats.read(path).valid.any()


def test_mutated_files(sound_files, tmp_path):
    mutate_and_read(sound_files, tmp_path, 80, seed=0)


@pytest.mark.slow
def test_more_mutated_files(sound_files, tmp_path):
    mutate_and_read(sound_files, tmp_path, 400, seed=1)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(2, 6))
def test_many_mutated_files(sound_files, tmp_path, seed):
    mutate_and_read(sound_files, tmp_path, 2000, seed=seed)


@pytest.mark.parametrize(
    "times",
    [
        pytest.param(100, marks=pytest.mark.slow),
        pytest.param(1000, marks=pytest.mark.full),
    ],
)
def test_mutated_real_files(real_data, tmp_path, times):
    folders = ("cornell", "minidiff", "pbrt", "csv", "zemax", "fred", "speos", "mbsdf")
    folders += ("alta", "kaist", "radiance")
    files = [sorted((real_data / folder).iterdir())[-1] for folder in folders]
    mutate_and_read(files, tmp_path, times, seed=0)
