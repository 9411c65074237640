"""Pictures of the measured and the fitted material, side by side with their difference.

By the renderer of `fitting.scene`: direct light, and the measurement interpolated without
any model. Colours are those of a display whose white is a perfect diffuser's.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from data_formats import Measurement, MeasurementError
from fitting.colorimetry import colour_science
from fitting.plots import NoFigure
from fitting.plots.canvas import finish, new_figure
from fitting.plots.style import GREY, MAGNITUDE
from fitting.plots.subject import Subject
from fitting.rows import select_rows
from fitting.scene.description import Scene, SceneError
from fitting.scene.difference import measure, to_display
from fitting.scene.nodes import Nodes, nodes
from fitting.scene.photometry import Photometry, photometry
from fitting.scene.picture import Picture
from fitting.scene.reference import Reference, interpolate
from fitting.scene.render import render, render_values

# Presets, and what to call them here.
SCENES = {"sun": "sun and clear sky", "overcast": "overcast sky"}
_PER_PIXEL = 32
# Pixels of which more than this share of the light is extrapolated say little.
_HALF = 0.5
_LARGEST_THETA_DEG = 89.0
_LEAST_RANGE = 1.0

_references: weakref.WeakKeyDictionary[Measurement, Reference] = weakref.WeakKeyDictionary()


@dataclass(frozen=True)
class Compared:
    """One scene: encoded sRGB ``(p, 3)`` of data and fit, CIEDE2000 ``(p,)`` between them.

    ``known (p,)``: more than half of the light is from directions with data near them.
    ``weight (p,)`` is that of a pixel in a mean over those that are known and lit.
    ``coloured``: whether the channels make a colour, and not luminance only.
    """

    name: str
    picture: Picture
    measured: np.ndarray
    fitted: np.ndarray
    difference: np.ndarray
    known: np.ndarray
    weight: np.ndarray
    coloured: bool

    @property
    def mean(self) -> float:
        return float(self.weight @ self.difference)


def compared(subject: Subject, scene: Scene, name: str, picture: Picture) -> Compared:
    """Light the measured and the fitted material alike.

    Raises `NoFigure` without rows of light reflected at the front, or without light in the
    channels of the data.
    """
    data = subject.data
    if "front" not in subject.ways:
        raise NoFigure("no light that is reflected at the front was measured and fitted")
    try:
        reference = _reference(data)
        light = photometry(scene, data.channels)
    except (MeasurementError, SceneError) as error:
        raise NoFigure(str(error)) from error
    lights = tuple(nodes(picture, e, _PER_PIXEL) for e in light.emitters)
    with np.errstate(over="ignore", invalid="ignore"):
        whole = render_values(reference.value, lights).radiance
        known_only = [_where_known(n, reference) for n in lights]
        within = render_values(reference.value, known_only)
    if not np.isfinite(whole).all():
        raise NoFigure(
            "the data are too uneven to be interpolated (such as zeros beside a mirror "
            "image one row wide)"
        )
    fit = render(subject.model, subject.result.values, lights).radiance
    known = _share(within.radiance, whole, light) > _HALF
    lit = whole @ light.tristimulus[:, 1] > 0
    weight = np.where(known & lit, picture.weight, 0.0)
    if not weight.any():
        raise NoFigure(f"the scene {scene.name!r} looks where there are no data")
    return Compared(
        name=name,
        picture=picture,
        measured=_encoded(whole, light, clip=scene.viewer.clip),
        fitted=_encoded(fit, light, clip=scene.viewer.clip),
        difference=measure(scene, light).between(fit, whole)[:, 0],
        known=known,
        weight=weight / weight.sum(),
        coloured=bool(np.linalg.matrix_rank(light.tristimulus) > 1),
    )


def draw_compared(
    subject: Subject,
    heading: str,
    scenes: Sequence[Compared],
    show: Callable[[Axes, Picture, np.ndarray], None],
    notes: Sequence[str],
) -> Figure:
    """A row per scene: measured, fit, difference. ``show`` draws pixels ``(p, 4)``."""
    out = new_figure(subject, heading, (9.6, 1.2 + 3.1 * len(scenes)))
    grid = out.subplots(len(scenes), 3, squeeze=False)
    for row, one in zip(grid, scenes, strict=True):
        top = max(float(np.percentile(one.difference[one.weight > 0], 98)), _LEAST_RANGE)
        norm = Normalize(0.0, top)
        difference = ScalarMappable(norm, MAGNITUDE).to_rgba(one.difference)
        for axes, pixels in zip(
            row, (_opaque(one.measured), _opaque(one.fitted), difference), strict=True
        ):
            pixels[:, 3] = one.picture.share
            show(axes, one.picture, pixels)
            axes.set_xticks([])
            axes.set_yticks([])
            axes.grid(False)
            axes.spines[:].set_visible(False)
        _extrapolated(row[0], one, show)
        _extrapolated(row[2], one, show)
        row[0].set_ylabel(one.name)
        row[0].set_title("measured")
        row[1].set_title("fit")
        row[2].set_title(rf"difference, mean $\Delta E_{{00}}$ = {one.mean:.2g}")
        out.colorbar(
            ScalarMappable(norm, MAGNITUDE), ax=row[2], extend="max", shrink=0.8,
            label="CIEDE2000",
        )  # fmt: skip
    means = " and ".join(f"{one.mean:.2g} in {one.name}" for one in scenes)
    out.set_label(f"Mean colour difference of data and fit (CIEDE2000): {means}")
    said = list(notes)
    if not all(one.known.all() for one in scenes):
        said.append(
            "hatched: more than half of the light comes from directions without data near "
            "them, and does not count in the mean"
        )
    if not any(one.coloured for one in scenes):
        said.append("these channels make no colour: luminance is shown")
    return finish(out, subject, said)


def _reference(data: Measurement) -> Reference:
    """The interpolation of a measurement, kept as long as that is."""
    if data not in _references:
        rows = select_rows(data, _LARGEST_THETA_DEG)
        # What is not finite is looked for in the picture.
        with np.errstate(over="ignore", invalid="ignore"):
            _references[data] = interpolate(rows, isotropic=data.symmetry != "anisotropic")
    return _references[data]


def _where_known(n: Nodes, reference: Reference) -> Nodes:
    return replace(n, weight=n.weight * reference.supported(n.geometry))


def _share(part: np.ndarray, whole: np.ndarray, light: Photometry) -> np.ndarray:
    """Share ``(p,)`` of the luminance."""
    luminous = light.tristimulus[:, 1]
    every = np.abs(whole) @ luminous
    return np.where(every > 0, np.abs(part) @ luminous / np.maximum(every, 1e-300), 1.0)


def _encoded(radiance: np.ndarray, light: Photometry, *, clip: bool) -> np.ndarray:
    """sRGB in [0, 1]; what is brighter than the display's white is white."""
    linear = to_display(radiance @ light.tristimulus, light.display_white)
    if not clip:
        linear = linear / max(float(np.percentile(linear, 99.5)), 1e-300)
    linear = np.clip(linear, 0.0, 1.0)
    return np.clip(colour_science().cctf_encoding(linear, function="sRGB"), 0.0, 1.0)


def _opaque(rgb: np.ndarray) -> np.ndarray:
    return np.column_stack([rgb, np.ones(len(rgb))])


def _extrapolated(
    axes: Axes, one: Compared, show: Callable[[Axes, Picture, np.ndarray], None]
) -> None:
    """Stripes over pixels that rest on extrapolation."""
    place = one.picture.place
    stripes = (place // one.picture.shape[1] + place % one.picture.shape[1]) % 6 < 2
    veil = np.zeros((one.picture.size, 4))
    veil[~one.known & stripes] = (*(int(GREY[k : k + 2], 16) / 255 for k in (1, 3, 5)), 0.8)
    show(axes, one.picture, veil)
