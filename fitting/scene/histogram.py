"""Pairs of directions with weights, as the histogram of a scene has them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from fitting.scene.description import Histogram, SceneError
from fitting.scene.table import read_table

COLUMNS = ("theta_i", "phi_i", "theta_r", "phi_r", "weight")


class Pairs(NamedTuple):
    """Directions ``(n,)`` in rad, and weights ``(n,)`` whose sum is 1."""

    theta_i: np.ndarray
    phi_i: np.ndarray
    theta_r: np.ndarray
    phi_r: np.ndarray
    weight: np.ndarray


def pairs(seen: Histogram) -> Pairs:
    """The rows of a histogram that have a weight. Raises `SceneError`."""
    table = np.array(seen.rows) if seen.rows else _of_file(Path(seen.file or ""))
    table = table[table[:, 4] > 0]
    theta_i, phi_i, theta_r, phi_r = np.radians(table[:, :4]).T
    return Pairs(theta_i, phi_i, theta_r, phi_r, table[:, 4] / table[:, 4].sum())


def _of_file(path: Path) -> np.ndarray:
    table = read_table(path, COLUMNS)
    for column, (low, high) in {
        0: (0, 90),
        1: (-360, 360),
        2: (0, 90),
        3: (-360, 360),
    }.items():
        wrong = (table[:, column] < low) | (table[:, column] > high)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise SceneError(
                f"{path}: {COLUMNS[column]} of row {row + 1} is {table[row, column]:g}; "
                f"expected {low} to {high} degrees"
            )
    if np.any(table[:, 4] < 0) or not np.any(table[:, 4] > 0):
        raise SceneError(
            f"{path}: weights go from {table[:, 4].min():g} to {table[:, 4].max():g}; "
            "expected none below 0 and some above"
        )
    return table
