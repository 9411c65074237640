"""A report says what its result says, and nothing that it should not."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import shlex
from decimal import Decimal
from pathlib import Path

import msgspec
import numpy as np
import pytest
from html_tree import Node, parse, table

from fitting.cli import main
from fitting.report import Reported, comparing, page
from fitting.report.blocks import Words
from fitting.report.figures import FIRST, MORE
from fitting.report.reproduce import command
from fitting.result import DataNote, load_result

change = msgspec.structs.replace
EVIL = "<script>alert(1)</script><img src=x onerror=y>&amp;\"'{{ 7*7 }}`a`"


@pytest.fixture(scope="session")
def tree(html: str) -> Node:
    return parse(html)


@pytest.fixture(scope="session")
def plain(kept) -> dict:
    """The result as JSON has it."""
    return json.loads(kept.to_json())


@pytest.fixture
def no_figures(monkeypatch):
    monkeypatch.setattr("fitting.report.figures.FIRST", ())
    monkeypatch.setattr("fitting.report.figures.MORE", ())


def shown(text: str, value: float, *, scale: float = 1.0) -> bool:
    """Whether a number is what is written, to half a unit of the last digit written."""
    written = Decimal(text)
    unit = Decimal(1).scaleb(int(written.as_tuple().exponent))
    return abs(float(written) - scale * value) <= 0.5001 * float(unit)


def test_structure(tree):
    page_node = tree.one("html")
    assert page_node.attributes["lang"] == "en"
    assert tree.one("title").text == "Synthetic two-lobe paint: report of a BRDF fit"
    assert tree.one("h1").text == "Synthetic two-lobe paint"
    for landmark in ("header", "nav", "main", "footer"):
        assert tree.one(landmark)
    ids = [n.attributes["id"] for n in tree.all() if "id" in n.attributes]
    assert len(ids) == len(set(ids))
    skip = next(tree.one("body").all("a"))
    assert skip.attributes["href"] == "#main"
    for link in tree.all("a"):
        assert link.attributes["href"].removeprefix("#") in ids
    for node in tree.all():
        for name in ("aria-labelledby", "aria-describedby"):
            assert node.attributes.get(name, ids[0]) in ids
    for head in tree.all("th"):
        assert head.attributes["scope"] in ("row", "col")
        assert head.text
    for one in tree.all("table"):
        assert one.one("caption").text


def test_the_verdict_comes_first(tree, kept, data):
    first = next(tree.one("main").all("section"))
    assert first.one("h2").text == "Verdict"
    words = next(first.all("p")).text
    assert "typically" in words
    shares = re.findall(r"([\d.]+)\s%", words)
    assert shown(shares[0], kept.typical_deviation, scale=100)
    yardstick = kept.data.reciprocity.median_relative_difference
    assert shown(shares[1], yardstick, scale=100)


def test_parameters_are_those_of_the_result(tree, plain):
    channels = [c["name"] for c in plain["channels"]]
    one = {row["parameter"]: row for row in table(tree, "p-one")}
    each = table(tree, "p-each0")
    assert [row["channel"] for row in each] == channels
    checked = 0
    for p in plain["parameters"]:
        for c, value in enumerate(p["value"]):
            cell = each[c][p["name"]] if len(p["value"]) > 1 else one[p["name"]]["value"]
            u = p["standard_uncertainty"][c]
            if p["fixed"]:
                assert cell == f"{value:.4g} (fixed)"
            else:
                number, uncertainty = cell.split(" ± ")
                assert shown(number, value)
                assert shown(uncertainty, u)
                assert float(uncertainty) == pytest.approx(u, rel=0.06)
            checked += 1
    assert checked == 1 + 3 * len(channels)
    alpha = next(p for p in plain["parameters"] if p["name"] == "ggx.alpha")
    ends = one["ggx.alpha"]["interval"].split(" to ")
    assert all(shown(e, v) for e, v in zip(ends, alpha["interval_95"][0], strict=True))


def test_errors_are_those_of_the_result(tree, plain):
    for row in table(tree, "d-scores"):
        assert shown(row["value"], plain["scores"][row["objective"]])
    held = plain["cross_validation"]["by_angle"]
    for row, a, h in zip(table(tree, "d-angles"), plain["by_angle"], held, strict=True):
        assert shown(row["theta_i / deg"], a["theta_i_deg"])
        assert int(row["rows"]) == a["rows"]
        assert shown(row["log1p"], a["objective"])
        assert shown(row["l2 / (1/sr)"], a["l2"])
        assert shown(row["held-out log1p"], h["objective"])
        assert shown(row["held-out l2"], h["l2"])
    for row, c in zip(table(tree, "d-channels"), plain["by_channel"], strict=True):
        assert row["channel"] == c["channel"]
        assert shown(row["RMS / (1/sr)"], c["rms"])
        share = row["of the data's RMS"].removesuffix("%")
        assert shown(share.strip(), c["relative_rms"], scale=100)


def test_data_and_candidates_are_those_of_the_result(tree, plain):
    for row, a in zip(table(tree, "data-albedo"), plain["data"]["albedo"], strict=True):
        assert shown(row["albedo"], a["albedo"])
        share = row["hemisphere covered"].removesuffix("%").strip()
        assert shown(share, a["covered"], scale=100)
    models = plain["candidates"]["models"]
    for row, m in zip(table(tree, "candidates"), models, strict=True):
        assert row["model"] == m["model"]
        assert int(row["parameters"]) == m["parameters"]
        assert shown(row["error"], m["error"])
        assert shown(row["held-out"], m["held_out"])
        assert ("kept" in row["remark"]) == m["kept"]
    facts = tree.by_id("data").text
    assert plain["data"]["sha256"] in facts
    assert plain["data"]["instrument"] in facts


def test_several_results(tree, kept, other):
    first, second = table(tree, "results")
    assert (first["result"], second["result"]) == ("a.fit.json", "b.fit.json")
    assert shown(second["l2 / (1/sr)"], other.scores.l2)
    albedo = other.parameter("lambert.albedo")
    for row, value in zip(table(tree, "p1-each0"), albedo.value, strict=True):
        assert shown(row["lambert.albedo"].split(" ± ")[0], value)


def test_results_that_do_not_compare(kept, other):
    def said(second) -> str:
        blocks = comparing.blocks([Reported(kept), Reported(second)])
        return blocks[-1].text if isinstance(blocks[-1], Words) else ""

    assert said(other) == ""
    settings = change(other.settings, objective="l2")
    assert "compare them by l2" in said(change(other, settings=settings))
    fewer = change(other.data, rows_used=7)
    assert "different rows" in said(change(other, data=fewer))
    strange = change(other.data, sha256="0" * 64)
    assert "different data" in said(change(other, data=strange))


def test_figures_and_their_main_numbers(tree, kept):
    alternatives = [img.attributes["alt"] for img in tree.all("img")]
    assert len(alternatives) == len(FIRST) + len(MORE)
    assert all(a.endswith(".") for a in alternatives)
    said = dict(zip((*FIRST, *MORE), alternatives, strict=True))
    worst = max(kept.by_angle, key=lambda a: a.objective)
    assert f"theta_i = {worst.theta_i_deg:.0f}" in said["residuals"]
    (albedo,) = re.findall(r"Largest albedo of the fit ([\d.]+),", said["albedo"])
    assert shown(albedo, kept.energy.max_albedo)
    (r,) = re.findall(r"correlation is (-?[\d.]+),", said["correlations"])
    every = np.array(kept.correlations.matrices, dtype=float)
    off = every - np.eye(every.shape[1])
    assert shown(r.lstrip("-"), float(np.nanmax(np.abs(off))))
    assert re.search(r"CIEDE2000\): [\d.]+ in sun", said["sphere"])
    for img in tree.all("img"):
        pattern = r"^data:image/(svg\+xml|webp);base64,(.*)$"
        ((kind, text),) = re.findall(pattern, img.attributes["src"])
        begin = base64.b64decode(text)[:40]
        assert b"<?xml" in begin if kind == "svg+xml" else b"WEBP" in begin


def test_nothing_is_loaded_from_anywhere(html, tree):
    for node in tree.all():
        for name in ("src", "href", "srcset", "action", "data", "poster"):
            value = node.attributes.get(name, "#")
            assert value.startswith(("#", "data:image/")), (node.tag, value)
        assert not any(name.startswith("on") for name in node.attributes)
    assert not list(tree.all("script", "link", "iframe", "object", "embed"))
    style = tree.one("style").text
    assert "url(" not in style
    assert "@import" not in style
    policy = next(
        m.attributes["content"]
        for m in tree.all("meta")
        if m.attributes.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy.startswith("default-src 'none'; ")
    assert "script-src 'none'" in policy


def test_text_of_files_is_text(kept, no_figures):
    written = change(
        kept.data, path=f"/tmp/{EVIL}", sample=EVIL, instrument=EVIL, date=EVIL,
        left_out=[EVIL], notes=[DataNote("x", EVIL, 2)],
    )  # fmt: skip
    evil = change(kept, identifiability=[EVIL], references=[EVIL], data=written)
    every = [Reported(evil, None, EVIL, EVIL)]
    with_viewer = parse(page(every))
    assert not list(with_viewer.all("img"))
    for script in with_viewer.all("script"):
        assert "<script>alert" not in script.text
    tree = parse(page(every, viewer=False))
    assert not list(tree.all("script", "img"))
    assert tree.one("h1").text == EVIL
    assert tree.one("title").text == f"{EVIL}: report of a BRDF fit"
    # What is between backticks is code in sentences, and the only thing that is not kept.
    said = EVIL.replace("`a`", " a")
    for section in ("data", "cite", "determined"):
        assert said in tree.by_id(section).text
    assert EVIL in tree.one("footer").text
    again = tree.by_id("again").one("pre").text
    assert shlex.split(again)[2] == f"/tmp/{EVIL}"


def test_without_the_data(kept, coarse, monkeypatch):
    monkeypatch.setattr("fitting.report.figures.FIRST", ("residuals", "spectrum"))
    monkeypatch.setattr("fitting.report.figures.MORE", ())
    why = "own.astm is not there any more; give it with --data"
    tree = parse(page([Reported(kept, None, why, "a.fit.json")]))
    figures = tree.by_id("figures")
    assert len(list(figures.all("img"))) == 1
    assert "residuals: it needs the measurement" in figures.text
    assert why in tree.by_id("data").text
    assert f"{kept.model} is typically" in tree.by_id("verdict").text


def test_what_a_file_says_of_itself_is_cited(kept, data, no_figures):
    header = {"Citation": "Doe 2020", "COLOUR": "red"}
    source = dataclasses.replace(data.provenance, header=header)
    own = dataclasses.replace(data, provenance=source)
    text = parse(page([Reported(kept, own)])).by_id("cite").text
    assert "Citation: Doe 2020" in text
    assert "COLOUR" not in text
    assert all(reference in text for reference in kept.references)
    assert kept.data.sha256[:16] in text


@pytest.mark.parametrize(
    "options",
    [
        ("-m", "lambert + ggx", "--fix", "ggx.f90=0.25", "--bounds", "ggx.alpha=:0.7",
         "--starts", "2", "--max-theta", "67.5", "--energy", "hard", "--no-cv"),
        pytest.param(
            ("-m", "lambert + blinn_phong", "--tie", "blinn_phong.f90=2*blinn_phong.f0",
             "--noise", "0.01,0.0003", "--objective", "chi2", "--weights", "rows",
             "--robust", "--starts", "1", "--no-cv"), marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_the_command_makes_the_same_fit_again(options, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["fit", *options, "-o", "a.fit.json", "-q"]) == 0
    first = load_result("a.fit.json")
    words = shlex.split(command(first))
    assert words[0] == "brdf"
    assert main([*words[1:], "-o", "b.fit.json", "-q"]) == 0
    again = load_result("b.fit.json")
    assert again.settings == first.settings
    assert again.parameters == first.parameters
    assert capsys.readouterr().err == ""
    assert Path(words[2]).name == "two_lobe_paint.astm"
