"""The README's spheres are what their script computes."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path

import pytest
from PIL import Image

FOLDER = Path(__file__).parents[2] / "notebooks"
MOST_BYTES = 200_000
# Printed with two decimals; fits and colours differ a little from machine to machine.
SAME = 0.015
# Half of the picture's: a mean over the sphere changes by 0.005 with it.
PIXELS = 75


@pytest.fixture
def script(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    return importlib.import_module("readme_spheres")


def means(text: str) -> dict[str, float]:
    """Of ``mean ...: clay 0.16, paint 0.23``."""
    listed = text.partition(": ")[2].split(", ")
    return {name: float(v) for name, _, v in (one.rpartition(" ") for one in listed)}


def test_the_picture_is_small_and_carries_its_numbers(script):
    assert script.PICTURE.stat().st_size < MOST_BYTES
    with Image.open(script.PICTURE) as picture:
        said = means(picture.info["Description"])
    assert list(said) == [m.name for m in script.MATERIALS]
    assert len(said) == 3


@pytest.mark.slow
def test_the_numbers_in_the_picture_are_computed_again(script, monkeypatch):
    monkeypatch.setattr(script, "PIXELS", PIXELS)
    with Image.open(script.PICTURE) as picture:
        said = means(picture.info["Description"])
    again = means(script.numbers(script.compare()))
    assert again == pytest.approx(said, abs=SAME)
    readme = (FOLDER.parent / "README.md").read_text("utf-8")
    for name, value in re.findall(r"(matt clay|gloss paint|rough gold) ([\d.]+)", readme):
        assert float(value) == said[name]
