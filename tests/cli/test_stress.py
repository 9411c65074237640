"""``brdf stress`` and ``check_lobe``, the latter also for lobes from outside."""

from __future__ import annotations

import json
from typing import ClassVar

import jax.numpy as jnp
import pytest
from running import refuse

from fitting import stress
from fitting.models import Lobe
from fitting.parameters import coefficient, shape
from fitting.stress import check_lobe


class Tilted(Lobe):
    """``f = albedo / pi cos_i^power``, which breaks what it promises."""

    NAME: ClassVar[str] = "tilted"
    REFERENCE: ClassVar[str] = "made up"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    def parameters(self):
        return (
            shape("power", 1.0, (0.5, 3.0), "exponent", scale="linear"),
            coefficient("albedo", 0.5, "factor"),
        )

    def basis(self, shape, geometry):
        up = geometry.reflects & (geometry.cos_i > 0)
        cosine = jnp.where(up, geometry.cos_i, 1.0)
        return (jnp.where(up, cosine ** shape["power"] / jnp.pi, 0.0),)

    def amplitudes(self, shape, coefficients):
        return coefficients

    def peak(self, shape):
        return None


class HonestlyTilted(Tilted):
    RECIPROCAL: ClassVar[bool] = False


def test_a_table_and_the_exit_code(run):
    outcome = run("stress", "lambert", "--points", "50")
    assert outcome.code == 0, outcome.out + outcome.err
    for words in ("lambert", "kept", "f32 max", "f64 max", "worst point"):
        assert words in outcome.out
    assert "50 points" in outcome.err


def test_json(run):
    outcome = run("stress", "lambert", "--points", "50", "--precision", "f32", "--json")
    (found,) = json.loads(outcome.out)
    assert found["passed"]
    assert [p["precision"] for p in found["precisions"]] == ["f32"]
    assert {f["name"] for f in found["findings"]} >= {
        "reciprocity",
        "albedo",
        "below the horizon",
        "rounding f32",
        "self-fit",
        "JSON round trip",
    }


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (("lamber",), ["did you mean 'lambert'"]),
        (("lambert + ggx",), ["2 lobes"]),
        (("lambert", "--points", "0"), ["--points"]),
        (("ggx(aniso)", "--options"), ["--options"]),
    ],
)
def test_what_makes_no_sense(run, argv, says):
    refuse(run, 2, "stress", *argv, says=says)


def broken(variant, *_, **__):
    bad = stress.Finding("sign f32", False, 1.0, "theta", "there is a value of -1")
    return stress.Report(variant.name, (bad,), ())


def test_a_broken_contract_is_said_and_exits_with_1(run, monkeypatch):
    monkeypatch.setattr(stress, "examine", broken)
    outcome = run("stress", "lambert")
    assert outcome.code == 1
    assert "1 of 1 fail: sign f32" in " ".join(outcome.out.split())
    assert "there is a value of -1; worst at theta" in outcome.out


def test_an_interrupt_keeps_what_is_finished(run, monkeypatch):
    seen = []

    def second_is_interrupted(variant, *_, **__):
        if seen:
            raise KeyboardInterrupt
        seen.append(variant.name)
        return broken(variant)

    monkeypatch.setattr(stress, "examine", second_is_interrupted)
    outcome = run("stress")
    assert outcome.code == 130
    assert seen[0] in outcome.out
    assert "interrupted after 1 of" in outcome.err


def test_own_lobe_that_breaks_its_promise():
    report = check_lobe(Tilted(), points=50, fit=False)
    assert not report.passed
    assert [f.name for f in report.failed] == ["reciprocity"]
    assert "FAILED reciprocity" in str(report)


def test_own_lobe_that_says_what_it_is():
    report = check_lobe(HonestlyTilted(), points=50)
    assert report.passed, str(report)
    assert "with differences" in str(report)
    assert report.precisions == ()
    assert any(f.name == "self-fit" and "recovers" in f.sentence for f in report.findings)
