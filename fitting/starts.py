"""Where the search begins: a deterministic scan of the shape, and the best of it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import jax
import numpy as np

from fitting import sampling
from fitting.models.lobe import AxisPeak, Lobe
from fitting.parameters import Parameter, Scale, to_real_line
from fitting.peaks import peaks
from fitting.reduced import Problem
from fitting.solve import scan

_SCAN_ROWS = 2048
_BRIGHT_ROWS = 512
_SCAN_SIZES = {1: 24, 2: 64, 3: 96}
_APART = 0.7
# Peaks narrower than this may be narrower than any lobe's usual range of starts.
_NARROW = 0.05
_NARROW_POINTS = 32
_WIDTH_FACTORS = (0.5, 1.0, 2.0, 4.0)
_WIDTH_NODES = 256


def candidates(problem: Problem) -> np.ndarray:
    """Points ``(p, k)`` of the unknown shape, even over the starting ranges.

    An additive recurrence with the generalised golden ratio (Roberts 2018), which fills
    any number of dimensions evenly and has no seed. Equal lobes are put in the order of
    their widths, since exchanging them changes nothing.
    """
    unknowns = problem.unknowns
    names, declared = unknowns.free_shape, problem.model.parameters()
    lower, upper = np.asarray(unknowns.lower), np.asarray(unknowns.upper)
    ends = zip(lower.tolist(), upper.tolist(), strict=True)
    ranges = ((declared[n].scale, tuple(declared[n].start)) for n in names)
    return _even(tuple(names), tuple(ranges), tuple(ends)).copy()


@functools.lru_cache(maxsize=64)
def _even(
    names: tuple[str, ...],
    ranges: tuple[tuple[Scale, tuple[float, ...]], ...],
    ends: tuple[tuple[float, float], ...],
) -> np.ndarray:
    k = len(names)
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
    points = np.empty((count, k))
    for j, ((scale, start), (lower, upper)) in enumerate(zip(ranges, ends, strict=True)):
        low, high = (float(np.clip(s, lower, upper)) for s in start)
        if not low < high:
            low, high = lower, upper
        if scale == "log":
            value = low * (high / low) ** share[:, j]
        else:
            value = low + (high - low) * share[:, j]
        points[:, j] = [to_real_line(scale, v, lower, upper) for v in value]
    for group in _equal_lobes(names):
        order = np.argsort(points[:, group[0]], axis=1)
        for columns in group:
            points[:, columns] = np.take_along_axis(points[:, columns], order, axis=1)
    return points


def _equal_lobes(names: Sequence[str]) -> list[list[list[int]]]:
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
    bright = sampling.brightness(problem)
    narrow = narrow_candidates(problem, bright, points)
    if narrow.size:
        points = np.concatenate([points, narrow])
    cost, x = scan(thinned(problem, bright), jax.device_put(points))
    cost = np.where(np.isfinite(cost), np.asarray(cost), np.inf)
    chosen: list[int] = []
    for i in np.argsort(cost, kind="stable"):
        apart = all(np.max(np.abs(points[i] - points[j])) > _APART for j in chosen)
        if not chosen or apart:
            chosen.append(int(i))
        if len(chosen) == count:
            break
    return points[chosen], np.asarray(x)[chosen]


def narrow_candidates(
    problem: Problem, bright: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """More points ``(p, k)`` for data with a peak narrower than where the lobes start.

    Copies of the first points, each with the width of one lobe about as the data show it.
    None for ordinary data. ``bright (n,)`` is the rows' `sampling.brightness`.
    """
    model, free = problem.model, problem.unknowns.free_shape
    lower, upper = np.asarray(problem.unknowns.lower), np.asarray(problem.unknowns.upper)
    lobes: list[list[tuple[int, np.ndarray]]] = []
    for label, lobe in zip(model.labels, model.lobes, strict=True):
        shape = {p.name: p.default for p in lobe.parameters() if not p.coefficient}
        own = [n for n in shape if f"{label}.{n}" in free]
        if not own:
            continue
        width = sampling.visible_width(problem, bright, lobe, shape, _NARROW)
        if width is None:
            continue
        columns = []
        for name in sampling.width_parameters(lobe, shape, own):
            (p,) = (p for p in lobe.parameters() if p.name == name)
            j = free.index(f"{label}.{name}")
            low, high = float(lower[j]), float(upper[j])
            values = _values_of_widths(lobe, shape, p, (low, high), width)
            if np.all((p.start[0] <= values) & (values <= p.start[1])):
                continue
            columns.append(
                (j, np.array([to_real_line(p.scale, v, low, high) for v in values]))
            )
        if columns:
            lobes.append(columns)
    if not lobes:
        return points[:0]
    more = np.resize(points, (_NARROW_POINTS, points.shape[1]))
    for i in range(_NARROW_POINTS):
        for j, values in lobes[i // len(_WIDTH_FACTORS) % len(lobes)]:
            more[i, j] = values[i % len(_WIDTH_FACTORS)]
    return more


def _values_of_widths(
    lobe: Lobe,
    shape: dict[str, float],
    parameter: Parameter,
    ends: tuple[float, float],
    width: float,
) -> np.ndarray:
    """Values of a parameter with which a lobe is about as wide as the data show it."""
    found = _sizes(lobe, tuple(shape.items()), parameter.name, parameter.scale, ends)
    if found is None:
        return np.full(len(_WIDTH_FACTORS), shape[parameter.name])
    nodes, sizes = found
    wanted = np.log(width * np.array(_WIDTH_FACTORS))
    return nodes[np.argmin(np.abs(np.log(sizes)[:, None] - wanted), axis=0)]


@functools.lru_cache(maxsize=256)
def _sizes(
    lobe: Lobe,
    shape: tuple[tuple[str, float], ...],
    name: str,
    scale: str,
    ends: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray] | None:
    """Values of a parameter and the width of the peak at each; the same for all data."""
    share = np.linspace(0.0, 1.0, _WIDTH_NODES)
    nodes = ends[0] + (ends[1] - ends[0]) * share
    if scale == "log":
        nodes = ends[0] * (ends[1] / ends[0]) ** share
    peak = peaks(lobe, dict(shape), name, nodes)
    if peak is None:
        return None
    if isinstance(peak, AxisPeak):
        return nodes, np.sqrt(2.0 / np.maximum(peak.exponent, 1e-3))
    x, y = np.asarray(peak.alpha_x), np.asarray(peak.alpha_y)
    return nodes, x if np.ptp(x) > 0 else y


def thinned(problem: Problem, bright: np.ndarray) -> Problem:
    """At most `_SCAN_ROWS` rows, drawn with a fixed seed: enough to find the basin.

    The brightest rows are all there, lest a narrow peak be missed; each of the others
    stands for as many as were left out. ``bright (n,)`` is their `sampling.brightness`.
    """
    n = problem.kappa.shape[0]
    if n <= _SCAN_ROWS:
        return problem
    brightest = np.sort(_brightest(bright, _BRIGHT_ROWS))
    drawn = _SCAN_ROWS - _BRIGHT_ROWS
    rng = np.random.default_rng(0)
    others = np.sort(rng.choice(n - _BRIGHT_ROWS, drawn, replace=False, shuffle=False))
    # Of the rows that are left; so many of the brightest come before.
    others += np.searchsorted(brightest - np.arange(_BRIGHT_ROWS), others, side="right")
    rows = np.concatenate([brightest, others])
    stands_for = np.ones(_SCAN_ROWS)
    stands_for[_BRIGHT_ROWS:] = np.sqrt((n - _BRIGHT_ROWS) / drawn)

    def take(a):
        return np.asarray(a)[..., rows]

    target = linear_target = take(problem.linear_target)
    if problem.target is not problem.linear_target:
        target = take(problem.target)
    return dataclasses.replace(
        problem,
        chunk=_SCAN_ROWS,
        geometry=jax.tree.map(take, problem.geometry),
        angle_rows=jax.tree.map(take, problem.angle_rows),
        kappa=take(problem.kappa),
        target=target,
        linear_target=linear_target,
        weight=take(problem.weight) * stands_for,
        linear_weight=take(problem.linear_weight) * stands_for,
    )


def _brightest(bright: np.ndarray, count: int) -> np.ndarray:
    """The rows with the ``count`` largest values, in any order."""
    # The largest values of as many parts: there are that many rows not below the least.
    parts = bright[: bright.size // count * count].reshape(-1, count)
    rows = np.flatnonzero(bright >= np.min(np.max(parts, axis=0)))
    if rows.size > count:
        rows = rows[np.argpartition(-bright[rows], count)[:count]]
    return rows
