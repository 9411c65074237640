"""Environment maps: pictures of all directions, in latitude and longitude."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.scene.description import SceneError

_WANTED = "expected an environment map, Radiance HDR or OpenEXR, twice as wide as high"


class Environment(NamedTuple):
    """``radiance (k, h, w)`` at pixel centres; k is 3 (linear sRGB) or 1.

    Row 0 is the zenith's, column 0 begins half a turn left of the centre.
    """

    radiance: np.ndarray

    @property
    def pixel(self) -> float:
        """Height of a pixel, rad."""
        return math.pi / self.radiance.shape[1]


def load_environment(path: str | os.PathLike, smallest_detail: float) -> Environment:
    """The map in a file, its pixels averaged up to about ``smallest_detail``, rad.

    Raises `SceneError` if the library is missing or the file is no map, or if a pixel is
    negative or not finite.
    """
    target = Path(path)
    try:
        changed = target.stat().st_mtime_ns
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror or error}; {_WANTED}") from error
    return _load(str(target), changed, smallest_detail)


def averaged(radiance: np.ndarray, factor: int) -> np.ndarray:
    """Blocks of ``factor`` by ``factor`` pixels of ``(k, h, w)`` as one, by solid angle."""
    k, height, width = radiance.shape
    solid = _row_solid_angles(height)
    rows = (radiance * solid[:, None]).reshape(k, height // factor, factor, width).sum(2)
    rows = rows / solid.reshape(-1, factor).sum(axis=1)[:, None]
    return rows.reshape(k, height // factor, width // factor, factor).mean(axis=3)


def interpolator(
    environment: Environment, phi: float = 0.0
) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Radiance ``(k, n)`` towards unit vectors x, y, z; the map's centre is at azimuth phi.

    Bilinear in latitude and longitude between pixel centres, around the turn; from the
    first and last row to the pole it goes over to the row's mean, so that it is continuous
    there. All is scaled, by about ``1 + pixel^2 / 24`` for details of a pixel, so that the
    integral over the sphere is the sum of pixels times their solid angles.
    """
    _, height, width = environment.radiance.shape
    rows = environment.radiance.sum(axis=2)
    scale = (rows @ _row_solid_angles(height)) / np.maximum(
        rows @ _row_weights(height), np.finfo(float).tiny
    )
    scaled = environment.radiance * scale[:, None, None]
    poles = scaled[:, [0, -1]].mean(axis=2, keepdims=True)
    # A row beyond each pole, at half a pixel from it, and the first column once more.
    table = np.concatenate(
        [
            np.repeat(poles[:, :1], width, axis=2),
            scaled,
            np.repeat(poles[:, 1:], width, axis=2),
        ],
        axis=1,
    )
    table = np.concatenate([table, table[:, :, :1]], axis=2)
    centres = (np.arange(height) + 0.5) * math.pi / height
    latitudes = np.concatenate([[0.0], centres, [math.pi]])

    def of(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        theta = np.arctan2(np.hypot(x, y), z)
        row = np.clip(np.floor(theta * height / math.pi + 0.5).astype(int), 0, height)
        v = (theta - latitudes[row]) / (latitudes[row + 1] - latitudes[row])
        # Azimuths grow to the left (OpenEXR: longitude pi at the left edge).
        column = (0.5 - (np.arctan2(y, x) - phi) / (2 * math.pi)) * width - 0.5
        left = np.floor(column)
        u = column - left
        left = np.mod(left, width).astype(int)
        upper = (1 - u) * table[:, row, left] + u * table[:, row, left + 1]
        lower = (1 - u) * table[:, row + 1, left] + u * table[:, row + 1, left + 1]
        return (1 - v) * upper + v * lower

    return of


def _row_solid_angles(height: int) -> np.ndarray:
    """Solid angle ``(h,)`` of all of a row's pixels, over 2 pi."""
    return -np.diff(np.cos(np.arange(height + 1) * math.pi / height))


def _row_weights(height: int) -> np.ndarray:
    """Integral ``(h,)`` of sin theta times each row's hat function, 1 up to the poles."""
    h = math.pi / height
    centres = (np.arange(height) + 0.5) * h
    # A hat of half width h: sin(centre) (2 - 2 cos h) / h.
    weights = np.sin(centres) * (2.0 - 2.0 * math.cos(h)) / h
    if height == 1:
        return np.array([2.0])
    # int_0^{h/2} sin + int_0^h (1 - t / h) sin(h / 2 + t) dt
    edge = 1.0 - math.cos(0.5 * h)
    edge += math.cos(0.5 * h) - (math.sin(1.5 * h) - math.sin(0.5 * h)) / h
    weights[[0, -1]] = edge
    return weights


@lru_cache(maxsize=4)
def _load(path: str, changed: int, smallest_detail: float) -> Environment:
    radiance = _pixels(path)
    height, width = radiance.shape[1:]
    if width != 2 * height or height < 2:
        raise SceneError(f"{path}: {width} x {height} pixels; {_WANTED}")
    for wrong, said in (
        (~np.isfinite(radiance), "not finite"),
        (radiance < 0, "negative"),
    ):
        if wrong.any():
            raise SceneError(f"{path}: {int(wrong.sum())} values are {said}; {_WANTED}")
    if not radiance.any():
        raise SceneError(f"{path}: all of it is black; expected some light")
    # The largest divisor of the height that keeps the detail.
    most = math.floor(smallest_detail * height / math.pi + 1e-9)
    factor = max(f for f in range(1, max(most, 1) + 1) if height % f == 0)
    radiance = averaged(radiance, factor)
    radiance.setflags(write=False)
    return Environment(radiance)


def _pixels(path: str) -> np.ndarray:
    """``(k, h, w)`` in float64: R, G and B, or the only or first channel's luminance."""
    library = _library()
    with Path(path).open("rb") as file:
        if b"32-bit_rle_xyze" in file.read(1000):
            raise SceneError(
                f"{path}: its pixels are XYZE; expected RGBE (Radiance's ra_xyze)"
            )
    picture = library.ImageInput.open(path)
    if picture is None:
        raise SceneError(f"{path}: {_plain(library.geterror())}; {_WANTED}")
    spec = picture.spec()
    values = picture.read_image(library.FLOAT)
    said = picture.geterror()
    picture.close()
    if values is None:
        raise SceneError(f"{path}: {_plain(said)}; {_WANTED}")
    if (spec.x, spec.y, spec.width, spec.height) != (
        spec.full_x, spec.full_y, spec.full_width, spec.full_height,
    ):  # fmt: skip
        raise SceneError(f"{path}: its data window is a part of the picture; {_WANTED}")
    names = [name.rpartition(".")[2].upper() for name in spec.channelnames]
    if {"R", "G", "B"} <= set(names):
        chosen = [names.index(c) for c in "RGB"]
    elif "Y" in names or len(names) == 1:
        chosen = [names.index("Y") if "Y" in names else 0]
    else:
        listed = ", ".join(spec.channelnames)
        raise SceneError(f"{path}: its channels are {listed}; expected R, G, B or Y")
    values = np.asarray(values, dtype=np.float64).reshape(spec.height, spec.width, -1)
    return np.moveaxis(values[:, :, chosen], 2, 0)


def _plain(said: str) -> str:
    return " ".join(said.split()) or "cannot be read"


def _library() -> Any:
    try:
        import OpenImageIO
    except ImportError as error:
        raise SceneError(
            "environment maps are read by OpenImageIO, which is not installed: "
            "pip install 'brdf-fitting[images]'"
        ) from error
    return OpenImageIO
