"""`brdf texels`: files in and out, what is refused, and going on after a kill."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import haste
import numpy as np
import pytest
import texel_samples

from fitting.cli import main
from fitting.texels import fit_many

ROOT = Path(__file__).parents[2]
ANGLES = texel_samples.directions()
MODEL = "lambert + ggx"
_PROGRAM = "import sys; from fitting.cli import main; sys.exit(main())"
PATIENCE_S = 120.0


def sample(texels: int = 12) -> np.ndarray:
    truth = texel_samples.truth(texels)
    return texel_samples.noisy(texel_samples.values_of(MODEL, truth, ANGLES))


def process(*argv: object, cwd: Path) -> subprocess.Popen[str]:
    ours = {"PYTHONPATH": str(ROOT), "JAX_PLATFORMS": "cpu", "COLUMNS": "100"}
    return subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, *map(str, argv)], cwd=cwd, text=True,
        env=os.environ | haste.environment(ROOT) | ours,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def arrays(path: Path) -> dict[str, np.ndarray]:
    """All data sets of numbers by their names."""
    found: dict[str, np.ndarray] = {}

    def see(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind != "O":
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(see)
    return found


def test_a_file_is_fitted_as_its_arrays_are(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    values = sample()
    values[1, 7, 2] = np.nan
    names = np.array(["R", "G", "B"], dtype=h5py.string_dtype())
    texel_samples.write(Path("wood.h5"), values.reshape(4, 3, 60, 3), ANGLES, channel=names)
    assert main(["texels", "wood.h5", "-m", MODEL, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["converged"] == said["texels"] == 12
    assert said["output"] == "wood.texels.h5"
    found, expected = arrays(Path("wood.texels.h5")), fit_many(values, ANGLES, MODEL)
    for name, value in expected.parameters.items():
        got = found[f"parameters/{name}"]
        assert got.shape[:2] == (4, 3)
        # Degrees and back move the directions by a rounding.
        np.testing.assert_allclose(got.reshape(value.shape), value, rtol=1e-9)
        error = expected.uncertainties[name]
        got = found[f"uncertainties/{name}"].reshape(error.shape)
        np.testing.assert_allclose(got, error, rtol=1e-6)
    np.testing.assert_allclose(found["cost"].ravel(), expected.cost, rtol=1e-9)
    np.testing.assert_array_equal(found["used"].ravel(), expected.used)
    with h5py.File("wood.texels.h5") as file:
        assert file.attrs["model"] == MODEL
        assert file.attrs["objective"] == "l2cos"
        assert "jax" in json.loads(file.attrs["versions_json"])
        assert [v.decode() for v in file["channel"]] == ["R", "G", "B"]
        assert file["parameters/ggx.alpha"].attrs["units"] == "1"
    assert sorted(os.listdir()) == ["wood.h5", "wood.texels.h5"]


def test_mask_and_uncertainties_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = sample()
    sigma, valid = 0.02 * np.abs(values) + 1e-3, np.ones(values.shape, dtype=np.uint8)
    valid[3, ::5] = 0
    texel_samples.write(Path("a.h5"), values, ANGLES, sigma=sigma, valid=valid)
    assert main(["texels", "a.h5", "-o", "b.h5", "--objective", "chi2", "-q"]) == 0
    expected = fit_many(values, ANGLES, MODEL, sigma=sigma, valid=valid, objective="chi2")
    np.testing.assert_allclose(arrays(Path("b.h5"))["cost"], expected.cost, rtol=1e-9)
    assert expected.used[3] == 180 - 36
    # They are no weights of other objectives.
    assert main(["texels", "a.h5", "-o", "c.h5", "-q"]) == 0
    expected = fit_many(values, ANGLES, MODEL, valid=valid)
    np.testing.assert_allclose(arrays(Path("c.h5"))["cost"], expected.cost, rtol=1e-9)
    noise = ["--objective", "chi2", "--noise", "0.02,0.001"]
    assert main(["texels", "a.h5", "-o", "d.h5", "-q", *noise]) == 0
    settings = {"objective": "chi2", "noise": (0.02, 1e-3)}
    expected = fit_many(values, ANGLES, MODEL, valid=valid, **settings)
    np.testing.assert_allclose(arrays(Path("d.h5"))["cost"], expected.cost, rtol=1e-6)


def test_a_shape_per_channel_and_other_residuals(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = sample(6)
    texel_samples.write(Path("a.h5"), values.reshape(2, 3, 60, 3), ANGLES)
    more = ["--per-channel-shape", "--objective", "auto", "-q"]
    assert main(["texels", "a.h5", *more]) == 0
    found = arrays(Path("a.texels.h5"))
    settings = {"objective": "log1p", "per_channel_shape": True}
    expected = fit_many(values, ANGLES, MODEL, **settings)
    assert found["parameters/ggx.alpha"].shape == (2, 3, 3)
    np.testing.assert_allclose(
        found["parameters/ggx.alpha"].reshape(6, 3),
        expected.parameters["ggx.alpha"], rtol=1e-6,
    )  # fmt: skip
    with h5py.File("a.texels.h5") as file:
        assert file.attrs["objective"] == "log1p"


@pytest.mark.parametrize(
    ("spoil", "options", "code", "words"),
    [
        ("nothing", ["-m", "gxx"], 2, "did you mean 'ggx'"),
        ("nothing", ["--objective", "chi2"], 2, "no data set 'sigma'"),
        ("nothing", ["--noise", "0.1"], 2, "expected two numbers A,B"),
        ("nothing", ["--noise", "0.1,0"], 2, "with the objective chi2"),
        ("nothing", ["--energy", "-1"], 2, "a number from 0 on"),
        ("nothing", ["--energy", "nan"], 2, "a number from 0 on"),
        ("nothing", ["--max-theta", "1"], 3, "directions can be used; expected 4"),
        ("nothing", ["--workers", "0"], 2, "from 1 on"),
        ("nothing", ["--max-theta", "95"], 2, "0 to 90"),
        ("nothing", ["--fix", "ggx.beta=1"], 2, "no parameter 'ggx.beta'"),
        ("nothing", ["-o", "a.h5"], 2, "file of the data"),
        ("nothing", ["-o", "note.txt"], 2, "not overwritten"),
        ("nothing", ["-o", "no/where.h5"], 2, "does not exist"),
        ("missing", [], 3, "no such file"),
        ("text", [], 3, "not an HDF5 file"),
        ("units", [], 3, "expected 'rad' or 'deg'"),
        ("angles", [], 3, "expected (60,)"),
        ("value", [], 3, "no data set 'value'"),
        ("shape", [], 3, "expected (t, n, c)"),
        ("mask", [], 3, "'valid' has the shape"),
        ("below", [], 3, "no row is left"),
    ],
)
def test_what_makes_no_sense_is_refused(
    spoil, options, code, words, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path("note.txt").write_text("mine")
    path = texel_samples.write(Path("a.h5"), np.ones((4, 60, 3)), ANGLES)
    with h5py.File(path, "r+") as file:
        if spoil == "units":
            del file["phi_r"].attrs["units"]
        if spoil == "angles":
            del file["theta_i"]
            file["theta_i"] = np.zeros(59)
        if spoil in ("value", "shape"):
            del file["value"]
        if spoil == "shape":
            file["value"] = np.ones((60, 3))
        if spoil == "mask":
            file["valid"] = np.ones((4, 60))
        if spoil == "below":
            file["theta_r"][...] = 120.0
    if spoil == "missing":
        path.unlink()
    if spoil == "text":
        path.write_text("not numbers")
    before = sorted(os.listdir())
    assert main(["texels", "a.h5", *options]) == code
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert sorted(os.listdir()) == before


@pytest.mark.slow
def test_killed_it_goes_on_and_ends_the_same(tmp_path):
    """Begun by one process, ended by two; a line of texels is a chunk."""
    lines, columns, folder = 8, 4100, tmp_path
    wide = np.broadcast_to(sample(1)[:, None], (lines, columns, 60, 3)).astype(np.float32)
    texel_samples.write(folder / "wide.h5", wide, ANGLES)
    command = ("texels", "wide.h5", "-o", "out.h5")
    running = process(*command, cwd=folder)
    parts, end = folder / "out.h5.parts", time.monotonic() + PATIENCE_S
    while len(list(parts.glob("*.npz"))) < 2:
        assert running.poll() is None, running.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)
    running.send_signal(signal.SIGKILL)
    running.communicate()
    assert not (folder / "out.h5").exists()
    before = {p.name: p.stat().st_mtime_ns for p in parts.glob("*.npz")}
    assert 2 <= len(before) < lines

    refused = process(*command, cwd=folder)
    _, err = refused.communicate(timeout=PATIENCE_S)
    assert refused.returncode == 2
    assert "--resume goes on" in err
    other = process(*command, "--resume", "-m", "lambert", cwd=folder)
    _, err = other.communicate(timeout=PATIENCE_S)
    assert other.returncode == 2
    assert "other options" in err

    again = process(*command, "--resume", "--json", "--workers", 2, cwd=folder)
    out, err = again.communicate(timeout=PATIENCE_S)
    assert again.returncode == 0, err
    assert json.loads(out)["fitted_now"] <= (lines - len(before)) * columns
    assert not parts.exists()
    cost = arrays(folder / "out.h5")["cost"]
    assert cost.shape == (lines, columns)
    # Equal texels, whichever process and run they were fitted in.
    assert np.unique(cost).size == 1


# What getrusage says of a new process is at least what its parent had.
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs Linux's /proc")
@pytest.mark.slow
def test_memory_does_not_grow_with_the_file(tmp_path):
    peaks = []
    for lines in (2, 8):
        wide = np.broadcast_to(sample(1)[:, None], (lines, 8000, 60, 3))
        texel_samples.write(tmp_path / "wide.h5", wide.astype(np.float32), ANGLES)
        program = (
            "import re, sys; from fitting.cli import main; code = main(sys.argv[1:]); "
            "status = open('/proc/self/status').read(); "
            "print(re.search(r'VmHWM:\\s+(\\d+)', status)[1]); sys.exit(code)"
        )
        done = subprocess.run(
            [sys.executable, "-c", program, "texels", "wide.h5", "-o", "out.h5", "-q"],
            cwd=tmp_path, capture_output=True, text=True, check=True,
            env=os.environ | haste.environment(ROOT) | {"PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        peaks.append(int(done.stdout.split()[-1]) / 1024)
    # The larger file has 35 MB more of values, 69 MB as float64.
    assert peaks[1] < peaks[0] + 20, peaks
