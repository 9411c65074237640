"""The cells of a tensor tree that holds a surface, finer where it varies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from data_formats import tensor_tree
from fitting.export.bsdf_xml import Block, geometry_of
from fitting.export.cell_averages import averages
from fitting.export.surface import Surface
from fitting.models import Way

BLACK_CELL = (
    "one cell, at grazing incidence and detection, is black: of coloured isotropic trees "
    "Radiance 6 would else take the Lambertian part out and show the rest in red"
)
# Relative spread up to which cells are joined.
_ALIKE = 0.02
_DARK = 1e-9


@dataclass(frozen=True)
class Tree:
    """Cells of one way of light.

    ``corner (n, rank), size (n,), value (n, c)``; ``grid`` holds the same values for every
    cell of the finest level, the lower half of the first coordinate alone at rank 3.
    """

    way: Way
    corner: np.ndarray
    size: np.ndarray
    value: np.ndarray
    grid: np.ndarray

    @property
    def rank(self) -> int:
        """Number of coordinates."""
        return self.corner.shape[1]

    def block(self) -> Block:
        """The cells as pairs of patches."""
        cells = tensor_tree.Cells(self.corner, self.size, self.value[:, 0])
        patches, _, left_out = tensor_tree.pairs(cells)
        assert left_out == 0
        return Block(self.way, patches, self.value)

    def __call__(
        self, sin_i: np.ndarray, phi_i: np.ndarray, sin_r: np.ndarray, phi_r: np.ndarray
    ) -> np.ndarray:
        """Values ``(n, c)`` of the cells that directions in the file's frame are in."""
        if self.rank == 3:
            # Turned so that the direction of incidence has azimuth 180 degrees.
            phi_r = phi_r - phi_i + np.pi
            first = [0.5 - 0.5 * sin_i]
        else:
            first = list(tensor_tree.square(sin_i, phi_i - np.pi))
        at = [*first, *tensor_tree.square(sin_r, phi_r)]
        n = self.grid.shape[1]
        index = tuple(
            np.clip((a * n).astype(np.int64), 0, side - 1)
            for a, side in zip(at, self.grid.shape, strict=False)
        )
        return self.grid[index]


def tree_of(surface: Surface, way: Way, rank: int, level: int) -> Tree:
    """The tree of a surface along a way of light, with ``2^level`` cells a side at most."""
    n = 1 << level
    shape = (max(n // 2, 1), n, n) if rank == 3 else (n,) * 4
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    corner = index.reshape(-1, rank) / n

    def function(x: np.ndarray) -> np.ndarray:
        if rank == 3:
            sin_i, phi_i = 1.0 - 2.0 * x[:, 0], np.full(len(x), np.pi)
        else:
            sin_i, phi = tensor_tree.disk(x[:, 0], x[:, 1])
            phi_i = phi + np.pi
        sin_r, phi_r = tensor_tree.disk(x[:, -2], x[:, -1])
        return surface(geometry_of(way, sin_i, phi_i, sin_r, phi_r))

    value = averages(function, corner, np.full(corner.shape, 1.0 / n))
    value = value.reshape(*shape, -1)
    if rank == 3 and coloured(value):
        # Grazing sideways: see `BLACK_CELL`.
        value[0, n // 2, n - 1] = 0.0
    return _joined(way, value, level)


def coloured(value: np.ndarray) -> bool:
    """Whether X, Y, Z ``(..., 3)`` are of more than one chromaticity."""
    if value.shape[-1] != 3:
        return False
    share = value / np.maximum(value.sum(axis=-1, keepdims=True), 1e-12)
    return bool(np.ptp(share.reshape(-1, 3), axis=0).max() > 1e-3)


def _joined(way: Way, value: np.ndarray, level: int) -> Tree:
    """Cells put together, eight or sixteen at a time, where they are alike."""
    rank = value.ndim - 1
    corners: list[np.ndarray] = []
    sizes: list[np.ndarray] = []
    values: list[np.ndarray] = []
    grid = value.copy()
    now, single = value, np.ones(value.shape[:-1], dtype=bool)

    def keep(which: Any, level: int) -> None:
        index = np.argwhere(which)
        corners.append(index * 0.5**level)
        sizes.append(np.full(len(index), 0.5**level))
        values.append(now[which])
        scale = grid.shape[1] >> level
        for cell, own in zip(index, now[which], strict=True) if scale > 1 else ():
            grid[tuple(slice(k * scale, (k + 1) * scale) for k in cell)] = own

    # A tree of rank 3 is used in its lower half alone, so that its whole is no cell.
    lowest = 1 if rank == 3 else 0
    while level > lowest:
        split = tuple(side for s in now.shape[:-1] for side in (s // 2, 2))
        odd = tuple(range(1, 2 * rank, 2))
        blocks = now.reshape(*split, now.shape[-1])
        mean = blocks.mean(axis=odd)
        wide = np.expand_dims(mean, odd)
        alike = np.abs(blocks - wide) <= _ALIKE * np.abs(wide) + _DARK
        joins = np.all(alike, axis=(*odd, -1)) & np.all(single.reshape(split), axis=odd)
        spread = joins
        for axis in range(rank):
            spread = np.repeat(spread, 2, axis=axis)
        keep(single & ~spread, level)
        now, single, level = mean, joins, level - 1
    keep(single, level)
    return Tree(
        way, np.concatenate(corners), np.concatenate(sizes), np.concatenate(values), grid
    )
