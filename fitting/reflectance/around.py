"""Which chart suits a lobe: rays from where its light peaks, seen from a fixed direction.

Both sides of the sample are folded onto z > 0: the fixed direction and the free one are
both given from the normal of their own side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.models import AxisPeak, Lobe, Shape
from fitting.models.lobe import SlopeWidths
from fitting.models.retro import Retro
from fitting.models.turned_over import TurnedOver
from fitting.reflectance.charts import Chart, HalfVector, Polar
from fitting.reflectance.region import Cap

_NARROWEST = 1e-5


@dataclass(frozen=True)
class Path:
    """How light goes: from which side, and whether through the sample.

    ``from_light`` tells whether the fixed direction is the light's (or the detector's).
    """

    front: bool
    through: bool
    from_light: bool

    @property
    def signs(self) -> tuple[float, float]:
        """z of the fixed direction and of the free one."""
        light = 1.0 if self.front else -1.0
        other = -light if self.through else light
        return (light, other) if self.from_light else (other, light)

    def pairs(self, fixed: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``wi, wo (n, 3)`` of folded directions."""
        first, second = (
            v * np.array([1.0, 1.0, s])
            for v, s in zip((fixed, free), self.signs, strict=True)
        )
        return (first, second) if self.from_light else (second, first)


def is_broad(lobe: Lobe, shape: Shape, path: Path) -> bool:
    """Whether a lobe has no peak along a way."""
    with jax.enable_x64(True):
        own = {k: jnp.asarray(np.median(np.asarray(v))) for k, v in shape.items()}
        peak = lobe.passage(own) if path.through else lobe.peak(own)
    return peak is None


def chart_of(
    lobe: Lobe, shape: Shape, fixed: np.ndarray, path: Path
) -> tuple[Chart, tuple[Cap, ...]]:
    """The chart of fixed directions ``(N, 3)``, and circles at which panels end.

    Of shape parameters that differ between channels the median counts.
    """
    with jax.enable_x64(True):
        own = {k: jnp.asarray(np.median(np.asarray(v))) for k, v in shape.items()}
        upside = isinstance(lobe, TurnedOver)
        lobe = lobe.inner if isinstance(lobe, TurnedOver) else lobe
        front = (path.signs[0] > 0) != upside
        if path.through:
            passage = lobe.passage(own)
            if passage is None:
                return _broad(fixed)
            if passage.eta is None:
                return HalfVector(fixed, _numbers(passage.widths)), ()
            n = float(passage.eta) if front else 1.0 / float(passage.eta)
            return _refracted(fixed, _numbers(passage.widths), n), _facet_edges(fixed, n)
        turned = isinstance(lobe, Retro)
        peak = lobe.peak(own)
    towards = fixed * np.array([-1.0, -1.0, 1.0]) if turned else fixed
    if peak is None:
        return _broad(fixed)
    if isinstance(peak, AxisPeak):
        return _along(towards, peak), ()
    return HalfVector(towards, _numbers(peak)), _total_reflection(lobe, own, fixed, front)


def _total_reflection(
    lobe: Lobe, shape: Shape, fixed: np.ndarray, front: bool
) -> tuple[Cap, ...]:
    """Where facets begin to reflect totally, inside the denser medium.

    At ``sin(theta_d) = 1 / n``, an angle of ``2 theta_d`` between source and detector.
    """
    with jax.enable_x64(True):
        passage = lobe.passage(shape)
    if passage is None or passage.eta is None:
        return ()
    n = float(passage.eta) if front else 1.0 / float(passage.eta)
    return (Cap(fixed, 2.0 * math.asin(n), "cut"),) if n < 1.0 else ()


def _facet_edges(fixed: np.ndarray, n: float) -> tuple[Cap, ...]:
    """Where facets cease to refract: they would be edge on, or turned away.

    Light is bent by ``acos(1 / n)`` at most, and the facets' normal ``|w_f + n w_b|`` is
    level where ``cos_free = cos_fixed / n``.
    """
    straight = fixed * np.array([-1.0, -1.0, 1.0])
    level = np.arccos(np.minimum(fixed[:, 2] / n, 1.0))
    return (
        Cap(straight, math.acos(min(n, 1.0 / n)), "cut"),
        Cap(np.array([0.0, 0.0, 1.0]), level, "cut"),
    )


def _numbers(widths: SlopeWidths) -> tuple[float, float, float]:
    x, y, angle = (float(v) for v in widths)
    return max(x, _NARROWEST), max(y, _NARROWEST), angle


def _broad(fixed: np.ndarray) -> tuple[Polar, tuple[Cap, ...]]:
    """Rays from the normal: diffuse lobes have kinks at the polar angle of the source."""
    n = len(fixed)
    normal = np.array([0.0, 0.0, 1.0])
    sine = np.hypot(fixed[:, 0], fixed[:, 1])
    same = Cap(normal, np.arctan2(sine, fixed[:, 2]), "cut")
    azimuth = np.arctan2(fixed[:, 1], fixed[:, 0])
    return Polar(np.tile(normal, (n, 1)), azimuth, 1.0), (same,)


def _along(fixed: np.ndarray, peak: AxisPeak) -> Polar:
    across, up = float(peak.c_xy), float(peak.c_z)
    axis = fixed * np.array([across, across, up])
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    # A lobe without an axis is one around the normal.
    axis = np.where(length > 1e-12, axis / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])
    width = 0.5 * math.sqrt(2.0 / (float(peak.exponent) + 2.0))
    return Polar(axis, np.arctan2(fixed[:, 1], fixed[:, 0]), width)


def _refracted(fixed: np.ndarray, widths: tuple[float, float, float], n: float) -> Polar:
    """Around the direction that a flat surface refracts to, as wide as facets make it."""
    tangent = -fixed[:, :2] / n
    sine2 = np.sum(tangent * tangent, axis=1)
    tangent = tangent / np.sqrt(np.maximum(sine2, 1.0))[:, None]
    z = np.sqrt(np.maximum(1.0 - np.minimum(sine2, 1.0), 0.0))
    centre = np.column_stack([tangent, z])
    width = 0.5 * math.sqrt(widths[0] * widths[1]) * abs(n - 1.0) / n
    azimuth = np.arctan2(fixed[:, 1], fixed[:, 0])
    return Polar(centre, azimuth, min(max(width, _NARROWEST), 1.0))
