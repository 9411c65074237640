"""What the README claims is executed here."""

from __future__ import annotations

import importlib
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.M | re.S)


def test_the_two_commands_are_one_line_each_and_ci_runs_the_second():
    first, second = blocks("sh")
    assert first.count("\n") == second.count("\n") == 1
    assert first.rstrip().endswith(".venv/bin/brdf fit")
    assert second.rstrip().endswith("-m pytest")
    script = ROOT / ".ci" / "run"
    if script.exists():
        assert "README.md" in script.read_text()


def test_the_excerpt_is_what_the_command_prints(tmp_path, monkeypatch, capsys):
    from fitting.cli import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    assert main(["fit"]) == 0
    printed = [line.split() for line in capsys.readouterr().out.splitlines()]
    (excerpt,) = blocks("text")
    for line in excerpt.splitlines():
        assert line.split() in printed, line
    assert (tmp_path / "two_lobe_paint.fit.json").exists()


@pytest.mark.slow
def test_the_excerpt_of_a_choice_is_what_the_command_prints(tmp_path, monkeypatch, capsys):
    from fitting.cli import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    (excerpt,) = blocks("console")
    command, *lines = excerpt.splitlines()
    prompt, name, *argv = shlex.split(command)
    assert (prompt, name) == ("$", "brdf")
    assert main(argv) == 0
    printed = [line.split() for line in capsys.readouterr().out.splitlines()]
    for line in lines:
        assert line.split() in printed, line
    assert (tmp_path / "two_lobe_paint.studio.fit.json").exists()


def test_the_python_example_runs(tmp_path, monkeypatch, capsys):
    from data_formats import read, write
    from fitting.sample import sample_path

    monkeypatch.chdir(tmp_path)
    write(read(sample_path()), "paint.astm")
    (example,) = blocks("python")
    exec(compile(example, "README", "exec"), {})
    assert (tmp_path / "paint.fit.json").exists()
    assert capsys.readouterr().out.startswith("[0.")


def test_every_command_that_is_named_exists():
    named = set(re.findall(r"`brdf ([a-z]+)", README))
    shown = subprocess.run(
        [sys.executable, "-m", "fitting", "--help"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert named
    for name in named:
        assert re.search(rf"\b{name}\b", shown), name


def test_linked_files_exist():
    for target in re.findall(r"\]\(((?!http)[^)]+)\)", README):
        assert (ROOT / target).exists(), target
    assert (ROOT / "fitting" / "fit_result.schema.json").exists()


def shown_rows() -> dict[str, str]:
    """The rows of the table of real files, by name."""
    table = re.search(r"<!-- table -->\n(.*?)\n<!-- /table -->", README, re.S)
    assert table
    return {line.split("|")[1].strip(): line for line in table[1].splitlines()[2:]}


@pytest.fixture
def real_files(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "tests" / "benchmarks")
    return importlib.import_module("real_files")


def test_the_table_has_all_real_files(real_data, real_files):
    assert set(shown_rows()) == set(real_files.names(real_data))


@pytest.mark.slow
# Some of all kinds: the whole table takes minutes.
@pytest.mark.parametrize("name", [*list(shown_rows())[::4], "minidiff/Metal_Blue"])
def test_the_table_of_real_files_is_current(real_data, real_files, name):
    """Numbers of the table, to 1 %, and the promises made with it."""
    theirs = [c.strip() for c in shown_rows()[name].split("|")[1:-1]]
    ours = [c.strip() for c in real_files.row(real_data, name).split("|")[1:-1]]
    assert theirs[:3] == ours[:3]
    for a, b in zip(theirs[3:8], ours[3:8], strict=True):
        assert float(a) == pytest.approx(float(b), rel=0.01)
    if name in real_files.OTHERS:
        assert min(map(float, ours[4:8])) < real_files.OTHERS[name].l2
    if "Metal" in name:
        assert float(ours[5]) < 0.7 * float(ours[4])
