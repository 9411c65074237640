"""The file of a result is found where it may be, and only if it is the same."""

from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path

import msgspec
import pytest

import data_formats
from fitting.plots.find_data import DataNotFound, find_data, read_again
from fitting.result import load_result


def test_beside_the_result_from_any_folder(saved, tmp_path, monkeypatch):
    path = saved()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    result = load_result(path)
    found = find_data(result, path)
    assert found.provenance.sha256 == result.data.sha256
    assert read_again(result, found) is None
    with pytest.raises(DataNotFound, match=r"own.astm is not there any more"):
        find_data(result, None)


def test_a_moved_pair_is_found_by_name(saved, tmp_path, monkeypatch):
    path = saved()
    result = load_result(path)
    moved = msgspec.structs.replace(result.data, path="/measured/2024/own.astm")
    monkeypatch.chdir("/")
    found = find_data(msgspec.structs.replace(result, data=moved), path)
    assert Path(found.provenance.path) == tmp_path / "own.astm"


def test_a_changed_file_is_not_the_same(saved, tmp_path, monkeypatch):
    path = saved()
    monkeypatch.chdir(tmp_path)
    with (tmp_path / "own.astm").open("a") as file:
        file.write("\n")
    with pytest.raises(DataNotFound, match=r"own.astm has changed.*--data"):
        find_data(load_result(path), path)


def test_of_two_files_of_the_name_the_content_decides(saved, tmp_path, monkeypatch):
    path = saved()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "own.astm").write_text("another file of the same name")
    monkeypatch.chdir(elsewhere)
    found = find_data(load_result(path), path)
    assert Path(found.provenance.path) == tmp_path / "own.astm"


def test_joined_files(saved, tmp_path, monkeypatch, paint):
    path = saved()
    monkeypatch.chdir(tmp_path)
    halves = paint.data.theta_i < 0.7
    for name, some in (("a.csv", halves), ("b.csv", ~halves)):
        data_formats.write(paint.data.select(some), name)
    joined = data_formats.join(*(data_formats.read(n) for n in ("a.csv", "b.csv")))
    files = [hashlib.sha256(Path(n).read_bytes()).hexdigest() for n in ("a.csv", "b.csv")]
    data = msgspec.structs.replace(
        load_result(path).data, path="a.csv + b.csv", format="csv",
        sha256=hashlib.sha256("".join(files).encode()).hexdigest(),
    )  # fmt: skip
    result = msgspec.structs.replace(load_result(path), data=data)
    assert find_data(result, path).equals(joined)
    Path("b.csv").write_bytes(Path("a.csv").read_bytes())
    with pytest.raises(DataNotFound, match=r"at least one of a.csv, b.csv has changed"):
        find_data(result, path)


def test_rows_that_are_missing(paint):
    few = paint.data.select(range(10))
    assert "have 10 rows and had 600" in (read_again(paint.result, few) or "")


def test_other_data(paint):
    other = dataclasses.replace(
        paint.data, provenance=dataclasses.replace(paint.data.provenance, sha256="0" * 64)
    )
    assert read_again(paint.result, other) == "these are not the data that were fitted"
