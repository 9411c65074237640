"""``brdf scene``."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import pytest
from cli.running import Outcome, Run, invoke, refuse

from fitting.scene.load import PRESETS, preset_text


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return invoke


def explained(run: Run, what: str) -> dict:
    outcome = run("scene", what, "--json")
    assert outcome.code == 0, outcome.err
    return json.loads(outcome.out)


def test_the_list(run):
    outcome: Outcome = run("scene")
    assert outcome.code == 0
    assert all(name in outcome.out for name in PRESETS)
    assert [s["name"] for s in json.loads(run("scene", "--json").out)] == list(PRESETS)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_explained(run, name):
    outcome = run("scene", name)
    assert outcome.code == 0, outcome.err
    for word in ("Lights", "Viewer", "Tolerance", "share", "smallest alpha", "nm"):
        assert word in outcome.out
    assert max(map(len, outcome.out.splitlines())) <= 100
    found = explained(run, name)
    assert math.isclose(sum(light["share"] for light in found["lights"]), 1.0)


def test_numbers_of_the_sun(run):
    """0.53 deg / 2.57; the sun's share on what faces both: 90 of 90 + 13 + what is lit."""
    found = explained(run, "sun")
    sun, sky, ground = found["lights"]
    assert sun["smallest_alpha"] == pytest.approx(math.radians(0.53) / 2.57)
    assert found["smallest_alpha"] == sun["smallest_alpha"]
    assert 0.8 < sun["share"] < 0.9
    assert ground["share"] < sky["share"] < 0.2
    assert abs(found["facing_deg"][0] - 40) < 5
    assert "0.0036" in run("scene", "sun").out


def test_shares_on_a_flat_sample(run, tmp_path):
    """A beam from 60 degrees gives half of its brightness to what lies."""
    (tmp_path / "own.toml").write_text(
        "lights = [{kind='direction', theta_deg=60, name='beam'}, {kind='uniform'}]\n"
        "seen.kind = 'flat'\ntolerance.albedo = {}\n"
    )
    beam, sky = explained(run, "own.toml")["lights"]
    assert beam["share"] == pytest.approx(1 / 3, rel=1e-4)
    assert beam["smallest_alpha"] == 0
    assert sky["name"] == "uniform 2"
    text = run("scene", "own.toml").out
    assert "33 %" in text
    assert "any" in text
    assert "lobes of any width" in text


def test_a_histogram_and_a_detector(run, tmp_path):
    (tmp_path / "own.toml").write_text(
        "lights = [{kind='disk', diameter_deg=2, spectrum={bands=[[900, 1000, 1]]}}]\n"
        "seen = {kind='histogram', rows=[[10, 0, 20, 180, 1], [30, 0, 0, 0, 2]]}\n"
        "viewer = {observer='none', wavelengths_nm=[800, 1100], exposure=2}\n"
        "tolerance.relative_radiance = {}\n"
    )
    text = " ".join(run("scene", "own.toml").out.split())
    assert "2 weighted pairs of directions, incidence 10 to 30 deg and view 0 to 20" in text
    assert "no eye" in text
    assert "bands of 900 to 1000 nm" in text
    assert "from the angles of incidence of the histogram" in text


def test_a_copy_to_change(run, tmp_path):
    assert run("scene", "sun", "--write", "mine.toml").code == 0
    assert (tmp_path / "mine.toml").read_text() == preset_text("sun")
    assert explained(run, "mine.toml")["lights"] == explained(run, "sun")["lights"]
    refuse(run, 2, "scene", "sun", "--write", "mine.toml", says=["exists", "--force"])
    assert run("scene", "studio", "--write", "mine.toml", "--force").code == 0
    assert (tmp_path / "mine.toml").read_text() == preset_text("studio")
    refuse(run, 2, "scene", "son", "--write", "other.toml", says=["did you mean 'sun'"])
    refuse(run, 2, "scene", "--write", "other.toml", says=["overcast"])
    refuse(run, 2, "scene", "sun", "--write", "no/mine.toml", says=["does not exist"])
    assert not list(tmp_path.glob("mine.toml?*"))


def test_fields(run):
    text = run("scene", "--fields").out
    for word in ("[[lights]] kind =", "[tolerance.albedo]", "camera_theta_deg", "required"):
        assert word in text
    assert max(map(len, text.splitlines())) <= 100
    heads = [s["head"] for s in json.loads(run("scene", "--fields", "--json").out)]
    assert '[[lights]] kind = "map"' in heads
    refuse(run, 2, "scene", "sun", "--fields", says=["--fields stands alone"])


def test_what_is_wrong(run, tmp_path):
    refuse(run, 3, "scene", "son", says=["son: neither a file nor a preset", "sun"])
    (tmp_path / "own.toml").write_text(preset_text("sun").replace("0.53", "-0.53"))
    refuse(
        run, 3, "scene", "own.toml", says=["own.toml", "lights[0].diameter_deg", "-0.53"]
    )
    (tmp_path / "own.toml").write_text(
        "lights = [{kind='map', file='map.hdr'}]\nseen.kind = 'sphere'\n"
        "tolerance.colour_difference = {}\n"
    )
    refuse(run, 3, "scene", "own.toml", says=["map.hdr: No such file", "Radiance HDR"])


def test_help_loads_no_numbers(tmp_path):
    program = (
        "import sys; from fitting.cli import main; code = main(['scene', '--help']); "
        "sys.exit(code or bool({'numpy', 'jax', 'colour'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True
    )
    assert done.returncode == 0, done.stderr
