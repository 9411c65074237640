"""How far an image of a fit is from one of the data."""

from __future__ import annotations

import msgspec

from data_formats import Measurement, MeasurementError
from fitting.model import Model
from fitting.result import FitResult
from fitting.scene import Scene
from fitting.scene.stage import Stage, set_stage
from fitting.tradeoff.trade import NotPossible


class RenderedError(msgspec.Struct, frozen=True):
    """Difference between the images of a fit and of the interpolated data in a scene.

    ``measure`` is the scene's own, usually CIE Delta E 2000; ``mean`` and
    ``percentile_95`` are over the image, without what the noise of the data adds, and
    ``noise`` is the mean between two measurements of the same surface.
    """

    scene: str
    measure: str
    mean: float
    percentile_95: float
    noise: float


def stage_of(measurement: Measurement, scene: Scene) -> Stage:
    """The measurement in the scene, which takes some seconds, once for all fits.

    Raises `SceneError` for a senseless scene and `NotPossible` where it sees no data.
    """
    try:
        return set_stage(measurement, scene)
    except MeasurementError as error:
        raise NotPossible(str(error)) from error


def rendered_error(stage: Stage, result: FitResult) -> RenderedError:
    """The error of a fit in the scene. See `fitting.scene.image_error`."""
    found = stage.error(Model(result.model), result.values)
    return RenderedError(
        scene=stage.scene.name,
        measure=found.measure,
        mean=found.mean,
        percentile_95=found.percentile_95,
        noise=found.noise,
    )
