"""Where an integral over pixels and lights looks: quasi-random nodes, by several rules.

The radiance of a pixel is the mean over its area of ``int f(wi, wo) L(wi) cos_i dwi``.
Nodes are drawn by rules that suit a wide lobe under a small light, a narrow lobe under a
wide light, and a narrow lobe under a small light (Veach and Guibas 1995: the sum of their
densities is the density, the balance heuristic). Each rule uses a Sobol sequence that is
shifted anew for every pixel; two independent halves tell the error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

from fitting.geometry import Geometry, from_components
from fitting.scene.directions import frame
from fitting.scene.emitters import Emitter
from fitting.scene.picture import Picture, tangents
from fitting.scene.pointing import LightSampler, around, by_cosine, density_around

_HALVES = 2
# A light as wide as this is looked for from the sample, a smaller one from the light.
_WIDE = 0.3
# Share of the nodes that are drawn around the direction back to the viewer.
_RETRO = 0.25


@dataclass(frozen=True)
class Nodes:
    """The nodes of one light: a geometry each, which sum it belongs to, and its weight.

    The radiance of pixel ``p`` in half ``h`` is the sum of ``f * weight[k] * spectrum[k]``
    over the nodes whose ``sum`` is ``h * pixels + p``, and over the patterns ``k``.
    """

    emitter: Emitter
    geometry: Geometry
    sum: np.ndarray
    weight: np.ndarray
    pixels: int

    @property
    def count(self) -> int:
        """Number of nodes."""
        return int(self.sum.size)


def nodes(picture: Picture, emitter: Emitter, per_pixel: int, seed: int = 0) -> Nodes:
    """About ``per_pixel`` nodes per pixel (a power of 2) for one light."""
    rng = np.random.default_rng(seed)
    each = max(per_pixel // _HALVES, 1)
    rule = _half if picture.pairs is None else _of_pairs
    parts = [rule(picture, emitter, each, rng) for _ in range(_HALVES)]
    geometry, sums, weights = [], [], []
    for half in range(_HALVES):
        found = parts[half]
        geometry.append(found[0])
        sums.append(found[1] + half * picture.size)
        weights.append(found[2])
    joined = [
        np.concatenate([getattr(g, n) for g in geometry])
        for n in ("wix", "wiy", "cos_i", "wox", "woy", "cos_o")
    ]
    order = np.concatenate(sums)
    return Nodes(
        emitter, from_components(*joined), order, np.concatenate(weights, axis=1),
        picture.size,
    )  # fmt: skip


def _half(picture: Picture, emitter: Emitter, each: int, rng: np.random.Generator):
    """Nodes of one half: sorted by pixel, each weight the pixel's mean's."""
    sampler = LightSampler.of(emitter)
    small = emitter.half_angle < _WIDE
    sides = picture.high - picture.low
    by_highlight = small and bool(np.all(sides.max(axis=0) > 0))
    by_mirror = emitter.half_angle > 0
    n_light = each if small or sampler.detailed else 0
    n_cosine = 0 if small else each
    n_mirror = each if by_mirror else 0
    n_retro = 0 if small else max(1, int(_RETRO * each))
    pixels: list[np.ndarray] = []
    points: list[np.ndarray] = []
    towards: list[np.ndarray] = []

    def add(count: int, draw) -> None:
        if count:
            pixels.append(np.repeat(np.arange(picture.size), count))
            u = _shifted(4, count, picture.size, rng)
            points.append(picture.points(pixels[-1], u[:, 2:]))
            normal, view, _ = picture.normals_and_views(points[-1])
            towards.append(draw(normal, view, u[:, :2]))

    add(n_light, lambda normal, view, u: sampler.draw(u))
    add(n_cosine, lambda normal, view, u: by_cosine(normal, u))
    add(n_mirror, lambda normal, view, u: around(_mirror(normal, view), u))
    add(n_retro, lambda normal, view, u: around(view, u))
    n_highlight = each * picture.size if by_highlight else 0
    if n_highlight:
        found, light = _highlight_points(picture, sampler, n_highlight, rng)
        pixels.append(picture.pixel_of(found))
        points.append(found)
        towards.append(light)
    pixel, x, wi = (np.concatenate(a) for a in (pixels, points, towards))
    normal, view, there = picture.normals_and_views(x)
    cos_i = np.sum(normal * wi, axis=1)
    cos_o = np.sum(normal * view, axis=1)
    if emitter.half_angle > 0:
        lit = wi @ emitter.axis >= math.cos(emitter.half_angle) - 1e-12
    else:
        lit = np.ones(len(x), dtype=bool)
    kept = np.flatnonzero((pixel >= 0) & there & lit & (cos_i > 0) & (cos_o > 0))
    kept = kept[np.argsort(pixel[kept], kind="stable")]
    x, wi, pixel, normal, view = (a[kept] for a in (x, wi, pixel, normal, view))
    # Densities per area of the picture and, of a light with an extent, per solid angle.
    whole = np.prod(sides, axis=1)
    per_area = 1.0 / np.where(whole > 0, whole, 1.0)[pixel]
    density = n_light * per_area * sampler.density(wi)
    if n_cosine:
        density = density + n_cosine * per_area * cos_i[kept] / np.pi
    if n_mirror:
        density = density + n_mirror * per_area * density_around(_mirror(normal, view), wi)
    if n_retro:
        density = density + n_retro * per_area * density_around(view, wi)
    if n_highlight:
        at = _highlight_density(picture, normal, view, wi)
        density = density + n_highlight * sampler.density(wi) * at
    weight = cos_i[kept] / (density * picture.area[pixel])
    pattern = emitter.pattern(*np.ascontiguousarray(wi.T))
    first, second = tangents(normal)

    def local(w: np.ndarray) -> list[np.ndarray]:
        return [np.sum(w * axis, axis=1) for axis in (first, second, normal)]

    return from_components(*local(wi), *local(view)), pixel, pattern * weight


def _mirror(normal: np.ndarray, view: np.ndarray) -> np.ndarray:
    return 2.0 * np.sum(normal * view, axis=1, keepdims=True) * normal - view


def _highlight_points(
    picture: Picture, sampler: LightSampler, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Points around the highlight of each of the directions of a light."""
    u = _shifted(4, count, 1, rng)
    wi = sampler.draw(u[:, :2])
    if picture.camera is not None:
        half = wi + picture.camera[2]
        length = np.linalg.norm(half, axis=1, keepdims=True)
        normal = around(half / np.maximum(length, 1e-12), u[:, 2:])
        seen = normal @ picture.camera[2] > 0
        x = (normal @ picture.camera.T)[:, :2]
        return np.where(seen[:, None], x, 2.0), wi
    view = around(wi * np.array([-1.0, -1.0, 1.0]), u[:, 2:])
    x = np.stack([view[:, 2], np.arctan2(view[:, 1], view[:, 0])], axis=1)
    return np.where(view[:, 2:] > 0, x, -1.0), wi


def _highlight_density(
    picture: Picture, normal: np.ndarray, view: np.ndarray, wi: np.ndarray
) -> np.ndarray:
    """Density of `_highlight_points` per area of the picture."""
    if picture.camera is not None:
        half = wi + view
        half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-12)
        # Orthographic: dx dy = cos_o dN on the unit sphere.
        cos_o = np.sum(normal * view, axis=1)
        return density_around(half, normal) / np.maximum(cos_o, 1e-9)
    return density_around(wi * np.array([-1.0, -1.0, 1.0]), view)


def _of_pairs(picture: Picture, emitter: Emitter, each: int, rng: np.random.Generator):
    """Pairs of directions as they stand, or a disk of light around each."""
    pairs: Any = picture.pairs
    sin = np.sin(pairs.theta_i)
    axis = np.stack(
        [sin * np.cos(pairs.phi_i), sin * np.sin(pairs.phi_i), np.cos(pairs.theta_i)],
        axis=1,
    )
    _, view, _ = picture.normals_and_views(picture.low)
    each = each if emitter.half_angle > 0 else 1
    sampler = LightSampler.of(emitter)
    pixel = np.repeat(np.arange(picture.size), each)
    # The light of such a scene is declared at the zenith.
    at_zenith = sampler.draw(_shifted(2, each, picture.size, rng))
    turned = np.stack([frame(a) for a in axis])[pixel]
    wi = np.einsum("ni,nij->nj", at_zenith, turned)
    weight = wi[:, 2] / (each * sampler.density(at_zenith))
    weight = emitter.pattern(*np.ascontiguousarray(at_zenith.T)) * weight
    kept = wi[:, 2] > 0
    geometry = from_components(*wi[kept].T, *view[pixel[kept]].T)
    return geometry, pixel[kept], weight[:, kept]


def _shifted(
    dimensions: int, count: int, copies: int, rng: np.random.Generator
) -> np.ndarray:
    """A Sobol sequence and its copies, each shifted at random, ``(copies count, d)``."""
    bits = math.ceil(math.log2(max(count, 1)))
    base = qmc.Sobol(dimensions, scramble=True, rng=rng).random_base2(bits)[:count]
    shift = rng.random((copies, 1, dimensions))
    return np.mod(base + shift, 1.0).reshape(-1, dimensions)
