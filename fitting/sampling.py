"""How finely the rows of a measurement sample a lobe, and whether that shows its width."""

from __future__ import annotations

from typing import NamedTuple

import jax
import numpy as np

from fitting.geometry import Geometry
from fitting.models.lobe import AxisPeak, Lobe, Peak, Shape
from fitting.models.retro import Retro
from fitting.models.turned_over import TurnedOver
from fitting.peaks import peak as peak_of
from fitting.reduced import Problem
from fitting.solid_angle import angle_labels

# In widths of the lobe: nearer is the top, where every width looks alike, and farther the
# tail, whose course follows from the model rather than from the width alone.
_TOP, _FAR = 0.3, 3.0
_ENOUGH = 3
_MANY_ANGLES = 90
_PERTURBATION = 1e-3
# Rows that are looked at first, and at a time.
_FEW, _BLOCK = 1024, 1 << 16


class Distances(NamedTuple):
    """Distance of every row from the top of a lobe, in widths: whole and along its axes."""

    whole: np.ndarray
    along_x: np.ndarray
    along_y: np.ndarray


def _towards(g: Geometry, lobe: Lobe) -> tuple[Geometry, Lobe]:
    """The geometry as a lobe inside of others sees it: turned around, turned over."""
    if isinstance(lobe, TurnedOver):
        return _towards(g.turned_over, lobe.inner)
    if isinstance(lobe, Retro):
        return g.turned, lobe.inner
    return g, lobe


def facet_slopes(g: Geometry, lobe: Lobe, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Slopes along x and y of the facets that send the light where it was measured.

    Of transmitted light those that refract it, or let it pass straight on. Infinite where
    there are none.
    """
    g, lobe = _towards(g, lobe)
    front, _ = g.from_front
    x, y, z = (np.asarray(a, dtype=np.float64) for a in (front.hx, front.hy, front.hz))
    passage = lobe.passage(shape)
    through = np.asarray(g.transmits)
    if passage is not None and through.any():
        u = front.unfolded
        bent = (u.hx, u.hy, u.hz)
        if passage.eta is not None:
            bent = g.refracting(passage.eta)
        x, y, z = (np.where(through, b, a) for a, b in zip((x, y, z), bent, strict=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = x / z, y / z
    seen = np.asarray(g.on(lobe.ways)) & (z > 0)
    return tuple(np.where(seen, s, np.inf) for s in slopes)  # type: ignore[return-value]


def axis_slopes(g: Geometry, peak: AxisPeak) -> np.ndarray:
    """Tangent of the angle between source and axis, infinite from 90 degrees on."""
    c_xy, c_z = float(peak.c_xy), float(peak.c_z)
    a = np.stack([c_xy * np.asarray(g.wox), c_xy * np.asarray(g.woy), c_z * g.cos_o])
    i = np.stack([np.asarray(g.wix), np.asarray(g.wiy), np.asarray(g.cos_i)])
    dot = np.sum(a * i, axis=0)
    across = np.linalg.norm(np.cross(a, i, axis=0), axis=0)
    return np.where(dot > 0, across / np.where(dot > 0, dot, 1.0), np.inf)


def distances(g: Geometry, lobe: Lobe, shape: Shape) -> Distances | None:
    """How many widths every row is away from the top; None for a lobe without a peak."""
    peak = peak_of(lobe, shape)
    if peak is None:
        return None
    if isinstance(peak, AxisPeak):
        # cos^n is exp(-x^2 n / 2) near its axis.
        r = axis_slopes(_towards(g, lobe)[0], peak)
        r = r * np.sqrt(0.5 * max(float(peak.exponent), 1e-3))
        return Distances(r, r, r)
    x, y = facet_slopes(g, lobe, shape)
    c, s = np.cos(float(peak.angle)), np.sin(float(peak.angle))
    far = ~(np.isfinite(x) & np.isfinite(y))
    x, y = np.where(far, 0.0, x), np.where(far, 0.0, y)
    along_x = np.where(far, np.inf, np.abs(c * x + s * y) / float(peak.alpha_x))
    along_y = np.where(far, np.inf, np.abs(c * y - s * x) / float(peak.alpha_y))
    return Distances(np.hypot(along_x, along_y), along_x, along_y)


def width_parameters(
    lobe: Lobe, shape: dict[str, float], free: list[str]
) -> dict[str, tuple[bool, bool]]:
    """Free parameters that set the width of a lobe along x and along y.

    Where several do, the first in order of declaration counts.
    """
    out: dict[str, tuple[bool, bool]] = {}
    taken = [False, False]
    base = _sizes(peak_of(lobe, shape))
    for p in lobe.parameters():
        if p.coefficient or p.name not in free or base is None:
            continue
        value = shape[p.name]
        moved = value + _PERTURBATION * max(abs(value), _PERTURBATION)
        other = {**shape, p.name: moved if moved <= p.support[1] else 2 * value - moved}
        sizes = _sizes(peak_of(lobe, other))
        changes = [
            not t and a != b for t, a, b in zip(taken, sizes or base, base, strict=True)
        ]
        if any(changes):
            out[p.name] = (changes[0], changes[1])
            taken = [t or c for t, c in zip(taken, changes, strict=True)]
    return out


def _sizes(peak: Peak) -> tuple[float, float] | None:
    if peak is None:
        return None
    if isinstance(peak, AxisPeak):
        return float(peak.exponent), float(peak.exponent)
    return float(peak.alpha_x), float(peak.alpha_y)


def used_rows(problem: Problem) -> np.ndarray:
    """Which of the padded rows count for anything."""
    return np.any(np.asarray(problem.weight) > 0, axis=0)


def sentences(problem: Problem, values: dict[str, np.ndarray]) -> list[str]:
    """Where the rows lie too far apart to show how wide a lobe is."""
    model, used = problem.model, used_rows(problem)
    if not used.any():
        return []
    geometry = jax.tree.map(lambda a: np.asarray(a)[used], problem.geometry)
    incidence = _incidences(geometry)
    free = problem.unknowns.free_shape
    declared = model.parameters()
    out: list[str] = []
    for i, lobe in enumerate(model.lobes):
        own = {
            p.name: float(np.ravel(values[f"{model.labels[i]}.{p.name}"])[0])
            for p in lobe.parameters()
            if not p.coefficient
        }
        mine = [n for n in own if f"{model.labels[i]}.{n}" in free]
        if not mine:
            continue
        arrays = {n: jax.device_put(v) for n, v in own.items()}
        away = distances(geometry, lobe, arrays)
        if away is None:
            continue
        amplitudes = [n for n in declared if n.startswith(f"{model.labels[i]}.")]
        amplitudes = [n for n in amplitudes if declared[n].coefficient]
        if amplitudes and not any(np.any(values[n] != 0) for n in amplitudes):
            continue
        for name, axes in width_parameters(lobe, own, mine).items():
            words = _of_width(away, axes, incidence)
            if words:
                out.append(f"{model.labels[i]}.{name} {own[name]:.3g}: {words}")
    return out


def _incidences(g: Geometry) -> np.ndarray:
    """A number per angle of incidence; one for all where they are scattered."""
    theta = np.arctan2(np.hypot(g.wix, g.wiy), g.cos_i)
    label = angle_labels(theta)
    return label if label.max(initial=0) < _MANY_ANGLES else np.zeros_like(label)


def _of_width(
    away: Distances, axes: tuple[bool, bool], incidence: np.ndarray
) -> str | None:
    whole = away.whole
    along = {(True, False): away.along_x, (False, True): away.along_y}
    own = along.get(axes, whole)
    lobe = whole <= _FAR
    if not lobe.any():
        nearest = float(np.min(whole, initial=np.inf))
        return (
            f"no row lies on the lobe, the nearest is {nearest:.3g} of its widths from the "
            "top: its width and its height follow from its tail alone, if at all"
        )
    # The height differs from one angle of incidence to the next, by Fresnel's law and by
    # shadowing, so that only rows of one angle show a width.
    on = np.bincount(incidence[lobe])
    flank = np.bincount(incidence[lobe & (own >= _TOP)], minlength=on.size)
    if np.any((on >= _ENOUGH) & (flank >= _ENOUGH - 1)):
        return None
    most, rows = int(on.max()), int(on.sum())
    beyond = whole[~lobe]
    nearest = ""
    if beyond.size and np.isfinite(np.min(beyond)):
        nearest = f"; the next is {np.min(beyond):.3g} of its widths from the top"
    return (
        f"at most {most} row{'s' if most > 1 else ''} of one angle of incidence "
        f"lie{'s' if most == 1 else ''} on the lobe ({rows} in all{nearest}): the sampling "
        "bounds its width from above; more follows only from its tail and from how the "
        "model relates the angles"
    )


def brightness(problem: Problem) -> np.ndarray:
    """Largest value of every row ``(n,)`` among channels that count; -inf if none does."""
    weight, value = np.asarray(problem.weight), np.asarray(problem.linear_target)
    if len(weight) == 1:
        return np.where(weight[0] > 0, value.max(axis=0), -np.inf)
    out = np.full(value.shape[1], -np.inf)
    for w, v in zip(weight, value, strict=True):
        np.maximum(out, np.where(w > 0, v, -np.inf), out=out)
    return out


def visible_width(
    problem: Problem,
    bright: np.ndarray,
    lobe: Lobe,
    shape: dict[str, float],
    widest: float,
) -> float | None:
    """Slope at which the data fall to half of their largest value, roughly.

    Between the last row that is above half and the first one beyond that is below. None
    for a lobe without a peak, where no row lies beyond, or if it is more than ``widest``.
    ``bright`` is the problem's `brightness`.
    """
    peak = peak_of(lobe, shape)
    if peak is None:
        return None
    own = {n: np.asarray(v) for n, v in shape.items()}

    def located(rows: slice | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        g = jax.tree.map(lambda a: np.asarray(a)[rows], problem.geometry)
        if isinstance(peak, AxisPeak):
            slope = axis_slopes(_towards(g, lobe)[0], peak)
        else:
            slope = np.hypot(*facet_slopes(g, lobe, own))  # pyright: ignore
        return np.asarray(g.on(lobe.ways)), slope

    # Few data are narrow, which a few of the brightest rows tell.
    top = int(np.argmax(bright))
    few = np.flatnonzero(bright >= 0.5 * bright[top])[:_FEW]
    on, slope = located(np.append(few, top))
    if on[-1] and bright[top] > 0 and np.max(slope[on]) > widest:
        return None
    blocks = [located(slice(i, i + _BLOCK)) for i in range(0, bright.size, _BLOCK)]
    on, slope = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    used = on & (bright > -np.inf)
    value, slope = bright[used], slope[used]
    if not (value.size and np.max(value) > 0):
        return None
    inside = float(np.max(slope[value >= 0.5 * np.max(value)]))
    beyond = slope[slope > inside]
    if not (beyond.size and np.isfinite(np.min(beyond))):
        return None
    outside = float(np.min(beyond))
    width = float(np.sqrt(max(inside, 0.1 * outside) * outside))
    return width if width <= widest else None
