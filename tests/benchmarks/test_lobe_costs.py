"""What lobes cost relative to each other, to numpy and to themselves without a table.

    python -m pytest tests/benchmarks -m slow -n 0 -s

All as ratios within one run.
"""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import jax
import jax.numpy as jnp
import lobe_costs
import numpy as np
import pytest
import synthetic
from scipy.stats import spearmanr

from fitting import FitOptions, Model
from fitting.problem import prepare
from fitting.reduced import evaluate
from fitting.rows import select_rows
from fitting.tradeoff.evaluation_cost import TRANSCENDENTAL, evaluation_cost
from fitting.tradeoff.timing import timed

pytestmark = pytest.mark.slow


def test_compiled_against_numpy(line):
    """The same source: by XLA in one pass, by numpy an array at a time."""
    unit = lobe_costs.cost("lambert").value["f32"]
    line("| lobe | f32 | f64 | Jacobian f32 | f64 | numpy / compiled | flops | trans. |")
    gained = []
    for name in ("ggx", "ggx(ms)", "ward", "abg"):
        own = lobe_costs.cost(name)
        line(lobe_costs.row(name, own, unit))
        assert own.numpy > own.value["f64"]
        gained.append(own.value["f64"] / own.value["f32"])
    # A single cheap lobe takes a millisecond, too short to tell on a busy machine.
    assert np.exp(np.mean(np.log(gained))) > 1.0


@pytest.mark.parametrize(("expression", "least"), [("beckmann", 1.1), ("student_t", 8.0)])
def test_one_pass_with_the_table_of_polar_angles(line, expression: str, least: float):
    """A pass over 100,000 rows of some tens of polar angles."""
    with jax.enable_x64(True):
        angles = synthetic.directions(rings=80, azimuths=250)
        rows = select_rows(synthetic.measurement(expression, {}, angles=angles), 85.0)
        problem = prepare(rows, Model(expression), FitOptions(objective="l2"))
        plain = dataclasses.replace(problem, angles=None, angle_rows=None)
        k, m = problem.unknowns.n_shape, problem.unknowns.n_coefficients
        point = jnp.zeros(k), jnp.ones((1, m))
        compiled = jax.jit(evaluate)

        def time_of(p) -> float:
            jax.block_until_ready(compiled(p, *point))
            return timed(lambda: jax.block_until_ready(compiled(p, *point)), 7).least

        ratio = time_of(plain) / time_of(problem)
    line(f"{expression}, {len(rows.index)} rows: {ratio:.1f} times faster with the table")
    assert ratio > least


def test_operations_follow_the_clock(line):
    """The weight of a transcendental: what makes times most nearly proportional."""
    found = [
        evaluation_cost(name, 1, Model(name).defaults(), precisions=("float32",))
        for name in lobe_costs.variants()
    ]
    ns = np.log([c.precisions[0].batched_ns.least for c in found])
    flops = np.array([c.count.flops for c in found])
    transcendentals = np.array([c.count.transcendentals for c in found])

    def spread(weight: float) -> float:
        return float(np.std(ns - np.log(flops + weight * transcendentals)))

    of_weight = {w: spread(w) for w in (0.0, 10.0, TRANSCENDENTAL, 100.0, 1000.0)}
    counted = np.log(flops + TRANSCENDENTAL * transcendentals)
    ratio = ns - counted
    factor = np.exp(np.median(np.abs(ratio - np.median(ratio))))
    line("  ".join(f"weight {w:g}: {s:.2f}" for w, s in of_weight.items()))
    line(f"half of the lobes are within a factor of {factor:.2f} of the fit")
    assert of_weight[TRANSCENDENTAL] < min(of_weight[0.0], of_weight[1000.0])
    assert factor < 2.5
    assert spearmanr(ns, counted).statistic > 0.7


def test_the_table_of_the_readme_names_every_lobe():
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    table = re.search(r"<!-- cost -->\n(.*?)\n<!-- /cost -->", readme, re.S)
    assert table
    names = [row.split("|")[1].strip(" `") for row in table[1].splitlines()[2:]]
    assert names == lobe_costs.variants()
