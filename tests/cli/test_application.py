"""The command line as a whole: help, laziness, exit codes, version."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from fitting.sample import sample_path

COMMANDS = (
    "fit", "info", "score", "choose", "plot", "convert", "models", "stress", "formats",
    "scene", "doctor",
)  # fmt: skip
HEAVY = ("jax", "equinox", "optimistix", "colour", "matplotlib")
SHOW_MODULES = (
    "import json, sys; from fitting.cli import main; code = main(sys.argv[1:]); "
    "sys.stderr.write(json.dumps([code, sorted(sys.modules)]))"
)


def loaded_by(*argv: object, cwd) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", SHOW_MODULES, *map(str, argv)],
        capture_output=True, text=True, cwd=cwd, check=True,
    )  # fmt: skip
    code, modules = json.loads(done.stderr[done.stderr.index("[") :])
    assert code == 0, done.stderr
    return set(modules)


def test_help_of_the_whole_loads_nothing(tmp_path):
    modules = loaded_by("--help", cwd=tmp_path)
    assert not modules & {*HEAVY, "numpy", "scipy", "h5py", "data_formats"}


@pytest.mark.parametrize("command", ["fit", "score", "choose", "plot", "models", "doctor"])
def test_help_of_a_command_loads_no_numbers(command, tmp_path):
    assert not loaded_by(command, "--help", cwd=tmp_path) & {*HEAVY, "numpy", "scipy"}


def test_looking_at_files_loads_no_jax(tmp_path):
    assert not loaded_by("info", sample_path(), cwd=tmp_path) & set(HEAVY)
    assert not loaded_by("formats", "csv", cwd=tmp_path) & set(HEAVY)
    assert not loaded_by("convert", sample_path(), "a.csv", cwd=tmp_path) & set(HEAVY)


def test_python_m_is_the_same_command(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "fitting", "--version"],
        capture_output=True, text=True, cwd=tmp_path, check=True,
    )  # fmt: skip
    assert done.stdout.startswith("brdf ")


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
def test_a_closed_pipe_is_no_error(tmp_path):
    program = "import sys; from fitting.cli import main; sys.exit(main())"
    process = subprocess.Popen(
        [sys.executable, "-c", program, "formats"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.close()
    assert process.wait(timeout=60) == 0
    assert process.stderr is not None
    assert process.stderr.read() == ""
    process.stderr.close()


@pytest.mark.parametrize("argv", [(), ("--help",)])
def test_help_lists_every_command(run, argv):
    outcome = run(*argv)
    assert outcome.code == 0
    assert all(name in outcome.out for name in COMMANDS)
    assert "Exit codes" in outcome.out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(run, command):
    outcome = run(command, "--help")
    assert outcome.code == 0
    assert f"brdf {command}" in outcome.out


def test_help_of_fit_has_examples_and_every_option(run):
    text = run("fit", "--help").out
    for word in ("Examples", "--fix", "--bounds", "--tie", "--config", "--max-theta"):
        assert word in text


def test_output_is_not_wider_than_the_terminal(run, monkeypatch, done):
    monkeypatch.setenv("COLUMNS", "60")
    for argv in (("fit",), ("info", sample_path()), ("formats",), ("--help",)):
        outcome = run(*argv)
        assert outcome.code == 0
        assert max(map(len, outcome.out.splitlines())) <= 60


def test_piped_output_is_plain(run, monkeypatch, done):
    monkeypatch.delenv("COLUMNS")
    outcome = run("fit")
    assert "\x1b" not in outcome.out
    assert max(map(len, outcome.out.splitlines())) <= 100


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (("fitt",), "fit"),
        (("fit", "--objectve", "l2"), "--objective"),
        (("fit", "--objective", "l3"), "log1p"),
        (("info",), "FILE"),
        (("--nonsense",), "--nonsense"),
    ],
)
def test_usage_errors(run, argv, says):
    outcome = run(*argv)
    assert outcome.code == 2
    assert outcome.err.startswith("brdf: ")
    assert says in outcome.err
    assert outcome.err.count("\n") == 1


def test_a_bug_is_called_a_bug(run, monkeypatch):
    import data_formats

    def broken(*_, **__):
        raise KeyError("surprise")

    monkeypatch.setattr(data_formats, "read", broken)
    outcome = run("info", sample_path())
    assert outcome.code == 70
    assert "internal error" in outcome.err
    assert "Traceback" not in outcome.err
    assert "Traceback" in run("info", sample_path(), "--debug").err
