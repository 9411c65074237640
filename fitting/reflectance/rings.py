"""Integrals over a beam of what depends on the polar angle only."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.reflectance.adapt import SAFETY, Integrals
from fitting.reflectance.beams import Beam, Conical, Hemispherical
from fitting.reflectance.panels import GAUSS, KRONROD, NODES

_MOST_ROUNDS = 30


@dataclass(frozen=True)
class Run:
    """The inner integrals of some fixed directions ``(n, 3)``."""

    fixed: np.ndarray
    found: Integrals


Inner = Callable[[np.ndarray], Integrals]


def integrate(
    beam: Beam, inner: Inner, amplitude: np.ndarray, tolerance: float
) -> tuple[Integrals, list[Run]]:
    """``int E(theta) cos(theta) arc(theta) sin(theta) dtheta``, with nodes and runs.

    ``arc`` is the azimuth, rad, that the beam has at a polar angle. Panels end where it
    is no circle any more, with nodes crowding there, and are halved as in `adapt`.
    """
    size = np.abs(amplitude)
    edges = _edges(beam)
    ends = np.column_stack([edges[:-1], edges[1:], np.zeros(edges.size - 1),
                            np.ones(edges.size - 1)])  # fmt: skip
    done: list[tuple] = []
    runs: list[Run] = []
    total, converged = np.zeros(0), False
    for _ in range(_MOST_ROUNDS):
        low, high, s0, s1 = (c[:, None] for c in ends.T)
        x = s0 + (s1 - s0) * NODES
        theta = low + (high - low) * x * x * (3.0 - 2.0 * x)
        step = (high - low) * 6.0 * x * (1.0 - x) * (s1 - s0)
        measure = arc(beam, theta) * np.sin(theta) * np.cos(theta) * step
        flat = theta.reshape(-1)
        fixed = np.column_stack([np.sin(flat), np.zeros(flat.size), np.cos(flat)])
        run = Run(fixed, inner(fixed))
        tag = sum(len(r.fixed) for r in runs) + np.arange(flat.size).reshape(theta.shape)
        runs.append(run)
        shape = (*theta.shape, *run.found.value.shape[1:])
        f = run.found.value.reshape(shape) * measure[..., None, None]
        own = run.found.error.reshape(shape) * measure[..., None, None]
        value = np.einsum("px...,x->p...", f, KRONROD)
        error = SAFETY * np.abs(value - np.einsum("px...,x->p...", f, GAUSS))
        own = np.einsum("px...,x->p...", own, KRONROD)
        weight = measure * KRONROD
        done += list(zip(ends, value, error, own, weight, tag, strict=True))
        total = np.sum([d[1] for d in done], axis=0)
        level = np.max(np.sum(np.abs(total) * size, axis=0))
        errors = np.array([np.max(np.sum(d[2] * size, axis=0)) for d in done])
        target = tolerance * level
        if errors.sum() <= target:
            converged = True
            break
        again = errors > 0.5 * target / len(done)
        halves = [_halves(d[0]) for d, bad in zip(done, again, strict=True) if bad]
        ends = np.concatenate(halves)
        done = [d for d, bad in zip(done, again, strict=True) if not bad]
    bound = np.sum([d[2] + d[3] for d in done], axis=0)
    weight, tag = (np.concatenate([d[k] for d in done]) for k in (4, 5))
    fixed = np.concatenate([r.fixed for r in runs])[tag]
    found = Integrals(
        total[None], bound[None], np.zeros(tag.size, dtype=np.int64), fixed, weight, tag,
        converged, tag.size,
    )  # fmt: skip
    return found, runs


def _halves(ends: np.ndarray) -> np.ndarray:
    low, high, s0, s1 = ends
    middle = 0.5 * (s0 + s1)
    return np.array([[low, high, s0, middle], [low, high, middle, s1]])


def _edges(beam: Beam) -> np.ndarray:
    right = 0.5 * math.pi
    cone = beam.exclude if isinstance(beam, Hemispherical) else beam
    if not isinstance(cone, Conical):
        return np.array([0.0, right])
    theta, a = math.radians(cone.theta_deg), math.radians(cone.half_angle_deg)
    ends = [abs(theta - a), theta + a]
    if isinstance(beam, Hemispherical) or theta < a:
        ends.append(0.0)
    if isinstance(beam, Hemispherical):
        ends.append(right)
    return np.unique(np.clip(ends, 0.0, right))


def arc(beam: Beam, polar: np.ndarray) -> np.ndarray:
    """Azimuth in rad that a beam covers at polar angles.

    Of a cone twice ``2 atan2(root of inside, root of outside)``, ``cos(d) = (cos(a) -
    cos(theta) cos(t)) / (sin(theta) sin(t))`` without cancellation.
    """
    cone = beam.exclude if isinstance(beam, Hemispherical) else beam
    if not isinstance(cone, Conical):
        return np.full(polar.shape, 2.0 * math.pi)
    theta, a = math.radians(cone.theta_deg), math.radians(cone.half_angle_deg)
    inside = np.sin(0.5 * (a + theta - polar)) * np.sin(0.5 * (a - theta + polar))
    outside = np.sin(0.5 * (theta + polar + a)) * np.sin(0.5 * (theta + polar - a))
    arc = 4.0 * np.arctan2(*(np.sqrt(np.maximum(v, 0.0)) for v in (inside, outside)))
    return 2.0 * math.pi - arc if isinstance(beam, Hemispherical) else arc
