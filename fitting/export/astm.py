"""ASTM E1392-style text (`.astm`): what other programs for goniometers read.

The fit on a stated grid of angles, with its own channels: the BSDF in 1/sr, without cosine.
It is read back by `brdf info` and `brdf fit` like a measurement, and says that it is none.
"""

from __future__ import annotations

from pathlib import Path

from fitting.export import table
from fitting.export.target import Product, Request, Say
from fitting.result import FitResult

NAME = "astm"
SUFFIXES = (".astm",)
OPTIONS = table.OPTIONS
REPRESENTATIONS = ()


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a table. Raises `ModelError` for a channel that it has not."""
    return table.product_of(result, request, path, NAME)
