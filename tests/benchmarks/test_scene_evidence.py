"""A part of `scene_evidence.py`, which CI looks at: the choice for a scene is right.

python -m pytest tests/benchmarks -m slow -n 0 -s
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scene_evidence import (
    TRUTHS,
    confusion,
    means_of,
    predictions,
    scenes,
    summary_of_objectives,
    summary_of_predictions,
)

pytestmark = pytest.mark.slow

Line = Callable[[str], None]


def test_cheap_models_are_kept_where_they_do_and_dear_ones_where_not(line: Line):
    """Matte paint and lacquer under a sky and a small lamp; models of three prices."""
    truths = [t for t in TRUTHS if t.like in ("red clay", "glossy lacquer", "clear coat")]
    seen = [s for s in scenes(16) if s.name in ("overcast", "lamp", "off gloss")]
    models = ("lambert", "lambert + ggx", "lambert + 2*ggx")
    found = list(confusion(truths, models, seen))
    for v in found:
        line(f"{v.truth.like} in {v.scene}: {v.kept}, {v.true_mean:.2g} of {v.limits[0]:g}")
    assert all(v.right for v in found)
    kept = {(v.truth.like, v.scene): v.kept for v in found}
    assert kept["red clay", "lamp"] == "lambert"
    assert kept["glossy lacquer", "lamp"] == "lambert + ggx"
    assert kept["glossy lacquer", "off gloss"] == "lambert"


def test_predicted_colour_differences_are_those_of_the_truth(real_data: Path, line: Line):
    """Of a metal, a paint, a plastic and a fabric that are known everywhere."""
    materials = ("alum-bronze", "white-paint", "nylon", "red-fabric")
    found = list(
        predictions(real_data, materials, ("lambert + ggx",), objectives=("log1p", "cbrt"))
    )
    line(summary_of_predictions(found))
    line(summary_of_objectives(found))
    ratio = np.array([p.predicted / p.true for p in found])
    assert np.median(np.abs(ratio - 1)) < 0.2
    assert ratio.min() > 0.5
    means = means_of(found, "lambert + ggx")
    assert means["auto"] <= 1.05 * min(m for o, m in means.items() if o != "auto")
