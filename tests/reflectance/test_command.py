"""``brdf reflectance``, end to end."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from fitting.cli import main
from fitting.reflectance import Directional, Hemispherical, quantity
from fitting.sample import sample_path


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")

    def invoke(*argv: object) -> tuple[int, str, str]:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([str(a) for a in ("reflectance", *argv)])
        return code, out.getvalue(), " ".join(err.getvalue().split())

    return invoke


def test_table(run, fitted):
    code, out, _ = run(fitted.path, "--illuminant", "A", "--observer", "10")
    assert code == 0
    out = " ".join(out.split())
    for words in ("45/0", "8/d SCI", "8/d SCE", "white-sky", "±", "L*", "420 to 700 nm",
                  "CIE 1964 10 Degree", "under A", "error bound", "Gauss-Kronrod",
                  "k = 1", "trap of 8 deg"):  # fmt: skip
        assert words in out


def test_json(run, fitted):
    code, out, _ = run(fitted.path, "-g", "8/d", "--cone", "45:0,0", "--json")
    assert code == 0
    found = json.loads(out)
    assert (found["illuminant"], found["kind"]) == ("D65", "model")
    first, second = found["quantities"]
    beams = Directional(8.0), Hemispherical()
    expected = quantity(fitted.result, *beams, tolerance=1e-5)
    assert first["reflectance"]["value"] == expected.value
    assert first["reflectance"]["standard_uncertainty"] == expected.standard_uncertainty
    assert first["colour"]["luminous_reflectance_uncertainty"] > 0
    assert second["reflectance"]["name"] == "bidirectional"


def test_without_colour(run):
    Path("t.csv").write_text("theta_i_deg,theta_r_deg,phi_r_deg,mono\n45,0,0,0.3\n")
    code, out, _ = run("t.csv", "-g", "45/0")
    assert code == 0
    assert "mean factor" in out
    assert "no colour" in out
    assert "0.9425" in out


def test_reference(run, fitted):
    other = msgspec.structs.replace(
        fitted.result,
        parameters=[
            msgspec.structs.replace(p, value=[1.2 * v for v in p.value])
            if p.name == "lambert.albedo" else p
            for p in fitted.result.parameters
        ],
    )  # fmt: skip
    other.save("other.fit.json")
    options = ("-g", "8/d", "--json", "--reference")
    same = json.loads(run(fitted.path, *options, fitted.path)[1])
    assert same["quantities"][0]["delta_e_2000"] == pytest.approx(0.0, abs=1e-9)
    apart = json.loads(run(fitted.path, *options, "other.fit.json")[1])
    assert 1.0 < apart["quantities"][0]["delta_e_2000"] < 10.0
    assert "dE2000" in run(fitted.path, "-g", "8/d", "--reference", "other.fit.json")[1]


def test_file(run):
    code, out, _ = run(sample_path())
    assert code == 0
    out = " ".join(out.split())
    for words in ("nothing is fitted", "45/0", "8/d SCE", "extrapolated", "uniform light"):
        assert words in out
    found = json.loads(run(sample_path(), "-g", "8/d", "--json")[1])
    assert found["kind"] == "measurement"
    assert 0.9 < found["quantities"][0]["reflectance"]["covered"][0] < 1.0


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        (("-g", "9/x"), 2, "known: 45/0"),
        (("-g", "T 0/d"), 2, "transmits no light"),
        (("-g", "45/0 SCE"), 2, "specular component to exclude"),
        (("-g", "d/d SCE"), 2, "specular component to exclude"),
        (("--from", "back"), 2, "does nothing with such light"),
        (("--transmitted",), 2, "behind the sample"),
        (("-g", "8/d", "--illuminant", "D66"), 2, "illuminant"),
        (("--cone", "45:0"), 2, "INCIDENT,COLLECTED"),
        (("--cone", "45:x,0"), 2, "is no beam"),
        (("--cone", "95,0"), 2, "0 to 90"),
        (("--tolerance", "2"), 2, "tolerance"),
        (("--reference", "a.csv"), 2, "NAME.fit.json"),
        (("--reference", "none.fit.json"), 3, "none.fit.json"),
    ],
)
def test_errors(run, fitted, options, code, says):
    found, out, err = run(fitted.path, *options)
    assert (found, out) == (code, "")
    assert says in err
    assert "internal error" not in err


def test_errors_of_files(run, tmp_path):
    assert run("missing.astm")[0] == 3
    code, _, err = run(sample_path(), "-g", "T 0/d")
    assert (code, "fit a model" in err) == (3, True)
    assert run(sample_path(), "--cone", "45,0:0:5")[0] == 2


def test_help_is_quick():
    """No JAX for the help text."""
    code = (
        "import sys; from fitting.cli import main\n"
        "code = main(['reflectance', '--help'])\n"
        "sys.exit(code or ('jax' in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for words in ("--geometry", "--illuminant", "Examples:", "white-sky"):
        assert words in done.stdout
