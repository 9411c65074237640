"""``brdf fit``: what it prints, what it writes, and what it refuses."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import jsonschema
import msgspec
import pytest
from running import refuse

from fitting.cli import fit_run
from fitting.comparison import Comparison
from fitting.result import json_schema, load_result
from fitting.sample import PARAMETERS, sample_path


def test_compares_keeps_and_judges(fitted):
    outcome = fitted.outcome
    assert outcome.code == 0, outcome.err
    for words in (
        "Models compared",
        "held-out at theta_i",
        "* kept: lambert + ggx",
        "ggx.alpha",
        "Distance from the data",
        "Errors by angle of incidence",
        "Energy and reciprocity",
        "What the data determine",
        "Verdict",
        "written to two_lobe_paint.fit.json",
    ):
        assert words in outcome.out
    assert "no FILE given" in outcome.err
    assert "fitting lambert + ggx (2 of 2)" in outcome.err


def test_the_file_tells_what_the_kept_model_was_compared_with(fitted):
    found = load_result(fitted.file).candidates
    assert found is not None
    assert found.reason == fitted.comparison.reason
    for one, result in zip(found.models, fitted.comparison.results, strict=True):
        assert one.model == result.model
        assert one.error == result.scores.log1p
        assert one.held_out == result.cross_validation.typical
        assert one.parameters == sum(len(p.value) for p in result.parameters)
    assert [m.kept for m in found.models] == [False, True]


def test_writes_a_valid_result(fitted):
    jsonschema.validate(json.loads(fitted.file.read_text()), json_schema())
    result = load_result(fitted.file)
    assert result.model == "lambert + ggx"
    albedo = result.parameter("lambert.albedo")
    truth = PARAMETERS["lambert.albedo"]
    # One lobe cannot be two, but the colour of the base is not to be missed.
    assert albedo.value == pytest.approx(truth, abs=0.03)


def test_json_alone_on_stdout_and_no_file(run, done):
    outcome = run("fit", "--json")
    assert outcome.code == 0
    assert outcome.err == ""
    jsonschema.validate(json.loads(outcome.out), json_schema())
    assert not list(Path.cwd().iterdir())


def test_json_and_a_file_if_asked(run, done):
    outcome = run("fit", "--json", "-o", "x.json")
    assert Path("x.json").read_text() == outcome.out


def test_quiet_is_one_line(run, done):
    outcome = run("fit", "-q")
    assert outcome.code == 0
    assert outcome.err == ""
    assert len(outcome.out.split("\n\n")) <= 2
    assert "lambert + ggx" in outcome.out


def test_verbose_says_settings_and_sources(run, done):
    out = run("fit", "-v").out
    assert "objective log1p" in out
    assert "Walter et al. 2007" in out


def test_writes_into_the_current_folder_under_the_name_of_the_file(run, done):
    Path("data").mkdir()
    Path("data/paint.astm").write_bytes(sample_path().read_bytes())
    assert run("fit", "data/paint.astm").code == 0
    assert Path("paint.fit.json").is_file()
    assert [p.name for p in Path("data").iterdir()] == ["paint.astm"]


def test_overwrites_only_results(run, done):
    assert run("fit", "-o", "a.json").code == 0
    assert run("fit", "-o", "a.json").code == 0
    Path("b.json").write_text('{"mine": 1}')
    refuse(run, 2, "fit", "-o", "b.json", says=["b.json", "not overwritten"])
    assert Path("b.json").read_text() == '{"mine": 1}'


def test_no_convergence_is_exit_code_1(run, done, monkeypatch):
    (_, result) = done.comparison.results
    solver = msgspec.structs.replace(
        result.solver, converged=False, sentence="stopped after 99 steps"
    )
    bad = msgspec.structs.replace(result, solver=solver)
    monkeypatch.setattr(fit_run, "run", lambda *_: Comparison((bad,), 0, ""))
    outcome = run("fit")
    assert outcome.code == 1
    assert "Not a fit yet" in outcome.out
    assert "--starts" in outcome.out


def test_interrupted_leaves_nothing(run, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(fit_run, "run", interrupted)
    outcome = run("fit")
    assert outcome.code == 130
    assert "Traceback" not in outcome.err
    assert not list(Path.cwd().iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_real_interruption(tmp_path):
    # What a shell runs in the background ignores interruptions, and so do its children.
    program = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from fitting.cli import main; sys.exit(main())"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, "fit", "-m", "lambert + 2*ggx"],
        stderr=subprocess.PIPE, text=True, cwd=tmp_path,
    )  # fmt: skip
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith("fitting"):
            break
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err == "brdf: interrupted\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (OSError(28, "no space left"), 3)]
)
def test_nothing_is_left_if_writing_fails(run, done, monkeypatch, error, code):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(os, "replace", fails)
    assert run("fit").code == code
    assert not list(Path.cwd().iterdir())


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (("-m", "lambrt"), ["lambrt", "'lambert'"]),
        (("-m", "lambert", "--fix", "lambert.x=1"), ["lambert.x", "lambert.albedo"]),
        (("--fix", "ggx.f0"), ["NAME=VALUE"]),
        (("--fix", "ggx.f0=red"), ["NAME=VALUE"]),
        (("--bounds", "ggx.alpha=0.5:0.1"), ["LOW:HIGH"]),
        (("--tie", "ggx.f0"), ["FACTOR*OTHER"]),
        (("--noise", "1"), ["A,B"]),
        (("--energy", "-1"), ["hard"]),
        (("--max-theta", "91"), ["90 degrees"]),
        (("--starts", "0"), ["whole number"]),
        (("--reciprocity", "-2"), ["0 or more"]),
        (("--config", "nowhere.toml"), ["nowhere.toml"]),
        (("-o", "nowhere/x.json"), ["nowhere"]),
        (("--format", "nonsense"), ["nonsense", "astm"]),
        (("--reader", "colour=blue"), ["colour"]),
    ],
)
def test_refuses_senseless_options(run, argv, says):
    refuse(run, 2, "fit", *argv, says=says)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, ["does not exist"]),
        (b"", ["empty"]),
        (b"\x89PNG nonsense", ["VARS"]),
        (b"VARS theta_i,phi_i,theta_s,phi_s,R\n\n0,0,0,0,x\n", ["line"]),
    ],
)
def test_refuses_unreadable_files(run, content, says):
    if content is not None:
        Path("bad.astm").write_bytes(content)
    refuse(run, 3, "fit", "bad.astm", says=["bad.astm", *says])


def test_names_of_one_model_do_not_disturb_another(run, done, monkeypatch):
    monkeypatch.setattr(fit_run, "run", done.run)
    seen = {}

    def fake(_, model, options, **__):
        seen[model.expression] = options.fix
        return done.comparison.results[len(seen) - 1]

    monkeypatch.setattr(fit_run, "fit", fake)
    models = ("-m", "lambert", "-m", "lambert + ggx")
    assert run("fit", *models, "--fix", "ggx.f90=1").code == 0
    assert seen == {"lambert": {}, "lambert + ggx": {"ggx.f90": 1.0}}


def test_a_measured_file(run, real_data):
    outcome = run(
        "fit", real_data / "cornell" / "garnet_red.astm", "-m", "lambert", "--no-cv"
    )
    assert outcome.code == 0, outcome.err
    assert "7 of 31 channels" in outcome.out
    assert "About the data" in outcome.out
    assert "another model may do better" in outcome.out
    assert Path("garnet_red.fit.json").is_file()
