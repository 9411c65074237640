"""A sphere in the sun and under an overcast sky, and how the fit differs from the data."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from msgspec.structs import replace

from fitting.plots.rendered import SCENES, compared, draw_compared
from fitting.plots.subject import Subject
from fitting.scene import load_scene
from fitting.scene.description import Sphere
from fitting.scene.picture import Picture, picture

DATA = "needed"

_PIXELS = 80


def figure(subject: Subject) -> Figure:
    """A row per scene; the scenes are presets, see ``brdf scene``."""
    found = []
    for preset, name in SCENES.items():
        scene = replace(load_scene(preset), seen=Sphere(pixels=_PIXELS))
        found.append(compared(subject, scene, name, picture(scene)))
    notes = [f"direct light only, of the scenes {' and '.join(SCENES)} (brdf scene)"]
    return draw_compared(subject, "A sphere of the material", found, _show, notes)


def _show(axes: Axes, seen: Picture, pixels: np.ndarray) -> None:
    """On the camera's raster, transparent beside the sphere."""
    rows, columns = seen.shape
    raster = np.zeros((rows * columns, 4))
    raster[seen.place] = pixels
    image = raster.reshape(rows, columns, 4)
    axes.imshow(image, interpolation="nearest", rasterized=True)
