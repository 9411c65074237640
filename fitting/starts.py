"""Where the search begins: a deterministic scan of the shape, and the best of it."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from fitting.parameters import to_real_line
from fitting.reduced import Problem
from fitting.solve import scan

_SCAN_ROWS = 2048
_SCAN_SIZES = {1: 24, 2: 64, 3: 96}
_APART = 0.7


def candidates(problem: Problem) -> np.ndarray:
    """Points ``(p, k)`` of the unknown shape, even over the starting ranges.

    An additive recurrence with the generalised golden ratio (Roberts 2018), which fills
    any number of dimensions evenly and has no seed. Equal lobes are put in the order of
    their widths, since exchanging them changes nothing.
    """
    unknowns = problem.unknowns
    k = unknowns.n_shape
    if k == 0:
        return np.zeros((1, 0))
    count = _SCAN_SIZES.get(k, 128)
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (k + 1))
    steps = ratio ** -np.arange(1, k + 1)
    share = np.mod(0.5 + np.outer(np.arange(count), steps), 1.0)
    if k == 1:
        share = (np.arange(count)[:, None] + 0.5) / count
    declared = problem.model.parameters()
    lower, upper = np.asarray(unknowns.lower), np.asarray(unknowns.upper)
    points = np.empty((count, k))
    for j, name in enumerate(unknowns.free_shape):
        parameter = declared[name]
        low, high = (float(np.clip(s, lower[j], upper[j])) for s in parameter.start)
        if not low < high:
            low, high = float(lower[j]), float(upper[j])
        if parameter.scale == "log":
            value = low * (high / low) ** share[:, j]
        else:
            value = low + (high - low) * share[:, j]
        points[:, j] = [
            to_real_line(parameter.scale, v, float(lower[j]), float(upper[j]))
            for v in value
        ]
    for group in _equal_lobes(unknowns.free_shape):
        order = np.argsort(points[:, group[0]], axis=1)
        for columns in group:
            points[:, columns] = np.take_along_axis(points[:, columns], order, axis=1)
    return points


def _equal_lobes(names: list[str]) -> list[list[list[int]]]:
    """Per family of equal lobes: for every parameter, its columns in lobe order."""
    families: dict[str, dict[str, list[int]]] = {}
    for j, name in enumerate(names):
        label, _, parameter = name.rpartition(".")
        families.setdefault(label.rstrip("0123456789"), {}).setdefault(
            parameter, []
        ).append(j)
    out = []
    for parameters in families.values():
        columns = list(parameters.values())
        if len(columns[0]) > 1 and all(len(c) == len(columns[0]) for c in columns):
            out.append(columns)
    return out


def best_starts(problem: Problem, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The ``count`` best distinct points of the scan, with their coefficients."""
    points = candidates(problem)
    cost, x = scan(_thinned(problem), jnp.asarray(points))
    cost = np.where(np.isfinite(cost), np.asarray(cost), np.inf)
    chosen: list[int] = []
    for i in np.argsort(cost, kind="stable"):
        apart = all(np.max(np.abs(points[i] - points[j])) > _APART for j in chosen)
        if not chosen or apart:
            chosen.append(int(i))
        if len(chosen) == count:
            break
    return points[chosen], np.asarray(x)[chosen]


def _thinned(problem: Problem) -> Problem:
    """At most `_SCAN_ROWS` rows, drawn with a fixed seed: enough to find the basin."""
    n = problem.kappa.shape[0]
    if n <= _SCAN_ROWS:
        return problem
    rows = np.sort(np.random.default_rng(0).permutation(n)[:_SCAN_ROWS])

    def take(a):
        return a[..., rows]

    return dataclasses.replace(
        problem,
        chunk=_SCAN_ROWS,
        geometry=jax.tree.map(take, problem.geometry),
        angle_rows=jax.tree.map(take, problem.angle_rows),
        **{
            name: take(getattr(problem, name))
            for name in ("kappa", "weight", "target", "linear_target", "linear_weight")
        },
    )
