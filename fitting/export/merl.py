"""MERL binary (`.binary`): RGB on 90 x 90 x 180 half and difference angles, isotropic.

Conventions of MERL tables: the BRDF in 1/sr, without cosine, linear RGB (here of sRGB's
primaries), divided by 1/1500, 1.15/1500 and 1.66/1500; -1 where source or detector is below
the horizon. Each value is that at the centre of its bin, `theta_h = (i + 1/2)^2 / 90`
degrees, `theta_d` and `phi_d` at `i + 1/2` degrees; programs that look it up take it for
the whole bin. The table has reciprocity built in, and knows no azimuth of the sample. The
format has no room for comments: what is said here is printed alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_formats import Measurement, merl
from data_formats.half_difference import directions, half_difference
from fitting.export.channels import linear_srgb
from fitting.export.closest import ways_left_out
from fitting.export.surface import Surface, surface_of
from fitting.export.target import ExportError, Product, Request, Say
from fitting.geometry import Geometry, from_angles
from fitting.result import FitResult

NAME = "merl"
SUFFIXES = (".binary",)
OPTIONS = ("channels", "illuminant")
REPRESENTATIONS = ()

_SHAPE = (90, 90, 180)
_CHUNK = 1 << 17
_CONVENTIONS = (
    "BRDF in 1/sr without cosine at the centres of the bins, times 1500, 1500/1.15 and "
    "1500/1.66 as stored",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a table. Raises `ExportError` for a surface that is not isotropic."""
    mixing = linear_srgb(result.channels, request.channels, request.illuminant)
    surface = surface_of(result, mixing)
    if surface.model.anisotropic:
        raise ExportError(
            f"{surface.model.expression} depends on the azimuth of the sample, which a "
            "MERL table cannot say; export it to hdf5 or radiance"
        )
    if "front" not in surface.model.ways:
        raise ExportError(
            f"{surface.model.expression} reflects nothing from the front, which is all "
            "that a MERL table holds"
        )
    say("evaluating 1.5 million bins")
    angles, value, index = _bins(surface)
    dark = value < 0
    remarks = list(ways_left_out(surface, ("front",), "the table"))
    if dark.any():
        remarks.append(
            f"{int(np.count_nonzero(dark))} values are below 0, colours outside of the "
            "gamut of sRGB, and are written as 0"
        )
    if not surface.model.reciprocal:
        remarks.append(
            "the model is not reciprocal; of each pair the value of the order with phi_d "
            "below 180 degrees is in the table"
        )
    value = np.maximum(value, 0.0)

    def write(target: Path, comment: Sequence[str]) -> None:
        rows = Measurement(
            *angles, value=value, valid=np.ones(value.shape, dtype=bool),
            channels=surface.channels,
        )  # fmt: skip
        merl.write(rows, target)

    table = np.zeros((*_SHAPE, 3))
    table[index] = value
    return Product(
        surface=surface,
        representation=_Table(table),
        ways=("front",),
        conventions=(*_CONVENTIONS, f"colours are linear sRGB: {mixing.sentence}"),
        remarks=tuple(remarks),
        write=write,
    )


class _Table:
    """The value of the bin that a pair of directions is in."""

    words = "a table of 90 x 90 x 180 bins, without interpolation"

    def __init__(self, table: np.ndarray):
        self._table = table

    def __call__(self, geometry: Geometry) -> np.ndarray:
        g = geometry
        angles = (
            np.arctan2(np.hypot(g.wix, g.wiy), g.cos_i), np.arctan2(g.wiy, g.wix),
            np.arctan2(np.hypot(g.wox, g.woy), g.cos_o), np.arctan2(g.woy, g.wox),
        )  # fmt: skip
        theta_h, theta_d, phi_d = (np.degrees(a) for a in half_difference(*angles))
        return self._table[
            np.minimum(np.sqrt(90.0 * theta_h), 89.0).astype(np.int64),
            np.minimum(theta_d, 89.0).astype(np.int64),
            np.minimum(np.remainder(phi_d, 180.0), 179.0).astype(np.int64),
        ]


def _bins(surface: Surface) -> tuple[tuple[np.ndarray, ...], np.ndarray, tuple]:
    """Angles of the bins above the horizon, their values, and their indices."""
    middle = np.arange(90) + 0.5
    angles = directions(
        np.radians(middle**2 / 90)[:, None, None],
        np.radians(middle)[:, None],
        np.radians(np.arange(180) + 0.5),
    )
    above = (angles[0] < np.pi / 2) & (angles[2] < np.pi / 2)
    flat = tuple(np.broadcast_to(a, _SHAPE)[above] for a in angles)
    parts = [
        surface(from_angles(*(a[k : k + _CHUNK] for a in flat)))
        for k in range(0, len(flat[0]), _CHUNK)
    ]
    return flat, np.concatenate(parts), np.nonzero(above)
