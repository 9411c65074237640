"""Tensor trees of Radiance: boxes halved in every coordinate where the BSDF needs it.

`{...}` holds either `2^rank` such nodes, coordinate 0 changing fastest, or a grid of
numbers with the same power of two of cells along each coordinate, coordinate 0 changing
slowest. The coordinates, 0 to 1, are those of a square on the unit disk of projected
directions (P. Shirley and K. Chiu, 1997): for rank 4 that of minus the direction of
incidence, then that of the outgoing one; for rank 3 (isotropic) `(1 - sin theta_i) / 2`,
then the outgoing one, turned so that the direction of incidence has azimuth 180 degrees.
Source: `bsdf_t.c` of Radiance.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import MeasurementError
from data_formats.patches import Patches

Array = NDArray[np.float64]

# A whole leaf at once, or a brace; anything else between them is wrong.
_TOKEN = re.compile(r"\{([^{}]*)\}|([{}])|[^\s,{}]+")
_DEEPEST = 24


@dataclass
class _Node:
    corner: tuple[float, ...]
    size: float
    children: int = 0


@dataclass
class _Leaves:
    """Leaves with as many numbers each."""

    corners: list[tuple[float, ...]] = field(default_factory=list)
    sizes: list[float] = field(default_factory=list)
    numbers: list[list[float]] = field(default_factory=list)


@dataclass(frozen=True)
class Cells:
    """The cells of a tree.

    **Arguments:**

    - `corner`: (n, rank) lower corners.
    - `size`: (n,) lengths of their sides.
    - `value`: (n,) numbers.
    """

    corner: Array
    size: Array
    value: Array


def cells(text: str, rank: int, where: str) -> Cells:
    """The cells of a tree.

    **Raises:** `MeasurementError` if the braces or the numbers of values do not fit.
    """
    leaves: dict[int, _Leaves] = {}
    stack: list[_Node] = []
    closed = False

    def child() -> tuple[tuple[float, ...], float]:
        if not stack:
            return (0.0,) * rank, 1.0
        node, half = stack[-1], stack[-1].size / 2
        index, node.children = node.children, node.children + 1
        if index >= 1 << rank:
            raise MeasurementError(f"{where}: a node has more than {1 << rank} nodes in it")
        return tuple(c + half * (index >> k & 1) for k, c in enumerate(node.corner)), half

    for token in _TOKEN.finditer(text):
        leaf, brace = token.groups()
        if closed or (leaf is None and brace is None):
            raise MeasurementError(
                f"{where}: {token.group()[:40]!r} is neither a node of the tree nor in "
                "a leaf"
            )
        if brace == "}":
            if not stack or stack[-1].children != 1 << rank:
                count = stack[-1].children if stack else 0
                raise MeasurementError(
                    f"{where}: a node has {count} nodes in it; expected {1 << rank}"
                )
            stack.pop()
        else:
            corner, size = child()
            if leaf is None:
                if len(stack) >= _DEEPEST:
                    raise MeasurementError(f"{where}: more than {_DEEPEST} nodes deep")
                stack.append(_Node(corner, size))
            else:
                numbers = _numbers(leaf, rank, where)
                group = leaves.setdefault(len(numbers), _Leaves())
                group.corners.append(corner)
                group.sizes.append(size)
                group.numbers.append(numbers)
        closed = not stack
    if not closed:
        raise MeasurementError(f"{where}: the tree has no end; is the file cut short?")
    parts = [_grids(group, rank) for group in leaves.values()]
    return Cells(
        np.concatenate([p.corner for p in parts]),
        np.concatenate([p.size for p in parts]),
        np.concatenate([p.value for p in parts]),
    )


def _numbers(leaf: str, rank: int, where: str) -> list[float]:
    words = leaf.replace(",", " ").split()
    side = 1 << max(len(words).bit_length() - 1, 0) // rank
    if not words or side**rank != len(words):
        raise MeasurementError(
            f"{where}: a leaf of the tree has {len(words)} numbers; expected 1, "
            f"{2**rank}, {4**rank}, ..."
        )
    try:
        return [float(word) for word in words]
    except ValueError as error:
        raise MeasurementError(f"{where}: {str(error)[:80]}") from None


def _grids(group: _Leaves, rank: int) -> Cells:
    """The cells of leaves of one size."""
    values = np.array(group.numbers)
    side = round(values.shape[1] ** (1 / rank))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * rank, indexing="ij"), axis=-1)
    size = np.array(group.sizes) / side
    corner = np.array(group.corners)[:, None] + grid.reshape(-1, rank) * size[:, None, None]
    return Cells(corner.reshape(-1, rank), np.repeat(size, side**rank), values.ravel())


def pairs(tree: Cells) -> tuple[Patches, Array, int]:
    """Directions, values, and how many cells there are that no direction is in.

    A tree of rank 3 has directions of incidence in its lower half alone.
    """
    corner, size, value = tree.corner, tree.size, tree.value
    rank = corner.shape[1]
    used = corner[:, 0] < 0.5 if rank == 3 else np.ones(len(value), dtype=bool)
    left_out = int(np.count_nonzero(~used))
    corner, size, value = corner[used], size[used], value[used]
    centre = corner + size[:, None] / 2
    if rank == 3:
        middle = (corner[:, 0] + np.minimum(corner[:, 0] + size, 0.5)) / 2
        sin_i, phi_i = 1 - 2 * middle, np.full_like(middle, np.pi)
    else:
        sin_i, phi = disk(centre[:, 0], centre[:, 1])
        phi_i = phi + np.pi
    sin_r, phi_r = disk(centre[:, -2], centre[:, -1])
    patches = Patches(
        theta_i=np.arcsin(sin_i),
        phi_i=phi_i,
        theta_r=np.arcsin(sin_r),
        phi_r=phi_r,
        # The map from the square to the disk keeps areas.
        area=np.pi * size**2,
        key=(rank, corner.tobytes(), size.tobytes()),
    )
    return patches, value, left_out


def disk(x: Array, y: Array) -> tuple[Array, Array]:
    """Polar coordinates on the unit disk of points of the unit square."""
    a, b = 2 * x - 1, 2 * y - 1
    flat = np.abs(a) > np.abs(b)
    radius = np.where(flat, a, b)
    ratio = np.divide(np.where(flat, b, a), radius, out=np.zeros_like(a), where=radius != 0)
    phi = np.pi / 4 * np.where(flat, ratio, 2 - ratio)
    return np.abs(radius), phi + np.pi * (radius < 0)


@dataclass(frozen=True)
class CellsAt:
    """Rows as the cells of a tree: `rank`, and which row is in which cell.

    **Arguments:**

    - `places`: by level (0 is the whole) and index along each coordinate.
    """

    rank: int
    places: dict[tuple[int, ...], int]
    deepest: int

    def text(self, values: list[float]) -> str:
        """The tree of the rows' values, a node per line."""
        out: list[str] = []
        self._node((0,) * self.rank, 0, values, out)
        return "\n".join(out)

    def _node(
        self, index: tuple[int, ...], level: int, values: list[float], out: list[str]
    ) -> None:
        row = self.places.get((level, *index))
        if row is not None:
            out.append(f"{{ {values[row]!r} }}")
            return
        # Directions of incidence of an isotropic tree are in its lower half.
        if self.rank == 3 and level and index[0] >= 1 << (level - 1):
            out.append("{ 0.0 }")
            return
        if level >= self.deepest:
            raise MeasurementError(
                f"the rows are no whole tree: nothing is at cell {index} of level {level}"
            )
        out.append("{")
        for child in range(1 << self.rank):
            below = tuple(2 * n + (child >> k & 1) for k, n in enumerate(index))
            self._node(below, level + 1, values, out)
        out.append("}")


def cells_at(
    theta_i: Array, phi_i: Array, theta_r: Array, phi_r: Array, area: Array, where: str
) -> CellsAt:
    """The cells whose centres `pairs` gives, from angles of the file's frame and areas.

    **Raises:** `MeasurementError` if areas and directions are not those of cells, or a cell
    is there twice.
    """
    level = np.rint(-0.5 * np.log2(np.maximum(area, 1e-30) / np.pi)).astype(np.int64)
    if level.min() < 0 or level.max() > _DEEPEST:
        raise MeasurementError(f"{where}: areas of {area.min():g} to {area.max():g} sr")
    size = 0.5**level
    turned = np.remainder(phi_i, 2 * np.pi)
    rank = 3 if np.ptp(turned) < 1e-9 and abs(turned[0] - np.pi) < 1e-9 else 4
    x, y = square(np.sin(theta_r), phi_r)
    if rank == 3:
        # The cell of the whole is seen at the middle of its lower half.
        first = [(1 - np.sin(theta_i)) / 2 + np.where(level == 0, 0.25, 0.0)]
    else:
        first = list(square(np.sin(theta_i), phi_i - np.pi))
    centre = np.stack([*first, x, y], axis=1)
    index = centre / size[:, None] - 0.5
    off = float(np.max(np.abs(index - np.rint(index))))
    if off > 1e-3:
        raise MeasurementError(
            f"{where}: directions are not at the centres of cells of their "
            "projected_solid_angle; write csv, or fit a model and export that"
        )
    places: dict[tuple[int, ...], int] = {}
    for row, (own, key) in enumerate(
        zip(level.tolist(), np.rint(index).astype(np.int64).tolist(), strict=True)
    ):
        if (own, *key) in places:
            raise MeasurementError(f"{where}: two rows are in one cell of the tree")
        places[own, *key] = row
    return CellsAt(rank, places, int(level.max()))


def square(radius: Array, phi: Array) -> tuple[Array, Array]:
    """Points of the unit square from polar coordinates on the unit disk."""
    turn = np.remainder(phi + np.pi / 4, 2 * np.pi) - np.pi / 4
    quarter = np.minimum(np.floor((turn + np.pi / 4) / (np.pi / 2)), 3)
    across = (turn - quarter * np.pi / 2) * 4 / np.pi * radius
    a = np.choose(quarter.astype(np.int64), [radius, -across, -radius, across])
    b = np.choose(quarter.astype(np.int64), [across, radius, -across, -radius])
    return (a + 1) / 2, (b + 1) / 2
