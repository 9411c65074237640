"""``brdf export`` as people and programs use it."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
from made_up import SPECTRAL, result_of

import data_formats
from fitting.cli import main
from fitting.export import TARGETS


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Runs a command in a folder that holds ``paint.fit.json``."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    result = result_of("lambert", SPECTRAL, lambert__albedo=np.linspace(0.2, 0.4, 6))
    result.save(tmp_path / "paint.fit.json")

    def call(*argv: object) -> tuple[int, str, str]:
        code = main(["export", *map(str, argv)])
        out, err = capsys.readouterr()
        return code, out, err

    return call


def test_without_a_result_it_lists_the_targets(run):
    code, out, _ = run()
    assert code == 0
    assert all(name in out for name in TARGETS)
    code, out, _ = run("--json")
    assert [t["name"] for t in json.loads(out)] == list(TARGETS)


def test_the_file_is_named_after_the_result(run, tmp_path):
    code, out, err = run("paint.fit.json", "--to", "mitsuba")
    assert code == 0
    assert "paint.xml" in out
    assert "none, it is the formula of the fit" in out
    assert err == ""
    assert "diffuse" in (tmp_path / "paint.xml").read_text()


def test_nothing_is_overwritten_unasked(run, tmp_path):
    path = tmp_path / "a.xml"
    path.write_text("mine")
    code, out, err = run("paint.fit.json", "--to", "mitsuba", "-o", path)
    assert (code, out) == (2, "")
    assert "--force" in err
    assert path.read_text() == "mine"
    assert run("paint.fit.json", "--to", "mitsuba", "-o", path, "--force")[0] == 0
    assert path.read_text() != "mine"


def test_json_for_programs(run):
    code, out, err = run("paint.fit.json", "--to", "mitsuba", "-o", "a.json", "--json")
    assert (code, err) == (0, "")
    report = json.loads(out)
    assert report["exact"] is True
    assert report["file"] == "a.json"
    assert report["residual"]["relative_rms"] < 1e-9
    assert any("D65" in c for c in report["conventions"])


def test_angles_of_a_table(run):
    angles = ("--theta-i", "30", "--theta-r", "0:40:10,70", "--phi-r", "0:180:90")
    code, out, _ = run("paint.fit.json", "--to", "csv", *angles)
    assert code == 0
    m = data_formats.read("paint.csv")
    found = np.unique(np.degrees(m.theta_r).round(9))
    np.testing.assert_array_equal(found, [0, 10, 20, 30, 40, 70])
    assert "theta_i 30;" in out


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (("paint.fit.json",), 2, "--to is missing"),
        (("--to", "csv"), 2, "which result"),
        (("paint.fit.json", "--to", "mitsubo"), 2, "did you mean 'mitsuba'"),
        (("paint.fit.json", "--to", "mitsuba", "-o", "a.png"), 2, ".xml or .json"),
        (("paint.fit.json", "--to", "mitsuba", "-o", "no/a.xml"), 2, "does not exist"),
        (("paint.fit.json", "--to", "csv", "--theta-r", "0:80"), 2, "START:END:STEP"),
        (("paint.fit.json", "--to", "csv", "--theta-r", "nan"), 2, "START:END:STEP"),
        (("paint.fit.json", "--to", "csv", "--theta-r", "200"), 2, "0 to 180"),
        (("paint.fit.json", "--to", "gltf", "--spectral"), 2, "gltf has no use"),
        (("paint.fit.json", "--to", "gltf", "--illuminant", "D66"), 2, "illuminant"),
        (("nothing.fit.json", "--to", "csv"), 3, "nothing.fit.json"),
    ],
)
def test_mistakes_are_one_sentence(run, tmp_path, argv, code, says):
    found, out, err = run(*argv)
    assert (found, out) == (code, "")
    assert says in err
    assert err.startswith("brdf: ")
    assert err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["paint.fit.json"]


def test_help_loads_no_numbers(run):
    before = set(sys.modules)
    code, out, _ = run("--help")
    assert code == 0
    assert "--as" in out
    assert not {m for m in set(sys.modules) - before if m.split(".")[0] == "mitsuba"}
