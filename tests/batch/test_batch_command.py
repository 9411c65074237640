"""`brdf batch` against `brdf fit`, and what it writes over all files."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest
from batch_files import brdf, brdf_each, results, write_paint

from fitting.cli import main

OPTIONS = ("-m", "lambert", "--fix", "lambert.albedo=0.25,0.5")
FILES = ("a/x.astm", "b/x.astm", "b/bad.astm", "y.astm", "b/one_angle.csv")


@dataclass(frozen=True)
class Batch:
    """A folder in which a batch ran: five files, of which one is no measurement."""

    folder: Path
    code: int
    out: str
    err: str

    @property
    def results(self) -> Path:
        return self.folder / "results"


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Batch:
    folder = tmp_path_factory.mktemp("batch")
    for seed, name in enumerate(FILES):
        write_paint(folder / name, seed)
    (folder / "b" / "bad.astm").write_bytes(b"VARS theta_i,phi_i,theta_s\n\n1,2,three\n")
    ran = brdf("batch", "?/*", "y.astm", *OPTIONS, "--workers", 2, cwd=folder)
    return Batch(folder, ran.returncode, ran.stdout, ran.stderr)


def test_one_bad_file_is_told_and_stops_no_other(done: Batch):
    assert done.code == 1, done.err
    assert "5 files: 4 fitted, 1 failed" in done.out
    assert sorted(results(done.results)) == [
        "a__x.fit.json", "b__x.fit.json", "one_angle.fit.json", "y.fit.json",
    ]  # fmt: skip
    assert "failed: b/bad.astm: " in done.err
    assert "5 of 5 files" in done.err
    assert "Traceback" not in done.err
    assert "reading" in done.out


def test_results_are_those_of_fit_byte_by_byte(done: Batch):
    named = {"a/x.astm": "a__x", "b/x.astm": "b__x", "y.astm": "y"}
    single = done.folder / "single"
    single.mkdir()
    commands = [
        ["fit", file, *OPTIONS, "-q", "-o", f"single/{name}.fit.json"]
        for file, name in named.items()
    ]
    brdf_each(commands, done.folder)
    for name in named.values():
        theirs = (single / f"{name}.fit.json").read_bytes()
        assert (done.results / f"{name}.fit.json").read_bytes() == theirs


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_summary_says_what_the_results_say(done: Batch):
    rows = {row["file"]: row for row in table(done.results / "summary.csv")}
    assert sorted(rows) == sorted(FILES)
    for file, row in rows.items():
        if file == "b/bad.astm":
            assert row["status"] == "failed"
            assert "column" in row["reason"] or "VARS" in row["reason"]
            assert row["l2"] == row["model"] == ""
            continue
        result = json.loads((done.results / row["result"]).read_text())
        assert row["status"] == "done"
        assert row["model"] == result["model"]
        for name in ("l2", "l2cos", "log1p", "asinh", "cbrt"):
            assert float(row[name]) == result["scores"][name]
        assert float(row["max_albedo"]) == result["energy"]["max_albedo"]
        assert row["data_sha256"] == result["data"]["sha256"]
        assert float(row["converged"]) == result["solver"]["converged"]
        assert float(row["rows_used"]) == result["data"]["rows_used"]
        assert 0 < float(row["fit_s"]) < 100
        assert 0 < float(row["read_s"]) < 100


def test_parameters_are_listed_value_by_value(done: Batch):
    rows = table(done.results / "parameters.csv")
    assert len(rows) == 4 * 2
    assert {(r["parameter"], r["channel"], r["value"]) for r in rows} == {
        ("lambert.albedo", "400 nm", "0.25"), ("lambert.albedo", "500 nm", "0.5"),
    }  # fmt: skip
    assert {r["fixed"] for r in rows} == {"1.0"}


def test_hdf5_holds_the_same_tables(done: Batch):
    with h5py.File(done.results / "summary.h5") as h5:
        for group, name in (("files", "summary.csv"), ("parameters", "parameters.csv")):
            rows = table(done.results / name)
            held = h5[group]
            assert isinstance(held, h5py.Group)
            assert set(held) == set(rows[0])
            for column, data in held.items():
                assert isinstance(data, h5py.Dataset)
                texts = [row[column] for row in rows]
                if h5py.check_string_dtype(data.dtype):
                    assert list(data.asstr()[:]) == texts
                else:
                    numbers = [float(t) if t else np.nan for t in texts]
                    np.testing.assert_array_equal(data, numbers)


def run_again(
    done: Batch, *argv: str, capfd: pytest.CaptureFixture[str]
) -> tuple[int, str]:
    """The same command once more, in this process: there is little to do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(done.folder)
        code = main(["batch", "?/*", "y.astm", *OPTIONS, "--workers", "0", *argv])
    said = capfd.readouterr()
    return code, said.out + said.err


def test_resumed_with_nothing_left_it_does_nothing(done: Batch, capfd):
    before = results(done.results)
    code, said = run_again(done, "--resume", capfd=capfd)
    assert code == 1
    assert "0 of 5 files to fit" in said
    assert "5 were there from before" in said
    assert results(done.results) == before


def test_results_are_not_mixed_unasked(done: Batch, capfd):
    before = results(done.results)
    code, said = run_again(done, capfd=capfd)
    assert code == 2
    assert "--resume" in said
    assert results(done.results) == before


def test_what_has_changed_is_redone_and_told(done: Batch, capfd):
    before = results(done.results)
    write_paint(done.folder / "y.astm", 17)
    (done.results / "b__x.fit.json").unlink()
    damaged = done.results / "a__x.fit.json"
    damaged.write_bytes(damaged.read_bytes()[:-20])
    (done.results / ".batch" / "one_angle.json.k1.part").write_bytes(b"half")
    code, said = run_again(done, "--resume", capfd=capfd)
    assert code == 1
    assert "again: y.astm: the file has changed" in said
    assert "again: b/x.astm: b__x.fit.json is missing" in said
    assert "again: a/x.astm: a__x.fit.json is not the one written" in said
    assert "3 of 5 files to fit" in said
    after = results(done.results)
    assert after["one_angle.fit.json"] == before["one_angle.fit.json"]
    assert json.loads(after["a__x.fit.json"][2])["model"] == "lambert"
    assert after["y.fit.json"][2] != before["y.fit.json"][2]
    assert not list(done.results.rglob("*.part"))


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["*.csv"], "no file matches"),
        ([], "expected files"),
        (["p.astm", "--workers", "-1"], "--workers"),
        (["p.astm", "--retries", "-1"], "--retries"),
        (["p.astm", "-o", "p.astm"], "takes a folder"),
        (["p.astm", "-m", "lambret"], "did you mean 'lambert'"),
        (["p.astm", "-m", "lambert", "--fix", "ggx.f0=1"], "no such parameter"),
        (["p.astm", "--format", "astn"], "no such format"),
        (["p.astm", "-m", "mine.py", "--scheduler", "local"], "full path"),
    ],
)
def test_senseless_commands_end_in_a_sentence_and_leave_nothing(
    argv: list[str], says: str, tmp_path: Path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    write_paint(tmp_path / "p.astm", 0)
    workers = [] if "--workers" in argv else ["--workers", "0"]
    assert main(["batch", *argv, *workers]) == 2
    said = capfd.readouterr()
    assert says in said.err
    assert said.out == ""
    assert [p.name for p in tmp_path.iterdir()] == ["p.astm"]


def test_a_measurement_is_not_overwritten(tmp_path: Path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    write_paint(tmp_path / "p.astm", 0)
    (tmp_path / "p.fit.json").write_text("[]")
    assert main(["batch", "p.astm", "-m", "lambert", "-o", ".", "--workers", "0"]) == 2
    assert "is not a fit result" in capfd.readouterr().err
    assert (tmp_path / "p.fit.json").read_text() == "[]"
