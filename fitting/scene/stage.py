"""A measured material in a scene: the picture of the data, and how far models are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from data_formats import Measurement, MeasurementError
from fitting.model import Model
from fitting.rows import Rows, select_rows
from fitting.scene.description import Scene
from fitting.scene.difference import ALBEDO, Measure, measure
from fitting.scene.emitters import Emitter
from fitting.scene.importance import importance
from fitting.scene.nodes import Nodes, nodes
from fitting.scene.photometry import Photometry, photometry
from fitting.scene.picture import Picture, of_directions, picture
from fitting.scene.reference import Reference, interpolate
from fitting.scene.render import Image, render, render_values

MAX_THETA_DEG = 89.0
_FIRST, _MOST_PER_PIXEL, _MOST_NODES = 16, 1024, 1_500_000
_ACCURATE, _GREY = 0.01, 0.2
_ALBEDO_NODES = 4096
_INCIDENCES = np.linspace(0.05, 0.95, 7)
# Pixels of which more than this share of the light is extrapolated are not judged.
_HALF = 0.5
# Of the noise's variance, what is taken off a difference's square.
_NOISE_SHARE = 0.5

Progress = Callable[[str], None]


class ImageError(msgspec.Struct, frozen=True):
    """How far a model is from the data in a scene, in the measure of its tolerance.

    ``mean`` and ``percentile_95`` over the picture (both the largest one, of an albedo),
    with half of what the data's noise adds taken off in quadrature, and what is not known
    between the samples added: ``noise`` is the mean that another measurement of the same
    surface would show, ``interpolation`` that another interpolation of the same data does.
    A fit follows some of the noise, and differences shall be overrated rather than
    underrated. ``raw_mean`` and ``raw_percentile_95`` are as they come.
    ``quadrature_error`` is the standard error of ``raw_mean`` that follows from the nodes.
    Colour differences are CIEDE2000.
    """

    measure: str
    mean: float
    percentile_95: float
    raw_mean: float
    raw_percentile_95: float
    noise: float
    quadrature_error: float
    interpolation: float = 0.0


@dataclass(frozen=True)
class Stage:
    """A scene with the measurement of a material in it; make one with `set_stage`.

    ``lights`` are the nodes of every light in the ``picture``. What is judged is the same
    picture, or of an albedo that under an even sky: ``judged`` are its nodes, with weight
    only where the data support the value, ``weight (p,)`` of its pixels that are lit and
    known for the most part, ``of_data`` what the data give there, ``again`` the same with
    new noise, and ``otherwise`` the same by another interpolation. ``importance (rows,)``
    is how much each row matters to the picture. ``extrapolated (p,)`` is the share of the
    light of the picture's pixels that rests on directions without data near them.
    """

    scene: Scene
    measurement: Measurement
    rows: Rows
    photometry: Photometry
    measure: Measure
    picture: Picture
    reference: Reference
    lights: tuple[Nodes, ...]
    whole_of_data: Image
    extrapolated: np.ndarray
    judged: tuple[Nodes, ...]
    weight: np.ndarray
    of_data: Image
    again: Image
    otherwise: Image
    importance: np.ndarray

    @property
    def extrapolated_share(self) -> float:
        """Share of the picture's light that rests on directions without data near them."""
        light = self.whole_of_data.radiance @ self.photometry.tristimulus[:, 1]
        lit = self.picture.weight * np.maximum(light, 0.0)
        return float(np.sum(lit * self.extrapolated) / max(lit.sum(), 1e-300))

    def image(
        self, model: Model, values: Mapping[str, ArrayLike], *, precision: str = "f64"
    ) -> Image:
        """The whole picture of a model."""
        return render(model, values, self.lights, precision=precision)

    def error(
        self, model: Model, values: Mapping[str, ArrayLike], *, precision: str = "f64"
    ) -> ImageError:
        """How far a model is from the data, in the measure of the scene's tolerance."""
        return self.error_of(render(model, values, self.judged, precision=precision))

    def error_of(self, image: Image) -> ImageError:
        """How far a picture of what is judged is from that of the data."""
        raw = self.statistics(image.radiance, self.of_data.radiance)
        noise = self.statistics(self.again.radiance, self.of_data.radiance)
        between = self.statistics(self.otherwise.radiance, self.of_data.radiance)
        first = self.statistics(image.first, self.of_data.first)
        second = self.statistics(image.second, self.of_data.second)
        told = zip(raw, noise, between, strict=True)
        clean = [
            math.sqrt(max(a * a - _NOISE_SHARE * b * b, 0.0) + d * d) for a, b, d in told
        ]
        return ImageError(
            measure=self.measure.name, mean=clean[0], percentile_95=clean[1],
            raw_mean=raw[0], raw_percentile_95=raw[1], noise=noise[0],
            quadrature_error=0.5 * abs(first[0] - second[0]), interpolation=between[0],
        )  # fmt: skip

    def within(self, error: ImageError) -> bool:
        """Whether an error is within the scene's tolerance."""
        found = (error.mean, error.percentile_95)
        return all(e <= limit for e, limit in zip(found, self.measure.limits, strict=False))

    def statistics(self, image: np.ndarray, data: np.ndarray) -> tuple[float, float]:
        """Mean and 95th percentile of the difference of two pictures of what is judged."""
        return self.measure.statistics(self.measure.between(image, data), self.weight)


def set_stage(
    measurement: Measurement,
    scene: Scene,
    *,
    progress: Progress | None = None,
    reference: Reference | None = None,
    per_pixel: int | None = None,
) -> Stage:
    """Interpolate a measurement, light it, and look at it.

    Of light reflected at the front. ``reference`` is that of another scene with the same
    measurement, to save time. Without ``per_pixel`` nodes are added until differences are
    known to 1 % of the tolerance, or there are 1.5 million. Raises `SceneError`, and
    `MeasurementError` if there are no rows of reflected light.
    """
    say = progress or (lambda _: None)
    light = photometry(scene, measurement.channels)
    seen = picture(scene)
    rows = select_rows(measurement, MAX_THETA_DEG)
    if reference is None:
        say("interpolating the data")
        reference = interpolate(rows, isotropic=measurement.symmetry != "anisotropic")
    say("lighting the sample")
    how = measure(scene, light)
    lights, whole = _converged(seen, light, reference, how, per_pixel)
    known = tuple(_where_known(n, reference) for n in lights)
    judged, weight, of_all = known, seen.weight, whole
    within = render_values(reference.value, known)
    extrapolated = _missing(within, whole, light)
    if how.name == ALBEDO:
        judged, weight, of_all = _under_an_even_sky(lights, reference, light)
        within = render_values(reference.value, judged)
    weight = np.where(_missing(within, of_all, light) <= _HALF, weight, 0.0)
    lit = np.sum(np.abs(within.radiance), axis=1) > 0
    weight = np.where(lit, weight, 0.0)
    if not weight.any():
        raise MeasurementError(
            f"{measurement.provenance.path or 'measurement'}: the scene "
            f"{scene.name or 'given'} looks where there are no data; see `brdf info`"
        )
    return Stage(
        scene=scene, measurement=measurement, rows=rows, photometry=light, measure=how,
        picture=seen, reference=reference, lights=lights, whole_of_data=whole,
        extrapolated=extrapolated, judged=judged, weight=weight / weight.sum(),
        of_data=within,
        again=render_values(lambda g: reference.value(g, noisy=True), judged),
        otherwise=render_values(reference.otherwise, judged),
        importance=importance(
            rows.index.size, known, seen, whole, reference, light.tristimulus[:, 1]
        ),
    )  # fmt: skip


def _converged(
    seen: Picture,
    light: Photometry,
    reference: Reference,
    how: Measure,
    per_pixel: int | None,
) -> tuple[tuple[Nodes, ...], Image]:
    """Nodes of every light, enough to judge by, and the picture of the data.

    Enough: the mean difference from a matt grey surface is known to 1 % of the tolerance.
    """
    count = per_pixel or _FIRST
    grey = np.full((1, light.white.size), _GREY / math.pi)
    while True:
        lights = tuple(nodes(seen, e, count) for e in light.emitters)
        image = render_values(reference.value, lights)
        many = 2 * sum(n.count for n in lights) > _MOST_NODES
        if per_pixel or many or count >= _MOST_PER_PIXEL:
            return lights, image
        matt = render_values(
            lambda g: np.broadcast_to(grey, (g.cos_i.size, grey.size)), lights
        )
        first, second = (
            how.statistics(how.between(getattr(matt, h), getattr(image, h)), seen.weight)[0]
            for h in ("first", "second")
        )
        if 0.5 * abs(first - second) <= _ACCURATE * how.limits[0]:
            return lights, image
        count *= 2


def _where_known(n: Nodes, reference: Reference) -> Nodes:
    """The same nodes, of which those far from all data weigh nothing."""
    return replace(n, weight=n.weight * reference.supported(n.geometry))


def _missing(within: Image, whole: Image, light: Photometry) -> np.ndarray:
    """Share ``(p,)`` of the light that is not within what is known."""
    luminous = light.tristimulus[:, 1]
    all_of_it = np.abs(whole.radiance) @ luminous
    known = np.abs(within.radiance) @ luminous
    return np.where(all_of_it > 0, 1.0 - known / np.maximum(all_of_it, 1e-300), 0.0)


def _under_an_even_sky(
    lights: tuple[Nodes, ...], reference: Reference, light: Photometry
) -> tuple[tuple[Nodes, ...], np.ndarray, Image]:
    """Nodes whose radiance is the albedo at the scene's incidences: reciprocity."""
    theta, weight = incidences(lights)
    quantile = np.interp(_INCIDENCES, np.cumsum(weight) / weight.sum(), theta)
    azimuth = np.zeros(1) if reference.chart.isotropic else np.radians([0, 45, 90, 135])
    angle, turn = (a.ravel() for a in np.meshgrid(quantile, azimuth, indexing="ij"))
    views = of_directions(angle, turn, np.full(angle.size, 1.0 / angle.size))
    up = np.array([0.0, 0.0, 1.0])
    even = np.ones((1, light.white.size))
    sky = Emitter("even sky", up, 0.5 * math.pi, lambda x, y, z: np.ones((1, x.size)),
                  even, 0.1)  # fmt: skip
    whole = (nodes(views, sky, _ALBEDO_NODES),)
    known = tuple(_where_known(n, reference) for n in whole)
    return known, views.weight, render_values(reference.value, whole)


def incidences(lights: Sequence[Nodes]) -> tuple[np.ndarray, np.ndarray]:
    """Angles of incidence ``(n,)`` that occur, ascending, and the light by each."""
    theta = np.concatenate([np.arccos(np.clip(n.geometry.cos_i, 0, 1)) for n in lights])
    power = np.concatenate(
        [n.weight.T @ np.abs(n.emitter.spectrum).sum(axis=1) for n in lights]
    )
    order = np.argsort(theta)
    return theta[order], power[order]
