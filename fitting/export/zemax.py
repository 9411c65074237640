"""Zemax tabular BSDF (`.bsdf`): polar grids around the specular direction, for OpticStudio.

Conventions of the BSDF Data Interchange format: values are the BSDF in 1/sr, without
cosine; `AngleOfIncidence` is that of the specular direction, radial 0, or of straight
transmission; azimuth 0 points from there to the normal; zeros are below the horizon; TIS
is the integral over the projected solid angle. One channel, or X, Y and Z (D65, Y = 1 for
white) where the fit has a colour; there is no field for the wavelength, which is in a
comment. Radial angles are dense around 0, as the narrowest peak asks for. OpticStudio
interpolates between the angles; the values there are those of the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_formats import zemax
from data_formats.specular_grid import above_horizon, around_specular
from fitting.export.channels import Mixing, one_channel, tristimulus
from fitting.export.sampled import measurement_of, narrowest
from fitting.export.surface import Surface, surface_of
from fitting.export.target import ExportError, Product, Request, Say
from fitting.models import Way
from fitting.result import FitResult

NAME = "zemax"
SUFFIXES = (".bsdf",)
OPTIONS = ("representation", "channels", "illuminant", "theta_i")
REPRESENTATIONS = ("brdf", "btdf")

_THETA_I = (0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
_WIDE = (15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 75.0, 90.0, 110.0, 130.0, 150.0, 170.0)
_AZIMUTH, _ROTATION = 15.0, 30.0
_WAYS: dict[str, Way] = {"brdf": "front", "btdf": "down"}


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a table. Raises `ExportError`."""
    mixing = _channels(result, request)
    surface = surface_of(result, mixing)
    kind = request.representation or ("brdf" if "front" in surface.model.ways else "btdf")
    way = _WAYS[kind]
    if way not in surface.model.ways:
        raise ExportError(
            f"--as {kind}: {surface.model.expression} has no such light from the front"
        )
    angles = _grid(surface, request.theta_i or _THETA_I, through=way == "down")
    others = [w for w in surface.model.ways if w != way]
    remarks = (
        [f"a file holds one way of light, this one a {kind.upper()}: not written are the "
         f"model's other ways ({', '.join(others)})"] if others else []
    )  # fmt: skip

    def write(target: Path, comment: Sequence[str]) -> None:
        zemax.write(measurement_of(surface, angles), target)
        head = "".join(f"# {line}\n" for line in comment)
        target.write_text(head + target.read_text(encoding="utf-8"), encoding="utf-8")

    return Product(
        surface=surface,
        representation=None,
        ways=(way,),
        conventions=(
            f"{angles.shape[1]} values of the fit; BSDF in 1/sr without cosine, degrees",
            mixing.sentence,
        ),
        remarks=tuple(remarks),
        write=write,
    )


def _channels(result: FitResult, request: Request) -> Mixing:
    channels = result.channels
    if len(request.channels) == 1 or len(channels) == 1:
        return one_channel(channels, (*request.channels, channels[0].name)[0])
    found = None if request.channels else tristimulus(channels, request.illuminant)
    if found is None:
        listed = ", ".join(c.name for c in channels[:8])
        raise ExportError(
            f"Zemax holds one channel, or X Y Z; name one of {listed} with --channels"
        )
    return found


def _grid(surface: Surface, theta_i: Sequence[float], *, through: bool) -> np.ndarray:
    """Angles ``(4, n)`` in radians of a grid around the specular direction."""
    width = min(narrowest(surface) or 10.0, 10.0)
    near = width * np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0])
    radial = np.unique([*np.round(near[near < _WIDE[0]], 4), *_WIDE])
    aniso = surface.model.anisotropic
    turn = np.arange(0.0, 360.0 if aniso else 180.1, _AZIMUTH)
    rotations = np.arange(0.0, 360.0, _ROTATION) if aniso else np.zeros(1)
    grid = np.meshgrid(rotations, theta_i, turn, radial, indexing="ij")
    phi_i, theta, azimuth, off = (np.radians(a.ravel()) for a in grid)
    theta_r, phi_r = around_specular(theta, off, azimuth)
    # The pole is one direction for all azimuths.
    once = above_horizon(theta_r) & ((off > 0) | (azimuth == 0))
    theta_r = np.pi - theta_r if through else theta_r
    return np.stack([theta, phi_i, theta_r, phi_r + phi_i])[:, once]
