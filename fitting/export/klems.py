"""WINDOW and Radiance: a BSDF as Klems matrices in XML (`.xml`), 145 by 145 patches.

Conventions of the Klems full basis: values are averages of the BSDF in 1/sr, without
cosine, over a patch of incident and a patch of outgoing directions; patches are about 10
degrees wide, so that a narrower highlight is flattened. Column and row of the same number
are the specular direction. Colours are X, Y (called Visible) and Z, equal for white; a fit
without colour is Visible alone. Front is the front of the fit (Radiance calls it the back),
and a sample of which the front alone is known is written for both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_formats import klems, window_writer
from fitting.export.bsdf_xml import (
    Block,
    Looked,
    both_sides,
    geometry_of,
    measurement_of,
    visible,
)
from fitting.export.cell_averages import averages
from fitting.export.surface import Surface, surface_of
from fitting.export.target import Product, Request, Say
from fitting.models import Way
from fitting.result import FitResult

NAME = "klems"
SUFFIXES = (".xml",)
OPTIONS = ("channels", "illuminant")
REPRESENTATIONS = ()

_BASIS = klems.BASES["LBNL/Klems Full"]
_CONVENTIONS = (
    "averages of the BSDF, 1/sr without cosine, over pairs of patches of LBNL/Klems Full",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as Klems matrices. Raises `ExportError`."""
    mixing = visible(result, request)
    surface = surface_of(result, mixing)
    ways: tuple[Way, ...] = surface.model.ways
    say("averaging over pairs of patches")
    blocks = [
        Block(way, klems.pairs(_BASIS, _BASIS), _averages(surface, way)) for way in ways
    ]

    def write(target: Path, comment: Sequence[str]) -> None:
        rows = measurement_of(surface, blocks)
        window_writer.write(rows, target, comment="\n".join(comment))

    found: dict[Way, _Matrix] = {b.way: _Matrix(b.value) for b in blocks}
    return Product(
        surface=surface,
        representation=Looked(found, len(surface.channels), "Klems matrices"),
        ways=ways,
        conventions=(*_CONVENTIONS, mixing.sentence),
        remarks=both_sides(surface),
        write=write,
    )


class _Matrix:
    """Values ``(n, c)`` by the patches of directions in the frame of the file."""

    def __init__(self, value: np.ndarray):
        size = klems.patch_count(_BASIS)
        self._table = value.reshape(size, size, -1)

    def __call__(
        self, sin_i: np.ndarray, phi_i: np.ndarray, sin_r: np.ndarray, phi_r: np.ndarray
    ) -> np.ndarray:
        return self._table[_patch(sin_r, phi_r), _patch(sin_i, phi_i - np.pi)]


def _patch(sine: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Number of the patch that a direction is in."""
    high = np.sin(np.radians([r.high for r in _BASIS]))
    ring = np.clip(np.searchsorted(high, sine), 0, len(_BASIS) - 1)
    counts = np.array([r.n_phi for r in _BASIS])
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    turn = np.rint(np.remainder(phi, 2 * np.pi) * counts[ring] / (2 * np.pi))
    return first[ring] + turn.astype(np.int64) % counts[ring]


def _averages(surface: Surface, way: Way) -> np.ndarray:
    """Averages ``(n, c)`` in the order of `klems.pairs`, the outgoing patch outermost.

    In the squared sine and the azimuth, in which projected solid angle is even.
    """
    corner, size = _boxes()
    n = len(corner)
    of_r, of_i = np.repeat(np.arange(n), n), np.tile(np.arange(n), n)
    corners = np.concatenate([corner[of_i], corner[of_r]], axis=1)
    sizes = np.concatenate([size[of_i], size[of_r]], axis=1)

    def function(x: np.ndarray) -> np.ndarray:
        sin_i, sin_r = np.sqrt(x[:, 0]), np.sqrt(x[:, 2])
        return surface(geometry_of(way, sin_i, x[:, 1] + np.pi, sin_r, x[:, 3]))

    return averages(function, corners, sizes)


def _boxes() -> tuple[np.ndarray, np.ndarray]:
    """Corners and sides ``(145, 2)`` of the patches."""
    corners: list[tuple[float, float]] = []
    sizes: list[tuple[float, float]] = []
    for ring in _BASIS:
        low, high = (np.sin(np.radians(a)) ** 2 for a in (ring.low, ring.high))
        step = 2.0 * np.pi / ring.n_phi
        for k in range(ring.n_phi):
            corners.append((low, (k - 0.5) * step))
            sizes.append((high - low, step))
    return np.array(corners), np.array(sizes)
