"""Where lobes are exercised: the closed domain, with its extremes over-represented.

The polar angles go from exactly 0 to exactly 90 degrees, the shape parameters to both ends
of their supports. Pairs are drawn from strata: extreme angles, anywhere, the mirror and the
way back exactly and within the lobe's own width, opposite grazing pairs, normal incidence;
a third of them at azimuth zero, where components vanish. The seed is fixed by the name.
"""

from __future__ import annotations

import dataclasses
import zlib
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.geometry import Geometry, from_angles
from fitting.models import AxisPeak, SlopeWidths
from fitting.models.lobe import FROM_BACK, THROUGH
from fitting.parameters import Parameter
from fitting.stress.pairs import HORIZON, THETAS_DEG, directions, mirrored
from fitting.stress.variants import Variant

WIDTHS = (1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0, 1.5)
BLOCK = 250
_BROAD = 0.2
# A transmitted pair closer to the horizon is told from a reflected one by rounding alone.
NEAREST_THROUGH = 1e-7
_NEAR_PEAK = 0.7


@dataclass(frozen=True)
class Points:
    """Directions, rad, and shape parameters by name, all ``(n,)`` in float64."""

    theta_i: np.ndarray
    phi_i: np.ndarray
    theta_o: np.ndarray
    phi_o: np.ndarray
    shape: dict[str, np.ndarray]

    @property
    def geometry(self) -> Geometry:
        """The directions as components."""
        return from_angles(self.theta_i, self.phi_i, self.theta_o, self.phi_o)

    def below(self, distance: float) -> Points:
        """The same with no direction nearer to the horizon than this angle, rad."""
        most = HORIZON - distance

        def away(theta: np.ndarray) -> np.ndarray:
            behind = theta > HORIZON
            return np.where(
                behind, np.pi - np.minimum(np.pi - theta, most), np.minimum(theta, most)
            )

        return Points(
            away(self.theta_i), self.phi_i, away(self.theta_o), self.phi_o, self.shape
        )

    def along(self, way: np.ndarray) -> Points:
        """The same with the light on these ways (``(n,)`` names), by turning directions to
        the other side of the sample."""
        behind_i, behind_o = np.isin(way, FROM_BACK), np.isin(way, ("back", "down"))
        return Points(
            np.where(behind_i, np.pi - self.theta_i, self.theta_i),
            self.phi_i,
            np.where(behind_o, np.pi - self.theta_o, self.theta_o),
            self.phi_o,
            self.shape,
        )

    def chosen(self, index: np.ndarray | slice) -> Points:
        """Some of them."""
        return Points(
            self.theta_i[index],
            self.phi_i[index],
            self.theta_o[index],
            self.phi_o[index],
            {n: v[index] for n, v in self.shape.items()},
        )

    def words(self, k: int) -> str:
        """One point for people: ``alpha 0.001, source at 45 deg, ...``."""
        apart = (self.phi_o[k] - self.phi_i[k] + np.pi) % (2 * np.pi) - np.pi
        values = [f"{n} {v[k]:.4g}" for n, v in self.shape.items()]
        return ", ".join(
            [
                *values,
                f"source {_degrees(self.theta_i[k])}",
                f"detector {_degrees(self.theta_o[k])} deg from the normal",
                f"azimuths {abs(np.degrees(apart)):.4g} deg apart",
            ]
        )


def stratified(variant: Variant, count: int, *, salt: str = "") -> Points:
    """As many points of a variant, always the same ones: fewer points are the first of
    more."""
    parts = []
    for block in range(max(-(-count // BLOCK), 1)):
        seed = (zlib.crc32(f"{variant}{salt}".encode()), block)
        rng = np.random.default_rng(seed)
        shape = {p.name: _values(p, rng, BLOCK) for p in variant.shapes}
        there = Points(*directions(_width(variant, shape), rng, BLOCK), shape)
        parts.append(_on_its_ways(variant, there, rng))
    return joined(*parts).chosen(slice(count))


def _on_its_ways(variant: Variant, points: Points, rng: np.random.Generator) -> Points:
    """Points on every way of light that the lobe knows; refracted ones are near its peak
    where the reflected ones were."""
    ways = variant.lobe.ways
    if ways == ("front",):
        return points
    way = rng.choice(np.asarray(ways), np.size(points.theta_i))
    # Nothing goes through along the horizon.
    through = np.isin(way, THROUGH)
    away = points.below(NEAREST_THROUGH)
    points = dataclasses.replace(
        points,
        theta_i=np.where(through, away.theta_i, points.theta_i),
        theta_o=np.where(through, away.theta_o, points.theta_o),
    )
    moved = points.along(way)
    passage = _passage_index(variant, points.shape)
    if passage is None:
        return moved
    index = np.where(way == "down", passage, 1.0 / passage)
    theta, phi, refracted = _refracted(points, index)
    use = through & refracted & (rng.random(way.size) < _NEAR_PEAK)
    return dataclasses.replace(
        moved,
        theta_o=np.where(use, np.where(way == "down", np.pi - theta, theta), moved.theta_o),
        phi_o=np.where(use, phi, moved.phi_o),
    )


def _passage_index(variant: Variant, shape: dict[str, np.ndarray]) -> np.ndarray | None:
    """The relative index that the lobe refracts with, or None if light goes straight on."""
    with jax.enable_x64(True):
        own = {n: jnp.asarray(v) for n, v in shape.items()}
        passage = jax.vmap(variant.lobe.passage)(own) if own else None
    if passage is None or passage.eta is None:
        return None
    return np.asarray(passage.eta)


def _refracted(
    points: Points, index: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polar angle to the far normal and azimuth of the light that the facet refracts which
    would have reflected it to the detector, and whether there is such light."""
    g = points.geometry
    cos_t2 = 1.0 - (1.0 - g.cos_d) * (1.0 + g.cos_d) / index**2
    turn = g.cos_d / index - np.sqrt(np.maximum(cos_t2, 0.0))
    x, y = turn * g.hx - g.wix / index, turn * g.hy - g.wiy / index
    z = g.cos_i / index - turn * g.hz
    seen = np.asarray((cos_t2 > 0) & (z > 1e-9))
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x), seen


def product_of_extremes(variant: Variant, count: int) -> Points:
    """Extreme shapes by extreme directions: every combination of the directions with
    shapes drawn from all combinations of extreme values, until there are ``count``."""
    rng = np.random.default_rng(zlib.crc32(f"{variant} extremes".encode()))
    theta = np.radians(THETAS_DEG)
    grid = np.meshgrid(theta, theta, np.radians([0.0, 40.0, 90.0, 180.0]), indexing="ij")
    ti, to, apart = (g.ravel() for g in grid)
    order = np.concatenate([rng.permutation(ti.size) for _ in range(-(-count // ti.size))])[
        :count
    ]
    phi = rng.choice([0.0, 0.3], count)
    shape = {p.name: rng.choice(extremes(p), count) for p in variant.shapes}
    points = Points(ti[order], phi, to[order], phi + apart[order], shape)
    return _on_its_ways(variant, points, rng)


def joined(*parts: Points) -> Points:
    """All points of several sets."""

    def both(field: str) -> np.ndarray:
        return np.concatenate([getattr(p, field) for p in parts])

    names = parts[0].shape
    return Points(
        both("theta_i"),
        both("phi_i"),
        both("theta_o"),
        both("phi_o"),
        {n: np.concatenate([p.shape[n] for p in parts]) for n in names},
    )


def shuffled(points: Points) -> Points:
    """The same in another order, so that the first ones are some of every kind."""
    count = np.size(points.theta_i)
    return points.chosen(np.random.default_rng(count).permutation(count))


def interior(variant: Variant, count: int, *, salt: str = "") -> Points:
    """Shape parameters inside their supports, directions up to 80 degrees, at random."""
    rng = np.random.default_rng(zlib.crc32(f"{variant} interior{salt}".encode()))
    shape = {
        p.name: _spread(p, rng.uniform(0.1, 0.9, count), p.start) for p in variant.shapes
    }
    ti, to = rng.uniform(0.02, np.radians(80.0), (2, count))
    pi, po = rng.uniform(0.0, 2 * np.pi, (2, count))
    if variant.lobe.ways == ("front",):
        return Points(ti, pi, to, po, shape)
    # The beams of plates are nothing but their peak.
    near = rng.random(count) < _NEAR_PEAK
    slope = _width(variant, shape) * rng.uniform(0.1, 2.0, count)
    theta, phi = mirrored(ti, slope, rng.uniform(0, 2 * np.pi, count))
    near &= theta < np.radians(80.0)
    to, po = np.where(near, theta, to), np.where(near, pi + phi, po)
    return _on_its_ways(variant, Points(ti, pi, to, po, shape), rng)


def default_shape(variant: Variant, count: int) -> dict[str, np.ndarray]:
    """The default values, one for each of the points."""
    return {p.name: np.full(count, p.default) for p in variant.shapes}


def extremes(p: Parameter) -> np.ndarray:
    """Values over the closed support of a shape parameter, ends included."""
    low, high = p.support
    if p.name.startswith("alpha"):
        inside = [w for w in WIDTHS if low < w < high]
        return np.array([low, *inside, high])
    if p.scale == "periodic":
        return np.array([low, 0.3 * high])
    if p.scale == "log":
        return np.minimum(np.geomspace(low, high, 5), high)
    return low + (high - low) * np.array([0.0, 1e-4, 0.3, 0.9999, 1.0])


def _values(p: Parameter, rng: np.random.Generator, count: int) -> np.ndarray:
    at_random = _spread(p, rng.random(count), p.support)
    usual = _spread(p, rng.random(count), p.start)
    share = rng.random(count)
    edge = rng.choice(extremes(p), count)
    return np.where(share < 0.4, edge, np.where(share < 0.7, at_random, usual))


def _spread(p: Parameter, share: np.ndarray, ends: tuple[float, float]) -> np.ndarray:
    low, high = ends
    if p.scale == "log":
        inside = low * np.exp(np.log(high / low) * share)
    else:
        inside = low + (high - low) * share
    return np.clip(inside, low, high)


def _width(variant: Variant, shape: dict[str, np.ndarray]) -> np.ndarray:
    """How wide the peak is, as an angle of the half vector, rad."""
    count = len(next(iter(shape.values()), np.zeros(1)))
    with jax.enable_x64(True):
        own = {n: jnp.asarray(v) for n, v in shape.items()}
        peak = jax.vmap(variant.lobe.peak)(own) if own else variant.lobe.peak(own)
    if isinstance(peak, SlopeWidths):
        width = np.minimum(peak.alpha_x, peak.alpha_y)
    elif isinstance(peak, AxisPeak):
        width = np.sqrt(2.0 / (np.asarray(peak.exponent) + 2.0))
    else:
        width = np.asarray(_BROAD)
    return np.broadcast_to(np.clip(width, 1e-6, 1.5), (count,))


def _degrees(theta: float) -> str:
    degrees = np.degrees(theta)
    if 0 < 90 - degrees < 1e-3:
        return f"90 - {90 - degrees:.2g}"
    return f"{degrees:.4g}"
