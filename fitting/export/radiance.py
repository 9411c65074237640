"""Radiance: a BSDF as a tensor tree in XML (`.xml`), finer where the surface is glossy.

Conventions of Radiance's tensor trees: values are averages of the BSDF in 1/sr, without
cosine, over cells of the unit square of Shirley and Chiu, an area-preserving image of the
disk of projected directions; rank 3 for isotropic surfaces, rank 4 for others. There are
`2^level` cells along each coordinate, joined again where they differ by less than 2 %.
Colours are X, Y (called Visible) and Z, equal for white, with u' and v', by which Radiance
colours trees; a fit without colour is Visible alone. The file's front is the front of the
fit; Radiance takes the file's back for the side of a surface's normal, and a sample of
which the front alone is known is written for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from data_formats import window_writer
from fitting.export.bsdf_xml import (
    Looked,
    both_sides,
    measurement_of,
    visible,
    with_chromaticity,
)
from fitting.export.surface import surface_of
from fitting.export.target import ExportError, Product, Request, Say
from fitting.export.tree_cells import BLACK_CELL, Tree, coloured, tree_of
from fitting.models import Way
from fitting.result import FitResult

NAME = "radiance"
SUFFIXES = (".xml",)
OPTIONS = ("channels", "illuminant", "level")
REPRESENTATIONS = ()

# By rank.
_LEVELS, _MOST = {3: 6, 4: 4}, {3: 7, 4: 5}
_CONVENTIONS = (
    "averages of the BSDF, 1/sr without cosine, over cells of Shirley and Chiu's square",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as tensor trees. Raises `ExportError`."""
    mixing = visible(result, request)
    surface = surface_of(result, mixing)
    rank = 4 if surface.model.anisotropic else 3
    level = _LEVELS[rank] if request.level is None else request.level
    if not 1 <= level <= _MOST[rank]:
        raise ExportError(
            f"--level {level}: expected 1 to {_MOST[rank]} for a tree of rank {rank}"
        )
    ways: tuple[Way, ...] = surface.model.ways
    say(f"averaging over 2^{level} cells a side")
    trees: dict[Way, Tree] = {way: tree_of(surface, way, rank, level) for way in ways}
    blocks = [tree.block() for tree in trees.values()]
    colour = any(coloured(tree.value) for tree in trees.values())

    def write(target: Path, comment: Sequence[str]) -> None:
        rows = measurement_of(surface, blocks)
        if colour:
            rows = with_chromaticity(rows)
        window_writer.write(rows, target, comment="\n".join(comment))

    cells = sum(len(b.value) for b in blocks)
    words = f"a tensor tree of rank {rank}, level {level}, {cells} cells"
    return Product(
        surface=surface,
        representation=Looked(trees, len(surface.channels), words),
        ways=ways,
        conventions=(*_CONVENTIONS, mixing.sentence),
        remarks=(*both_sides(surface), *((BLACK_CELL,) if colour and rank == 3 else ())),
        write=write,
    )
