"""The double integral of a lobe over the light's beam and the detector's.

One beam is fixed at nodes, and for each of them the integral over the other one is done
around the peak of the lobe. The order of integration is free (Fubini): no reciprocity is
needed to exchange the beams.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.models import Lobe, Shape
from fitting.reflectance import rings
from fitting.reflectance.adapt import Integrals, Sampled, integrate
from fitting.reflectance.around import Path, chart_of, is_broad
from fitting.reflectance.beams import (
    Annular,
    Beam,
    Conical,
    Directional,
    Hemispherical,
    is_thin,
    projected_solid_angle,
    unit_vector,
)
from fitting.reflectance.charts import Polar
from fitting.reflectance.kernel import basis_values
from fitting.reflectance.panels import KRONROD
from fitting.reflectance.region import Cap, cap_of, caps_of

Radiance = Callable[[np.ndarray, np.ndarray], np.ndarray]

MOST_NODES = 4_000_000
_MOST_OUTER = 10_000
_RING = 64


@dataclass(frozen=True)
class Setting:
    """The beams of a quantity, and how light goes between them."""

    incident: Beam
    collected: Beam
    front: bool
    through: bool
    radiance: Radiance | None = None


@dataclass(frozen=True)
class Nodes:
    """``sum_k weight_k basis(wi_k, wo_k)`` with ``value, error (J, C)``."""

    wi: np.ndarray
    wo: np.ndarray
    weight: np.ndarray
    value: np.ndarray
    error: np.ndarray
    converged: bool


def lobe_nodes(
    lobe: Lobe, shape: Shape, amplitude: np.ndarray, setting: Setting, tolerance: float
) -> Nodes:
    """Integrals of the basis functions of a lobe over the two beams, with ``|cos| dw``.

    Over a direction nothing is integrated. ``amplitude (J, c)`` weighs the errors.
    """
    s = setting
    from_light = _light_first(lobe, s)
    path = Path(s.front, s.through, from_light)
    fixed, free = (s.incident, s.collected) if from_light else (s.collected, s.incident)
    fixed_radiance = s.radiance if from_light else None
    free_radiance = None if from_light else s.radiance
    inner = _Inner(lobe, shape, amplitude, path, free, free_radiance)
    if is_thin(fixed):
        directions, weights = _thin(fixed, lobe, free)
        found = inner.integrals(directions, tolerance)
        return _of_thin(found, directions, weights, path)
    aligned = isinstance(free, Hemispherical) and free.exclude is None
    if aligned and _isotropic(lobe) and s.radiance is None:
        of_polar_angle = functools.partial(inner.integrals, tolerance=0.25 * tolerance)
        outer, runs = rings.integrate(fixed, of_polar_angle, amplitude, 0.5 * tolerance)
    else:
        outer, runs = _outer(fixed, free, fixed_radiance, inner, amplitude, tolerance)
    return _of_outer(outer, runs, path)


@dataclass(frozen=True)
class _Inner:
    """The integral over the free beam for fixed directions."""

    lobe: Lobe
    shape: Shape
    amplitude: np.ndarray
    path: Path
    free: Beam
    radiance: Radiance | None

    def integrals(self, fixed: np.ndarray, tolerance: float) -> Integrals:
        if is_thin(self.free):
            return self._at_direction(fixed)
        chart, cuts = chart_of(self.lobe, self.shape, fixed, self.path)

        def integrand(owner: np.ndarray, direction: np.ndarray) -> Sampled:
            flat = direction.reshape(-1, 3)
            wi, wo = self.path.pairs(fixed[owner].reshape(-1, 3), flat)
            value = basis_values(self.lobe, self.shape, wi, wo)
            if self.radiance is not None:
                value = value * radiance_at(self.radiance, flat)[:, None, None]
            return Sampled(value.reshape(*owner.shape, *value.shape[1:]))

        return integrate(
            chart, (*caps_of(self.free), *cuts), integrand, self.amplitude,
            tolerance=tolerance, most=MOST_NODES, careful=len(fixed) == 1,
        )  # fmt: skip

    def _at_direction(self, fixed: np.ndarray) -> Integrals:
        """Over a direction or a ring of them nothing is integrated, only averaged."""
        free, weight = _thin(self.free, self.lobe, None)
        owner = np.repeat(np.arange(len(fixed)), len(free))
        direction = np.tile(free, (len(fixed), 1))
        wi, wo = self.path.pairs(fixed[owner], direction)
        value = basis_values(self.lobe, self.shape, wi, wo)
        value = value.reshape(len(fixed), len(free), *value.shape[1:])
        mean = np.einsum("nk...,k->n...", value, weight)
        error = np.zeros_like(mean)
        if len(free) > 1:
            error = np.abs(
                mean - np.einsum("nk...,k->n...", value[:, ::2], 2 * weight[::2])
            )
        return Integrals(
            mean, error, owner, direction, np.tile(weight, len(fixed)),
            np.zeros(owner.size, dtype=np.int64), True, owner.size,
        )  # fmt: skip


def radiance_at(radiance: Radiance, directions: np.ndarray) -> np.ndarray:
    """A user's radiance at directions ``(n, 3)`` given from the normal of their side."""
    theta = np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2])
    phi = np.mod(np.arctan2(directions[:, 1], directions[:, 0]), 2 * np.pi)
    found = np.asarray(radiance(theta, phi), dtype=np.float64)
    return np.broadcast_to(found, theta.shape)


def _light_first(lobe: Lobe, s: Setting) -> bool:
    """Whether to fix the light's direction and integrate over the detector's inside."""
    if is_thin(s.incident) or is_thin(s.collected):
        return is_thin(s.incident)
    whole = [
        isinstance(b, Hemispherical) and b.exclude is None
        for b in (s.incident, s.collected)
    ]
    if any(whole) and s.radiance is None and _isotropic(lobe):
        # Over a whole hemisphere such a lobe depends on the polar angle only.
        return whole[1]
    # The inner integral is the one that follows the lobe: the wider beam's.
    return projected_solid_angle(s.incident) <= projected_solid_angle(s.collected)


def _isotropic(lobe: Lobe) -> bool:
    return not any(p.scale == "periodic" for p in lobe.parameters())


def _thin(beam: Beam, lobe: Lobe, other: Beam | None) -> tuple[np.ndarray, np.ndarray]:
    """Directions ``(n, 3)`` of a beam without solid angle, and their shares."""
    if isinstance(beam, Directional):
        return unit_vector(beam.theta_deg, beam.phi_deg)[None], np.ones(1)
    assert isinstance(beam, Annular)
    around = isinstance(other, Hemispherical) and other.exclude is None
    around |= isinstance(other, Directional) and other.theta_deg == 0
    count = 1 if around and _isotropic(lobe) else _RING
    at = 360.0 * np.arange(count) / count
    points = np.stack([unit_vector(beam.theta_deg, a) for a in at])
    return points, np.full(count, 1.0 / count)


def _of_thin(
    found: Integrals, directions: np.ndarray, weights: np.ndarray, path: Path
) -> Nodes:
    value = np.einsum("n...,n->...", found.value, weights)
    error = np.einsum("n...,n->...", found.error, weights)
    if len(weights) > 1:
        half = np.einsum("n...,n->...", found.value[::2], 2 * weights[::2])
        error = error + np.abs(value - half)
    wi, wo = path.pairs(directions[found.owner], found.direction)
    weight = found.weight * weights[found.owner]
    return Nodes(wi, wo, weight, value, error, found.converged)


def _outer(
    fixed: Beam, free: Beam, radiance: Radiance | None, inner: _Inner,
    amplitude: np.ndarray, tolerance: float,
) -> tuple[Integrals, list[rings.Run]]:  # fmt: skip
    """Over both coordinates of the fixed beam, from where the peak enters the free one."""
    broad = is_broad(inner.lobe, inner.shape, inner.path)
    chart, cuts = _seen_from(fixed, fixed if broad else free)
    runs: list[rings.Run] = []

    def integrand(_: np.ndarray, direction: np.ndarray) -> Sampled:
        flat = direction.reshape(-1, 3)
        run = rings.Run(flat, inner.integrals(flat, 0.25 * tolerance))
        first = sum(len(r.fixed) for r in runs)
        runs.append(run)
        light = np.ones(len(flat)) if radiance is None else radiance_at(radiance, flat)
        value, error = (
            (v * light[:, None, None]).reshape(*direction.shape[:-1], *v.shape[1:])
            for v in (run.found.value, run.found.error)
        )
        tag = first + np.arange(len(flat)).reshape(direction.shape[:-1])
        return Sampled(value, error, tag)

    found = integrate(
        chart, (*caps_of(fixed), *cuts), integrand, amplitude,
        tolerance=0.5 * tolerance, most=_MOST_OUTER, at_once=2 * KRONROD.size**2,
    )  # fmt: skip
    if radiance is not None:
        light = radiance_at(radiance, found.direction)
        found = Integrals(**{**vars(found), "weight": found.weight * light})
    return found, runs


def _seen_from(fixed: Beam, free: Beam) -> tuple[Polar, tuple[Cap, ...]]:
    """Rays from the mirror image of the free cone's axis, and a break at its edge."""
    if fixed is free and isinstance(fixed, Conical):
        return Polar(cap_of(fixed, "cut").axis[None], np.zeros(1), 1.0), ()
    cone = free.exclude if isinstance(free, Hemispherical) else free
    if not isinstance(cone, Conical):
        cone = fixed if isinstance(fixed, Conical) else Conical(0.0, 0.0, 90.0)
        image, cuts = cap_of(cone, "cut"), ()
    else:
        image = cap_of(cone, "cut")
        image = Cap(image.axis * np.array([-1.0, -1.0, 1.0]), image.half_angle, "cut")
        cuts = (image,)
    scale = math.tan(0.5 * math.radians(cone.half_angle_deg))
    return Polar(image.axis[None], np.zeros(1), scale), cuts


def _of_outer(outer: Integrals, runs: list[rings.Run], path: Path) -> Nodes:
    fixed = np.concatenate([r.fixed for r in runs])
    share = np.zeros(len(fixed))
    share[outer.tag] = outer.weight
    wi, wo, weight, first = [], [], [], 0
    for run in runs:
        own = share[first : first + len(run.fixed)]
        first += len(run.fixed)
        w = run.found.weight * own[run.found.owner]
        some = w != 0
        pair = path.pairs(run.fixed[run.found.owner[some]], run.found.direction[some])
        wi.append(pair[0])
        wo.append(pair[1])
        weight.append(w[some])
    converged = outer.converged and all(r.found.converged for r in runs)
    return Nodes(
        np.concatenate(wi), np.concatenate(wo), np.concatenate(weight),
        outer.value[0], outer.error[0], converged,
    )  # fmt: skip
