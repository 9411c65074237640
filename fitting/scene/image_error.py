"""How far fits are from their measurement in the picture of a scene."""

from __future__ import annotations

import os
from collections.abc import Sequence

from data_formats import Measurement
from fitting.model import Model
from fitting.result import FitResult
from fitting.scene.description import Scene
from fitting.scene.load import load_scene
from fitting.scene.stage import ImageError, Progress, set_stage


def image_error(
    measurement: Measurement,
    results: Sequence[FitResult],
    scene: Scene | str | os.PathLike = "studio",
    *,
    progress: Progress | None = None,
) -> list[ImageError]:
    """The error of each result in a scene, a preset's name or a file.

    Raises `SceneError`, and `MeasurementError` without rows of reflected light.
    """
    told = scene if isinstance(scene, Scene) else load_scene(scene)
    stage = set_stage(measurement, told, progress=progress)
    return [stage.error(Model(r.model), r.values) for r in results]
