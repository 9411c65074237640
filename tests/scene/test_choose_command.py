"""``brdf choose``: what it prints, writes and refuses."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from pathlib import Path

import jsonschema
import msgspec
import pytest
from cli.running import Outcome, Run, invoke, refuse
from rich.console import Console

from data_formats import read
from fitting.cli import choose as command
from fitting.cli.work import Work
from fitting.model import Model
from fitting.result import json_schema, load_result
from fitting.sample import PARAMETERS, sample_path
from fitting.scene import choose as chooser
from fitting.scene.choice import Choice, FewerWavelengths
from fitting.scene.image_error import image_error
from fitting.scene.stage import ImageError
from fitting.tradeoff import operations

SCENE = """\
description = "A ball under one lamp"

[[lights]]
kind = "disk"
name = "lamp"
theta_deg = 40
phi_deg = 50
diameter_deg = 30

[seen]
kind = "sphere"
pixels = 12

[tolerance.colour_difference]
mean = 1.0
percentile_95 = 3.0
"""
MODELS = ("-m", "lambert", "-m", "lambert + ggx")


@dataclass(frozen=True)
class Done:
    """What one run on the sample printed, found and wrote."""

    outcome: Outcome
    choice: Choice
    folder: Path

    @property
    def text(self) -> str:
        return " ".join(self.outcome.out.split())


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    folder, seen = tmp_path_factory.mktemp("choose"), []
    real = chooser.choose_for_scene

    def spy(*args, **named):
        seen.append(real(*args, **named))
        return seen[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "100")
        patch.setattr(chooser, "choose_for_scene", spy)
        Path("tiny.toml").write_text(SCENE)
        outcome = invoke("choose", "--scene", "tiny.toml", *MODELS)
    assert outcome.code == 0, outcome.err
    return Done(outcome, seen[0], folder)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command in a folder with nothing but the scene."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    Path("tiny.toml").write_text(SCENE)
    return invoke


@pytest.fixture
def answer(run: Run, monkeypatch: pytest.MonkeyPatch):
    """Runs the command on the sample with an answer that is known already."""

    def with_choice(choice: Choice, *argv: object) -> Outcome:
        monkeypatch.setattr(command, "_run", lambda *_: choice)
        return run("choose", "--scene", "tiny.toml", *argv)

    return with_choice


def test_the_verdict_comes_first(done):
    first, *_ = done.outcome.out.split("\n\n")
    assert " ".join(first.split()) == f"{done.choice.verdict}."
    assert first.startswith("lambert + ggx is enough for tiny: off by 0.")
    assert "where 1 and 3 are allowed (CIEDE2000); no cheaper candidate is" in done.text
    assert max(map(len, done.outcome.out.splitlines())) <= 100


def test_the_table_has_every_candidate(done):
    """Costs are counted, 14 operations of a Lambertian in 7 channels."""
    matt, glossy = done.choice.candidates
    relative = operations("lambert", 7) / operations("lambert + ggx", 7)
    rows = [line.split() for line in done.outcome.out.splitlines()]
    mean, high = f"{matt.error.mean:.2g}", f"{matt.error.percentile_95:.2g}"
    change = f"{matt.change:.2g}"
    assert ["lambert", f"{relative:.2g}", "7", mean, high, "no", change] in rows
    mean, high = f"{glossy.error.mean:.2g}", f"{glossy.error.percentile_95:.2g}"
    assert ["*", "lambert", "+", "ggx", "1", "22", mean, high, "yes", "-"] in rows


def test_sentences(done):
    matt, glossy = done.choice.candidates
    for words in (
        "tiny: A ball under one lamp",
        "What the scene requires - lambert + ggx: 22 free parameters, 166 operations",
        "single precision (float32): rounding does not show",
        "one shape for all channels",
        "What cheaper candidates would miss - lambert changes this scene by",
        f"off by {matt.error.mean:.2g} instead of {glossy.error.mean:.2g}",
        "misses the tolerance by",
        "What the scene cannot see",
        "no light has details finer than 30 deg (lamp)",
        "What the data cannot support",
        "the noise of the data alone",
        "written to two_lobe_paint.tiny.fit.json",
    ):
        assert words in done.text
    assert "What dearer" not in done.text
    assert "How it was found" not in done.text


def test_says_what_it_does_on_stderr(done):
    for words in ("no FILE given", "7 channels", "refitting lambert + ggx (2 of 2)"):
        assert words in done.outcome.err


def test_writes_the_fit_that_it_judged(done):
    assert sorted(p.name for p in done.folder.iterdir()) == [
        "tiny.toml", "two_lobe_paint.tiny.fit.json"
    ]  # fmt: skip
    file = done.folder / "two_lobe_paint.tiny.fit.json"
    jsonschema.validate(json.loads(file.read_text()), json_schema())
    result = load_result(file)
    (error,) = image_error(read(sample_path()), [result], done.folder / "tiny.toml")
    assert error.mean == pytest.approx(done.choice.error.mean, rel=1e-3)
    albedo = result.parameter("lambert.albedo").value
    assert albedo == pytest.approx(PARAMETERS["lambert.albedo"], abs=0.03)


def test_json_is_everything_and_alone(done, answer):
    outcome = answer(done.choice, "--json")
    assert outcome.code == 0
    assert outcome.err == ""
    plain = json.loads(outcome.out, parse_constant=pytest.fail)
    assert msgspec.convert(plain, Choice) == done.choice
    jsonschema.validate(plain["result"], json_schema())
    assert [p.name for p in Path.cwd().iterdir()] == ["tiny.toml"]


def test_a_file_of_ones_own_and_quiet(done, answer):
    outcome = answer(done.choice, "--json", "-o", "mine.json")
    assert load_result("mine.json").model == json.loads(outcome.out)["result"]["model"]
    outcome = answer(done.choice, "-q")
    assert outcome.err == ""
    assert " ".join(outcome.out.split()) == f"{done.choice.verdict}."


def test_verbose_has_parameters_and_how_they_were_found(done, answer):
    out = " ".join(answer(done.choice, "-v").out.split())
    assert "How it was found" in out
    assert f"lambert {done.choice.candidates[0].objective} float32" in out
    assert "ggx.alpha" in out
    assert "700 nm" in out


def test_nothing_good_enough_is_exit_code_1(done, answer):
    choice = msgspec.structs.replace(
        done.choice, met=False, verdict="no candidate is within the tolerance of tiny"
    )
    outcome = answer(choice)
    assert outcome.code == 1
    assert outcome.out.startswith("No candidate is within")
    assert "What comes nearest" in outcome.out
    assert Path("two_lobe_paint.tiny.fit.json").exists()


def wavelengths(n: int, mean: float, within: bool) -> FewerWavelengths:
    error = ImageError("colour difference", mean, 2 * mean, mean, 2 * mean, 0.0, 0.0)
    at = [400.0 + 300.0 * k / (n - 1) for k in range(n)]
    return FewerWavelengths(at, error, within)


def test_wavelengths_that_are_enough(done, answer):
    listed = [wavelengths(7, 0.31, True), wavelengths(3, 2.6, False)]
    choice = msgspec.structs.replace(done.choice, wavelengths=listed)
    text = " ".join(answer(choice).out.split())
    assert (
        "coefficients at 7 of 7 wavelengths (400, 450, 500, ..., 700 nm), linear between "
        "them: off by 0.31 on average and 0.62 at the 95th percentile; at 3 (400, 550, 700 "
        "nm) off by 2.6 on average and 5.2 at the 95th percentile, too much"
    ) in text
    choice = msgspec.structs.replace(done.choice, wavelengths=listed[1:])
    text = " ".join(answer(choice).out.split())
    assert "coefficients at all 7 wavelengths; at 3 (400, 550, 700 nm) off by 2.6" in text


def test_an_albedo_has_one_number_and_radiance_is_relative(done, answer):
    choice = msgspec.structs.replace(done.choice, measure="albedo", limits=[0.02])
    out = answer(choice).out
    assert "95 %" not in out.split("Candidates")[1].split("What the scene requires")[0]
    assert "largest difference of the albedos" in out
    choice = msgspec.structs.replace(done.choice, measure="relative radiance")
    mean = done.choice.candidates[0].error.mean
    assert f"{100 * mean:.2g} %" in answer(choice).out


def test_warns_of_more_light_than_arrives(done, answer):
    energy = msgspec.structs.replace(done.choice.result.energy, max_albedo=1.25)
    result = msgspec.structs.replace(done.choice.result, energy=energy)
    choice = msgspec.structs.replace(done.choice, result=result)
    assert "reflects more than arrives, up to 1.250" in answer(choice).out
    assert "reflects more than arrives" not in done.outcome.out


def test_options_reach_the_fits(done, run, monkeypatch):
    asked = []

    def spy(measurement, scene, models, *, progress, **settings):
        asked.append((models, settings))
        for what in ("interpolating", "lighting", "refitting", "uncertainties"):
            progress(what)
        return done.choice

    monkeypatch.setattr(chooser, "choose_for_scene", spy)
    outcome = run(
        "choose", "--scene", "tiny.toml", "-m", "2*ggx+lambert", "--max-theta", "75",
        "--fix", "*.f90=1", "--bounds", "ggx1.alpha=0.01:",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    ((models, settings),) = asked
    assert [Model(m).labels for m in models] == [Model("2*ggx+lambert").labels]
    assert settings == {
        "max_theta_deg": 75.0,
        "fix": {"*.f90": 1.0},
        "bounds": {"ggx1.alpha": (0.01, float("inf"))},
    }


@pytest.mark.parametrize(
    ("beside", "done"), [(1, [0, 4, 8, 23, 38, 68]), (2, [0, 4, 4, 8, 23, 68])]
)
def test_progress_is_by_what_is_done(monkeypatch, beside, done):
    """Of two refits at the same time, neither is done when the second begins."""
    said = []
    with Work(Console(file=io.StringIO()), 68, quiet=True) as work:
        monkeypatch.setattr(work, "at", lambda what, least, more: said.append(least))
        tell = command._teller(work, [4, 4, 15, 15, 30], beside)
        for what in ("data", "light", "refitting a", "refitting b", "refitting c", "end"):
            tell(what)
    assert said == done


def test_names_of_results():
    named = command._target((Path("x/a.astm"), Path("b.csv.gz")), "scenes/mine.toml")
    assert named == Path("a+b.mine.fit.json")
    assert command._target((Path("a.astm"),), "sun") == Path("a.sun.fit.json")


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (("--scene", "stduio"), 3, ["stduio", "did you mean studio?"]),
        (("-m", "lamber"), 2, ["lamber"]),
        (("-m", "lambert_transmission"), 2, ["does not reflect"]),
        (("--max-theta", "95"), 2, ["--max-theta"]),
        ((*MODELS, "--fix", "ggx.f91=1"), 2, ["--fix ggx.f91", "no such parameter"]),
        ((*MODELS, "--bounds", "ggx.alpha=1"), 2, ["LOW:HIGH"]),
        (("-o", "nowhere/a.fit.json"), 2, ["nowhere"]),
        (("-o", "tiny.toml"), 2, ["tiny.toml", "is not a fit result"]),
        (("nothing.astm",), 3, ["nothing.astm"]),
    ],
)
def test_what_makes_no_sense(run, argv, code, says):
    refuse(run, code, "choose", *argv, says=says)


def test_help_says_what_exit_code_1_means(run):
    assert "1 of this command: no candidate is within" in run("choose", "--help").out
