"""The registry of figures, and what it costs to look at it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fitting.plots
from fitting.plots import FIGURES, draw, listed, names

# One figure of a table of models, which is not of one result.
OF_OTHERS = {"tradeoff"}


def test_registry_agrees_with_the_files():
    folder = Path(fitting.plots.__file__).parent
    found = {p.stem for p in folder.glob("*.py") if "\ndef figure(" in p.read_text("utf-8")}
    assert set(FIGURES) == found - OF_OTHERS
    assert names() == FIGURES
    assert len(set(FIGURES)) == len(FIGURES)


def test_every_figure_says_what_it_shows():
    for item in listed():
        assert item.shows.endswith(".")
        assert item.data in ("needed", "shown", "unused")


def test_unknown_figure(paint):
    with pytest.raises(KeyError, match="slcies"):
        draw("slcies", paint.result)


def test_listing_loads_neither_matplotlib_nor_jax():
    code = (
        "import sys, fitting.plots as p; p.listed(); "
        "print([m for m in ('matplotlib', 'jax', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_without_matplotlib_one_sentence_names_the_extra(tmp_path):
    code = (
        "import sys; sys.modules['matplotlib'] = None; from fitting.cli import main; "
        "sys.exit(main(['plot', 'no.fit.json', 'slices']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path,
        check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "matplotlib" in done.stderr
    assert "brdf-fitting[plots]" in done.stderr
