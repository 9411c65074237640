"""``brdf tradeoff``: what it prints, writes, draws, keeps when interrupted, and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest
from cli.running import Outcome, invoke, one_sentence

from fitting.result import load_result
from fitting.tradeoff import operations, study
from fitting.tradeoff.table import Tradeoff, TradeoffError, judged, load_tradeoff

MODELS = ("-m", "lambert", "-m", "lambert+ggx")
PLAIN = ("--quick", "--inside", "none", "--scene", "none")


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> tuple[Outcome, Path]:
    """One run on the sample, and its folder."""
    folder = tmp_path_factory.mktemp("tradeoff")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "100")
        outcome = invoke(
            "tradeoff", *MODELS, *PLAIN, "-o", "t.json", "--figure", "t.svg", "-v"
        )
    assert outcome.code == 0, outcome.err
    return outcome, folder


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def test_tables_and_sentences(done):
    outcome, _ = done
    for words in (
        "What an evaluation costs, 7 channels",
        "What fitting costs",
        "How far off",
        "What accuracy costs",
        "Held-out, all objectives",
        "times as much as lambert, for",
        "exchanging source and detector",
        "written to t.json",
        "written to t.svg",
    ):
        assert words in " ".join(outcome.out.split())
    assert "no FILE given" in outcome.err
    assert "lambert + ggx" in outcome.err


def test_what_is_written_is_what_was_found(done):
    _, folder = done
    table = load_tradeoff(folder / "t.json")
    assert json.loads(table.to_json()) == json.loads((folder / "t.json").read_text())
    assert sorted(p.name for p in folder.iterdir()) == ["t.json", "t.svg"]
    assert [c.model for c in table.candidates] == ["lambert", "lambert + ggx"]
    matt, glossy = table.candidates
    # A lobe more fits the sample of two lobes better, and costs more; both are worth it.
    assert matt.on_front
    assert glossy.on_front
    assert glossy.evaluation.operations == operations("lambert + ggx", 7)
    assert glossy.parameters == 7 + 1 + 2 * 7
    assert matt.parameters == 7
    assert glossy.errors.typical < 0.2 * matt.errors.typical
    assert glossy.errors.albedo.rms < 0.2 * matt.errors.albedo.rms
    assert glossy.fit.starts > 1
    # Sums for every channel, and at most a few arrays of the size of the rows.
    assert 7 * 8 < glossy.fit.memory_bytes < 10 * 600 * 7 * 8
    assert table.noise_floors[0].typical < glossy.errors.typical
    assert not table.interrupted
    assert table.trades == []


def test_other_axes_give_another_front(done):
    _, folder = done
    table = load_tradeoff(folder / "t.json")
    # Lambert has fewer parameters; by an error that nobody knows nothing has a place.
    by_image = judged(msgspec.structs.replace(table, error_axis="image"))
    assert not any(c.on_front for c in by_image.candidates)
    assert all("no place" in f for f in by_image.findings)
    worse = [
        msgspec.structs.replace(c, errors=table.candidates[1].errors)
        for c in table.candidates
    ]
    alike = judged(msgspec.structs.replace(table, candidates=worse))
    assert [c.dominated_by for c in alike.candidates] == [None, "lambert"]
    assert "which costs" in alike.findings[-1]


def test_the_figure_names_models_axes_and_noise(done):
    _, folder = done
    text = (folder / "t.svg").read_text()
    for words in ("lambert + ggx", "operations", "Pareto front", "exchanged directions"):
        assert words in text


def test_figure_has_logarithmic_axes_and_the_noise_at_its_height(done):
    from fitting.plots import tradeoff

    _, folder = done
    table = load_tradeoff(folder / "t.json")
    (axes,) = tradeoff.draw(table).axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    heights = [line.get_ydata()[0] for line in axes.get_lines() if len(line.get_ydata())]
    assert table.noise_floors[0].typical in heights
    low, high = axes.get_ylim()
    assert low < min(heights)
    assert high > max(heights)
    by_time = msgspec.structs.replace(table, cost_axis="fit", error_axis="albedo")
    assert "seconds" in tradeoff.draw(by_time).axes[0].get_xlabel()


def examined(table: Tradeoff, stop_at: int):
    """The second half of `study`, with the candidates of a table, up to an interrupt."""
    left = list(table.candidates)

    def one(measurement, model, plan, stage, say):
        if len(left) <= len(table.candidates) - stop_at:
            raise KeyboardInterrupt
        return study._Examined(left.pop(0), None)

    return one


def test_an_interrupt_keeps_what_is_finished(done, here, monkeypatch):
    table = load_tradeoff(done[1] / "t.json")
    monkeypatch.setattr(study, "_examine", examined(table, stop_at=1))
    outcome = invoke("tradeoff", *MODELS, *PLAIN, "-o", "half.json")
    assert outcome.code == 130
    assert "interrupted; this is what was finished" in outcome.err
    half = load_tradeoff(here / "half.json")
    assert half.interrupted
    assert [c.model for c in half.candidates] == ["lambert"]
    assert half.candidates[0].errors == table.candidates[0].errors
    assert "What fitting costs" in outcome.out


def test_an_interrupt_before_anything_says_so(done, here, monkeypatch):
    table = load_tradeoff(done[1] / "t.json")
    monkeypatch.setattr(study, "_examine", examined(table, stop_at=0))
    outcome = invoke("tradeoff", *MODELS, *PLAIN, "-o", "none.json")
    assert outcome.code == 130
    assert outcome.out == ""
    assert "before the first candidate" in outcome.err
    assert not list(here.iterdir())


def test_json_and_quiet(done, here, monkeypatch):
    table = load_tradeoff(done[1] / "t.json")
    for flag in ("--json", "-q"):
        monkeypatch.setattr(study, "_examine", examined(table, stop_at=2))
        outcome = invoke("tradeoff", *MODELS, *PLAIN, flag)
        assert outcome.code == 0
        assert outcome.err == ""
        if flag == "-q":
            first, second = outcome.out.splitlines()
            assert first.startswith("lambert: cost 14")
            assert second.startswith("lambert + ggx: cost")
        else:
            assert json.loads(outcome.out)["candidates"][1]["model"] == "lambert + ggx"


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (("-m", "lamber"), 2, ["lamber"]),
        (("-m", "lambert", "--inside", "gxx"), 2, ["gxx"]),
        (("--figure", "a.jpg"), 2, ["a.jpg", ".png"]),
        (("--figure", "nowhere/a.png"), 2, ["nowhere"]),
        (("-o", "nowhere/a.json"), 2, ["nowhere"]),
        (("--max-theta", "95"), 2, ["--max-theta"]),
        (("--cost", "money"), 2, ["cost"]),
        (("--scene", "stduio"), 3, ["stduio", "studio"]),
        (("nothing.astm",), 3, ["nothing.astm"]),
    ],
)
def test_what_makes_no_sense(here, argv, code, says):
    outcome = invoke("tradeoff", *argv)
    assert outcome.code == code, outcome.err
    assert one_sentence(outcome.err), outcome.err
    for word in says:
        assert word in outcome.err
    assert outcome.out == ""


def test_figures_without_matplotlib(here, monkeypatch):
    import importlib.util

    monkeypatch.setattr(importlib.util, "find_spec", lambda *_: None)
    outcome = invoke("tradeoff", "--figure", "a.png")
    assert outcome.code == 2
    assert "brdf-fitting[plots]" in outcome.err


def test_files_of_others_are_refused(here):
    Path("x.json").write_text('{"schema_version": 99}')
    with pytest.raises(TradeoffError, match="schema_version is 99"):
        load_tradeoff("x.json")
    Path("x.json").write_text("no")
    with pytest.raises(TradeoffError, match="not JSON"):
        load_tradeoff("x.json")
    with pytest.raises(TradeoffError):
        load_tradeoff("nothing.json")
    with pytest.raises(ValueError, match="expected"):
        load_result("x.json")
