"""``brdf view`` as it is called."""

from __future__ import annotations

import contextlib
import io
import shutil
from pathlib import Path

import pytest

from fitting.cli import main
from fitting.result import FitResult
from fitting.sample import sample_path


@pytest.fixture
def results(glossy: FitResult, matt: FitResult, tmp_path: Path, monkeypatch) -> list[str]:
    monkeypatch.chdir(tmp_path)
    glossy.save("a.fit.json")
    matt.save("b.fit.json")
    return ["a.fit.json", "b.fit.json"]


def run(*argv: object) -> tuple[int, str, str]:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([str(a) for a in argv])
    return code, out.getvalue(), err.getvalue()


def test_writes_a_page(results: list[str]) -> None:
    code, out, _ = run("view", *results)
    assert code == 0
    assert out == "a.view.html\n"
    text = Path("a.view.html").read_text("utf-8")
    assert "Content-Security-Policy" in text
    assert "unsafe" not in text[: text.index("<title>")]
    assert '"name":"a"' in text
    assert '"name":"b"' in text
    assert sorted(p.name for p in Path().iterdir()) == [
        "a.fit.json",
        "a.view.html",
        "b.fit.json",
    ]


def test_page_goes_where_it_is_asked_for(results: list[str]) -> None:
    Path("pages").mkdir()
    assert run("view", results[0], "-o", "pages")[1] == f"{Path('pages/a.view.html')}\n"
    assert run("view", results[0], "-o", "pages/x.html")[1] == f"{Path('pages/x.html')}\n"
    assert sorted(p.name for p in Path("pages").iterdir()) == ["a.view.html", "x.html"]


def test_measurement_elsewhere(results: list[str]) -> None:
    shutil.copy(sample_path(), "moved.astm")
    code, _, err = run("view", results[0], "--data", "moved.astm")
    assert code == 0
    assert "without measured points" not in err


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        ((), 2, "expected a result"),
        (("none.fit.json",), 3, "none.fit.json: No such file"),
        (("a.fit.json", "-o", "nowhere"), 2, "expected a folder that exists, or a file"),
        (("a.fit.json", "-o", "nowhere/x.html"), 2, "the folder nowhere does not exist"),
        (("a.fit.json", "--data-format", "csv"), 2, "give that, too"),
    ],
)
def test_bad_input_is_one_sentence(
    results: list[str], argv: tuple[str, ...], code: int, says: str
) -> None:
    got, out, err = run("view", *argv)
    assert got == code
    assert out == ""
    assert err.count("\n") == 1
    assert says in err
    assert not list(Path().glob("*.html"))
