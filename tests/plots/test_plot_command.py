"""``brdf plot``, end to end."""

from __future__ import annotations

import contextlib
import io
import json
import re
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from made_up_results import result_of

import data_formats
from fitting import sample
from fitting.cli import main
from fitting.plots import FIGURES
from fitting.result import load_result


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")

    def invoke(*argv: object) -> tuple[int, str, str]:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([str(a) for a in ("plot", *argv)])
        return code, out.getvalue(), err.getvalue()

    return invoke


def refuses(run: Callable, *argv: object, says: str, code: int = 2) -> None:
    found, out, err = run(*argv)
    assert (found, out) == (code, ""), err
    assert err.startswith("brdf: ")
    assert err.count("\n") == 1
    assert re.search(says, err), err


def test_one_figure_into_the_current_folder(run, saved):
    code, out, err = run(saved(), "starts")
    assert (code, out, err) == (0, "own.starts.png\n", "")
    assert Path("own.starts.png").read_bytes().startswith(b"\x89PNG")


def test_folder_format_and_json(run, saved, tmp_path):
    code, out, _ = run(
        saved(), "starts", "spectrum", "-o", "new", "--format", "svg", "--json"
    )
    assert code == 0
    done = json.loads(out)
    paths = [item["path"] for item in done["written"]]
    assert paths == [str(Path("new") / f"own.{n}.svg") for n in ("starts", "spectrum")]
    assert sorted(p.name for p in Path("new").iterdir()) == [
        "own.spectrum.svg", "own.starts.svg"
    ]  # fmt: skip
    assert (done["left_out"], done["without_data"]) == ([], None)


def test_pages_of_one_pdf(run, saved):
    code, out, _ = run(saved(), "starts", "correlations", "-o", "both.pdf")
    assert (code, out) == (0, "both.pdf\n")
    assert len(re.findall(rb"/Type /Page\b", Path("both.pdf").read_bytes())) == 2


def test_all_that_apply_and_what_does_not(run, saved, tmp_path, monkeypatch):
    few = ("residuals", "starts", "spectrum")
    monkeypatch.setattr("fitting.cli.plot_run.FIGURES", few)
    path = saved()
    (tmp_path / "own.astm").unlink()
    code, out, err = run(path, "--dpi", "30")
    assert code == 0
    assert out.split() == ["own.starts.png", "own.spectrum.png"]
    assert "without measured points: own.astm is not there any more" in err
    assert "left out: residuals (it needs the measurement)" in err
    assert run(path, "starts", "-q")[2] == ""


def test_listing(run):
    code, out, _ = run("--list")
    assert code == 0
    assert all(name in out for name in FIGURES)
    code, out, _ = run("--list", "--json")
    assert [item["name"] for item in json.loads(out)] == list(FIGURES)


def test_usage_errors(run, saved, tmp_path):
    path = saved()
    refuses(run, says="expected a result of `brdf fit`, or --list")
    refuses(run, path, "slcies", says="no figure 'slcies'; did you mean 'slices'")
    refuses(run, path, "qqq", says="known: slices, polar")
    refuses(run, path, "starts", "--dpi", "1", says="--dpi 1: expected 10 to 2400")
    refuses(run, path, "starts", "--format", "tiff", says="tiff")
    refuses(run, path, "-o", "a.png", says="several figures do not fit in one png")
    refuses(run, path, "starts", "-o", "no/where/", says="no does not exist")
    (tmp_path / "file").write_text("")
    refuses(run, path, "starts", "-o", "file", says="not a folder.*png, .svg, .pdf")
    refuses(run, path, "--data-format", "csv", says="--data-format is that of --data")
    refuses(run, path, "slices", "--channel", "555 nm", says="did you mean '550 nm'")
    assert not list(tmp_path.glob("*.png"))


def test_unreadable_results(run, saved, tmp_path):
    refuses(run, "none.fit.json", says="No such file", code=3)
    (tmp_path / "odd.fit.json").write_text("{}")
    refuses(run, "odd.fit.json", says="schema_version", code=3)
    refuses(run, saved(), "--data", "none.astm", says="does not exist", code=3)


def test_a_figure_that_was_asked_for_and_cannot_be_drawn(run, saved, tmp_path):
    path = saved()
    (tmp_path / "own.astm").unlink()
    refuses(run, path, "residuals",
            says="residuals: it needs the measurement; own.astm .* --data")  # fmt: skip


def test_data_with_other_channels(run, saved, tmp_path, matt):
    data_formats.write(matt.data, tmp_path / "matt.astm")
    refuses(run, saved(), "slices", "--data", "matt.astm",
            says=r"1 channel \(mono\) and the result has 7 channels")  # fmt: skip


def test_other_data_are_drawn_and_called_other(run, saved, tmp_path, paint):
    data_formats.write(paint.data.select(range(300)), tmp_path / "part.csv")
    code, out, err = run(saved(), "residuals", "--data", "part.csv", "--dpi", "30")
    assert (code, out) == (0, "own.residuals.png\n")
    assert err.startswith("the data have 300 rows and had 600 for the fit")


def test_the_bundled_sample_is_found(run, paint, tmp_path):
    gone = msgspec.structs.replace(paint.result.data, path="/gone/two_lobe_paint.astm")
    msgspec.structs.replace(paint.result, data=gone).save(tmp_path / "a.fit.json")
    code, out, err = run("a.fit.json", "residuals", "--dpi", "30")
    assert (code, out, err) == (0, "a.residuals.png\n", "")


def test_values_read_in_another_way_are_not_drawn(run, tmp_path, paint):
    """Reflectance factors read as BRDF have the same SHA-256 and other values."""
    text = tmp_path / "factors.csv"
    data_formats.write(paint.data, text)
    data = data_formats.read(text, quantity="brf")
    result = result_of(sample.MODEL, sample.PARAMETERS, data)
    result.save(tmp_path / "factors.fit.json")
    refuses(run, "factors.fit.json", "residuals", says=r"read in another way.*--reader")
    code, _, err = run("factors.fit.json", "residuals", "--reader", "quantity=brf",
                       "--dpi", "30")  # fmt: skip
    assert (code, err) == (0, "")


def test_results_of_conversions_say_so(run, saved):
    path = saved()
    result = load_result(path)
    converted = msgspec.structs.replace(
        result.data, format="values of the fitted lambert + ggx"
    )
    msgspec.structs.replace(result, data=converted).save(path)
    code, _, err = run(path, "starts")
    assert code == 0
    assert "was fitted to values of the fitted lambert + ggx, not to a file" in err
