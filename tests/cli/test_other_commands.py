"""``brdf info, convert, models, formats, score, doctor``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from running import refuse

import data_formats
from data_formats import Channel, Measurement
from fitting.cli.convert import losses
from fitting.models import LOBES
from fitting.sample import sample_path


def test_info(run):
    outcome = run("info", sample_path())
    assert outcome.code == 0
    for words in ("600 rows", "7 channels", "theta_i", "0 to 180", "400 nm", "exchanging"):
        assert words in outcome.out


def test_info_as_json(run):
    found = json.loads(run("info", sample_path(), "--json").out)
    assert found["rows"] == 600
    assert [round(i["theta_i_deg"]) for i in found["incidence"]] == [10, 30, 50, 65]
    assert all(i["nearest_to_mirror_deg"] < 0.01 for i in found["incidence"])
    assert all(i["nearest_to_retro_deg"] >= 6 for i in found["incidence"])
    assert found["values"]["valid"] == 1.0
    assert found["channels"][0]["wavelength_nm"] == 400.0


def strange(**changes) -> Measurement:
    plain = {
        "theta_i": [0.5], "phi_i": [0.0], "theta_r": [2.5], "phi_r": [3.0],
        "value": [[-0.1, np.nan]], "valid": [[True, False]],
        "channels": (Channel("R"), Channel("G")), "symmetry": "anisotropic",
    }  # fmt: skip
    return Measurement(**(plain | changes))


def test_info_of_next_to_nothing(run):
    data_formats.write(strange(), "one.csv")
    outcome = run("info", "one.csv")
    assert outcome.code == 0, outcome.err
    assert "transmitted" in outcome.out
    assert "1 negative" in outcome.out
    assert (
        json.loads(run("info", "one.csv", "--json").out)["channels"][1]["maximum"] is None
    )


def test_fit_of_next_to_nothing_is_unreadable_input(run):
    data_formats.write(strange(), "one.csv")
    refuse(run, 3, "fit", "one.csv", "-q", "-m", "lambert", says=["no row is left"])


@pytest.mark.parametrize(
    "name",
    ["cornell/garnet_red.astm", "minidiff/C9_Gold.astm", "pbrt/krylon_blue.brdf",
     "csv/test_brdf_viewer_2D_data.csv"],
)  # fmt: skip
def test_info_of_measured_files(run, real_data, name):
    outcome = run("info", real_data / name)
    assert outcome.code == 0, outcome.err
    assert "Quality" in outcome.out
    json.loads(run("info", real_data / name, "--json").out)


def test_reader_options(run):
    Path("t.csv").write_text("theta_i_deg,theta_r_deg,R\n10,20,3.0\n10,30,3.1\n")
    as_brf = json.loads(run("info", "t.csv", "--json", "--reader", "quantity=brf").out)
    assert as_brf["values"]["maximum"] == pytest.approx(3.1 / np.pi)
    refuse(run, 2, "info", "t.csv", "--reader", "colour=blue", says=["colour"])
    refuse(run, 2, "info", "t.csv", "--format", "xyz", says=["xyz", "astm"])


def test_convert_there_and_back(run):
    for name in ("a.csv", "b.h5", "c.astm"):
        outcome = run("convert", sample_path(), name)
        assert outcome.code == 0, outcome.err
        assert "holds everything" in outcome.out
        assert data_formats.read(name).equals(data_formats.read(sample_path()))


def test_convert_asks_before_overwriting(run):
    Path("a.csv").write_text("mine")
    refuse(run, 2, "convert", sample_path(), "a.csv", says=["a.csv", "--force"])
    assert Path("a.csv").read_text() == "mine"
    assert run("convert", sample_path(), "a.csv", "--force").code == 0
    assert data_formats.read("a.csv").n_rows == 600


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (("a.xyz",), 2, ["a.xyz", "--to"]),
        (("a.xyz", "--to", "pbrt"), 2, ["pbrt", "csv"]),
        (("nowhere/a.csv",), 2, ["nowhere"]),
    ],
)
def test_convert_refuses(run, argv, code, says):
    refuse(run, code, "convert", sample_path(), *argv, says=says)
    refuse(run, 3, "convert", "missing.astm", "b.csv", says=["missing.astm"])
    assert not list(Path.cwd().iterdir())


def test_losses_are_named():
    n = (1, 2)
    full = strange(sigma=np.full(n, 0.1), auxiliary={"t": [1.0]}, theta_r=[1.0])
    bare = strange(
        symmetry="isotropic", valid=np.ones(n, bool), value=[[-0.2, 1.0]],
        channels=(Channel("R"), Channel("B")), theta_r=[1.1],
    )  # fmt: skip
    said = " ".join(losses(full, bare))
    for word in (
        "channels",
        "symmetry",
        "uncertainties",
        "columns",
        "valid",
        "angles",
        "values",
    ):
        assert word in said
    assert losses(full, full) == []


def test_models(run):
    text = run("models").out
    assert all(name in text for name in LOBES)
    one = run("models", "ggx").out
    for words in ("Walter et al. 2007", "alpha", "support", "aniso", "reciprocal"):
        assert words in one
    refuse(run, 2, "models", "gxg", says=["did you mean 'ggx'"])


@pytest.mark.parametrize("name", LOBES)
def test_every_model_is_described(run, name):
    assert run("models", name).code == 0


def test_formats(run):
    text = run("formats").out
    for f in data_formats.formats():
        assert f.name in text
        assert f.name in run("formats", f.name).out
    assert "quantity=brdf" in run("formats", "csv").out
    refuse(run, 2, "formats", "nonsense", says=["nonsense", "astm"])


def test_score(run, fitted):
    outcome = run("score", sample_path(), fitted.file)
    assert outcome.code == 0, outcome.err
    assert "the file that it was fitted to" in outcome.out
    found = json.loads(run("score", sample_path(), fitted.file, "--json").out)
    scores = fitted.comparison.results[-1].scores
    assert found["scores"]["log1p"] == pytest.approx(scores.log1p, rel=1e-9)
    refuse(run, 3, "score", sample_path(), sample_path(), says=["not JSON"])
    data_formats.write(strange(theta_r=[1.0]), "other.csv")
    refuse(run, 2, "score", "other.csv", fitted.file, says=["channels"])


def test_doctor(run, fitted):
    outcome = run("doctor")
    assert outcome.code == 0, outcome.out
    assert outcome.out.count("ok ") == 6
    assert "BRDF_CACHE_DIR is empty" in outcome.out


def test_doctor_finds_problems(run, monkeypatch):
    from fitting.cli import doctor

    def broken():
        raise RuntimeError("no device")

    for check in ("_float64", "_sample", "_fit"):
        monkeypatch.setattr(doctor, check, lambda: doctor.Finding(True, "fine"))
    monkeypatch.setattr(doctor, "_devices", broken)
    blocked = Path("file")
    blocked.write_text("")
    monkeypatch.setenv("BRDF_CACHE_DIR", str(blocked / "cache"))
    outcome = run("doctor")
    assert outcome.code == 1
    assert outcome.out.count("problem") == 2
    assert "no device" in outcome.out
