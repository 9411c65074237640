"""The README's table of rounding errors: ``python -m fitting.stress.table [N]``.

A line per lobe, of ``N`` points in each precision, spread over its variants.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.models import lobe_names
from fitting.stress import precision
from fitting.stress.exercise import Exercise
from fitting.stress.precision import Precision
from fitting.stress.reference import has_reference, relative_error
from fitting.stress.report import PRECISIONS
from fitting.stress.variants import Variant, of_name

POINTS = 20_000
HEADER = (
    "| lobe | variants | float32, ulp | 99.9 % below | float64, ulp | 99.9 % below | "
    "ill-conditioned, ulp / condition number | quadrature, relative |\n"
    "|---|---|---|---|---|---|---|---|"
)
_EPS = {"f32": float(np.finfo(np.float32).eps), "f64": float(np.finfo(np.float64).eps)}


@dataclass(frozen=True)
class Stated:
    """A line of the table: how many variants it is about, and the largest errors."""

    variants: int
    maximum: dict[str, float]


def row(name: str, points: int, workers: int = 1) -> str:
    """One line: the largest errors over the variants of a lobe.

    Variants whose formula is a quadrature have no error in ulp: of them the largest
    relative error in float64 is shown, and of those without a formula nothing.
    """
    variants = of_name(name)
    known = [v for v in variants if has_reference(v)]
    each = math.ceil(points / max(len(known), 1))
    exact: dict[str, list[Precision]] = {p: [] for p in PRECISIONS}
    integrated: list[float] = []
    for variant in known:
        for p in PRECISIONS:
            found = precision.measure(Exercise(variant, p), each, workers=workers)
            if not relative_error(variant):
                exact[p].append(found)
            elif p == "f64":
                integrated.append(found.maximum * _EPS[p])
    cells = [f"`{name}`", str(len(variants))]
    for p in PRECISIONS:
        cells += [_largest([f.maximum for f in exact[p]])]
        cells += [_largest([f.percentile for f in exact[p]])]
    cells.append(_largest([f.per_condition for p in PRECISIONS for f in exact[p]]))
    cells.append(_largest(integrated) if integrated else "")
    return f"| {' | '.join(cells)} |"


def rows(lines: Sequence[str]) -> dict[str, Stated]:
    """What the lines of a table say, by lobe."""
    out: dict[str, Stated] = {}
    for line in lines:
        name, *cells = (c.strip() for c in line.strip("|").split("|"))
        if name.startswith("`"):
            maximum = {"f32": float(cells[1]), "f64": float(cells[3])}
            out[name.strip("`")] = Stated(int(cells[0]), maximum)
    return out


def lobe_of(variant: Variant) -> str:
    """The lobe whose line is about a variant."""
    return variant.name.partition("(")[0]


def _largest(values: list[float]) -> str:
    """The largest to two digits, not below the number itself."""
    largest = max(values, default=0.0)
    text = f"{largest:.2g}"
    return text if float(text) >= largest else f"{largest * 1.05:.2g}"


def main() -> None:
    """Print the table, a line at a time."""
    points = int(sys.argv[1]) if len(sys.argv) > 1 else POINTS
    print(HEADER)
    for name in lobe_names():
        print(row(name, points, os.cpu_count() or 1), flush=True)


if __name__ == "__main__":
    main()
