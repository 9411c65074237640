"""``brdf report``, end to end."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from html_tree import parse

import data_formats
from fitting.cli import main
from fitting.sample import sample_path


@pytest.fixture
def run(kept, other, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Runs the command in a folder with two results; with few figures."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr("fitting.report.figures.FIRST", ("starts",))
    monkeypatch.setattr("fitting.report.figures.MORE", ())
    kept.save("paint.fit.json")
    other.save("other.fit.json")

    def invoke(*argv: object) -> tuple[int, str, str]:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([str(a) for a in ("report", *argv)])
        return code, out.getvalue(), err.getvalue()

    return invoke


def refuses(run: Callable, *argv: object, says: str, code: int = 2) -> None:
    before = sorted(Path.cwd().iterdir())
    found, out, err = run(*argv)
    assert (found, out) == (code, ""), err
    assert err.startswith("brdf: ")
    assert err.count("\n") == 1
    assert re.search(says, err), err
    assert sorted(Path.cwd().iterdir()) == before


def test_one_result(run):
    assert run("paint.fit.json", "--no-viewer") == (0, "paint.report.html\n", "")
    tree = parse(Path("paint.report.html").read_text("utf-8"))
    assert tree.one("h1").text == "Synthetic two-lobe paint"
    assert len(list(tree.all("img"))) == 1
    assert "paint.fit.json" in tree.one("footer").text
    assert sorted(p.name for p in Path.cwd().iterdir()) == [
        "other.fit.json", "paint.fit.json", "paint.report.html"
    ]  # fmt: skip


def test_the_same_result_makes_the_same_file(run):
    run("paint.fit.json", "--no-viewer", "-o", "a.html")
    run("paint.fit.json", "--no-viewer", "-o", "b.html")
    assert Path("a.html").read_bytes() == Path("b.html").read_bytes()


def test_several_results_a_folder_and_json(run):
    Path("out").mkdir()
    code, out, _ = run(
        "paint.fit.json", "other.fit.json", "-o", "out", "--no-viewer", "--json"
    )
    done = json.loads(out)
    assert (code, done["path"]) == (0, str(Path("out") / "paint.report.html"))
    assert done["without_data"] is None
    tree = parse(Path(done["path"]).read_text("utf-8"))
    assert done["verdict"] in tree.by_id("verdict").text.replace("\xa0", " ")
    assert "other.fit.json: lambert" in tree.by_id("others").text


def test_without_its_measurement(run, kept, tmp_path, monkeypatch):
    monkeypatch.setattr("fitting.report.figures.FIRST", ("starts", "residuals"))
    text = (tmp_path / "paint.fit.json").read_text()
    moved = text.replace(str(sample_path()), "gone.astm")
    assert moved != text
    (tmp_path / "moved.fit.json").write_text(moved)
    code, out, err = run("moved.fit.json", "--no-viewer")
    assert (code, out) == (0, "moved.report.html\n")
    assert err.startswith("without measured points: gone.astm is not there any more")
    tree = parse(Path("moved.report.html").read_text("utf-8"))
    assert len(list(tree.all("img"))) == 1
    assert "residuals: it needs the measurement" in tree.by_id("figures").text
    assert "gone.astm is not there any more" in tree.by_id("data").text
    shutil.copy(sample_path(), "found.astm")
    code, _, err = run("moved.fit.json", "--data", "found.astm", "--no-viewer", "-q")
    assert (code, err) == (0, "")
    tree = parse(Path("moved.report.html").read_text("utf-8"))
    assert len(list(tree.all("img"))) == 2


def test_usage_errors(run, tmp_path, data):
    refuses(run, says="expected a result of `brdf fit`")
    refuses(run, "paint.fit.json", "paint.fit.json", says="given twice")
    refuses(
        run, "paint.fit.json", "-o", "a.txt", says="a.txt: expected .*html, or a folder"
    )
    refuses(run, "paint.fit.json", "-o", "no/a.html", says="the folder no does not exist")
    refuses(run, "paint.fit.json", "--data-format", "csv", says="is that of --data")
    refuses(run, "none.fit.json", says="No such file", code=3)
    (tmp_path / "odd.fit.json").write_text("{}")
    refuses(run, "odd.fit.json", says="schema_version", code=3)
    one = data_formats.Measurement(
        data.theta_i, data.phi_i, data.theta_r, data.phi_r, value=data.value[:, :1],
        valid=data.valid[:, :1], channels=(data_formats.Channel("mono"),),
    )  # fmt: skip
    data_formats.write(one, tmp_path / "mono.csv")
    refuses(run, "paint.fit.json", "--data", "mono.csv", says="has 1 channel .mono.")


def test_without_jinja2(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    refuses(run, "paint.fit.json", says="reports need jinja2.*brdf-fitting.report")


def test_without_matplotlib(run, monkeypatch):
    """There is a report all the same, which says what would draw its figures."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, _, _ = run("paint.fit.json", "--no-viewer")
    assert code == 0
    tree = parse(Path("paint.report.html").read_text("utf-8"))
    assert "There are no figures: figures need matplotlib" in tree.by_id("figures").text
    assert not list(tree.all("img"))


def test_a_failure_leaves_the_old_report(run, monkeypatch):
    Path("paint.report.html").write_text("old")

    def fails(*_args, **_options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", fails)
    code, out, err = run("paint.fit.json", "--no-viewer")
    assert (code, out) == (3, "")
    assert "paint.report.html" in err
    assert Path("paint.report.html").read_text() == "old"
