"""Draw the README's spheres: three materials as measured, as fitted, and the difference.

The measurements are synthetic, so that they may be shipped: models with more in them than
what is fitted, on the rings of a goniometer, with its noise and the hole around its source.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from msgspec.structs import replace
from numpy.typing import ArrayLike
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from data_formats import Channel, Measurement
from fitting import fit
from fitting.plots.rendered import Compared, compared
from fitting.plots.style import MAGNITUDE, styled
from fitting.plots.subject import Subject
from fitting.predict import predict
from fitting.scene import load_scene
from fitting.scene.description import Sphere
from fitting.scene.picture import Picture, picture

PICTURE = Path(__file__).with_name("readme_spheres.png")
SCENE = "studio"
WAVELENGTHS_NM = (400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0)
LARGEST_DIFFERENCE = 3.0
PIXELS = 150
RELATIVE_NOISE, ABSOLUTE_NOISE = 0.02, 3e-4
RETRO_HOLE_DEG = 6.0
WIDTH_INCHES, DPI = 7.6, 110
# Of a palette that covers all there are, which makes the file a fifth as large.
COLOURS = 256


class Material(NamedTuple):
    """What is measured, and what is fitted to it."""

    name: str
    truth: str
    parameters: Mapping[str, ArrayLike]
    model: str


MATERIALS = (
    Material(
        "matt clay",
        "eon + ggx",
        {"eon.albedo": (0.10, 0.13, 0.18, 0.28, 0.48, 0.55, 0.58), "eon.roughness": 0.7,
         "ggx.alpha": 0.6, "ggx.f0": 0.015, "ggx.f90": 0.2},
        "eon",
    ),
    Material(
        "gloss paint",
        "lambert + 2*ggx",
        {"lambert.albedo": (0.28, 0.34, 0.30, 0.14, 0.06, 0.05, 0.05),
         "ggx1.alpha": 0.1, "ggx1.f0": 0.03, "ggx1.f90": 0.7,
         "ggx2.alpha": 0.35, "ggx2.f0": 0.012, "ggx2.f90": 0.3},
        "lambert + ggx",
    ),
    # n and k of gold, about those of Johnson and Christy 1972.
    Material(
        "rough gold",
        "ggx(conductor, ms)",
        {"ggx.eta": (1.47, 1.38, 0.97, 0.33, 0.23, 0.15, 0.13),
         "ggx.k": (1.95, 1.91, 1.87, 2.32, 3.10, 3.65, 4.05),
         "ggx.alpha": 0.3, "ggx.scale": 1.0},
        "lambert + ggx",
    ),
)  # fmt: skip


def measured(material: Material, seed: int) -> Measurement:
    """Values of the true model with noise, where a goniometer would measure."""
    angles = directions()
    c = len(WAVELENGTHS_NM)
    values = {
        name: value if name.endswith(("alpha", "roughness")) else np.broadcast_to(value, c)
        for name, value in material.parameters.items()
    }
    truth = predict(material.truth, values, *angles)
    random = np.random.default_rng(seed)
    spread = np.hypot(RELATIVE_NOISE * truth, ABSOLUTE_NOISE)
    return Measurement(
        *angles,
        value=truth + spread * random.standard_normal(truth.shape),
        valid=np.ones(truth.shape, dtype=bool),
        channels=tuple(Channel.at(w) for w in WAVELENGTHS_NM),
        symmetry="bilateral",
    )


def directions() -> tuple[np.ndarray, ...]:
    """Rings of constant theta_r, finer around the mirror direction, rad."""
    rows = []
    azimuths = np.concatenate([np.arange(0.0, 150.0, 15.0), np.arange(150.0, 181.0, 5.0)])
    for theta_i in np.arange(5.0, 81.0, 7.5):
        near = theta_i + np.arange(-10.0, 11.0, 2.5)
        rings = np.unique(np.concatenate([np.arange(0.0, 81.0, 8.0), near]))
        for theta_r in rings[(rings >= 0) & (rings <= 80)]:
            for phi in azimuths if theta_r > 0 else (0.0,):
                rows.append((theta_i, 0.0, theta_r, phi))
    ti, pi, tr, pr = np.radians(rows).T
    cosine = np.cos(ti) * np.cos(tr) + np.sin(ti) * np.sin(tr) * np.cos(pr - pi)
    seen = cosine < np.cos(np.radians(RETRO_HOLE_DEG))
    return ti[seen], pi[seen], tr[seen], pr[seen]


def compare() -> list[Compared]:
    """Fit every material and light a sphere of it, as measured and as fitted."""
    scene = replace(load_scene(SCENE), seen=Sphere(pixels=PIXELS))
    seen = picture(scene)
    out = []
    for k, material in enumerate(MATERIALS):
        m = measured(material, seed=k)
        result = fit(m, material.model, cross_validate=False)
        out.append(compared(Subject(result, m), scene, material.name, seen))
    return out


def numbers(spheres: list[Compared]) -> str:
    """The mean colour differences, as they stand in the picture."""
    means = ", ".join(f"{one.name} {one.mean:.2f}" for one in spheres)
    return f"mean CIEDE2000 of measured and fitted: {means}"


def draw(path: Path = PICTURE) -> str:
    """Write the picture; what `numbers` says is also in its metadata."""
    spheres = compare()
    norm = Normalize(0.0, LARGEST_DIFFERENCE)
    with styled():
        figure = Figure(figsize=(WIDTH_INCHES, WIDTH_INCHES), layout="constrained")
        grid = figure.subplots(3, len(spheres))
        for column, one, material in zip(grid.T, spheres, MATERIALS, strict=True):
            difference = ScalarMappable(norm, MAGNITUDE).to_rgba(one.difference)[:, :3]
            for axes, rgb in zip(
                column, (one.measured, one.fitted, difference), strict=True
            ):
                axes.imshow(_image(one.picture, rgb), interpolation="nearest")
                axes.set_axis_off()
            column[0].set_title(f"{one.name}, measured", loc="center")
            column[1].set_title(f"fit of {material.model}", loc="center")
            mean = rf"difference, mean $\Delta E_{{00}}$ = {one.mean:.2f}"
            column[2].set_title(mean, loc="center")
        figure.colorbar(
            ScalarMappable(norm, MAGNITUDE), ax=grid[2], extend="max", aspect=30,
            location="bottom", shrink=0.5, label="CIEDE2000",
        )  # fmt: skip
        file = io.BytesIO()
        figure.savefig(file, dpi=DPI)
    said = PngInfo()
    said.add_text("Description", numbers(spheres))
    image = (
        Image.open(file)
        .convert("RGB")
        .quantize(
            COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=8, dither=Image.Dither.NONE
        )
    )
    image.save(path, optimize=True, pnginfo=said)
    return numbers(spheres)


def _image(seen: Picture, rgb: np.ndarray) -> np.ndarray:
    """On the camera's raster, white beside the sphere."""
    rows, columns = seen.shape
    raster = np.ones((rows * columns, 3))
    share = np.asarray(seen.share)[:, None]
    raster[seen.place] = share * rgb + (1 - share)
    return raster.reshape(rows, columns, 3)


if __name__ == "__main__":
    print(draw())
