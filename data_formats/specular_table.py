"""Rows of a measurement as a table around the specular direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.angle_grid import rounded_degrees
from data_formats.measurement import Measurement, MeasurementError
from data_formats.specular_grid import (
    above_horizon,
    around_specular,
    from_specular,
    zeros_at_the_edge,
)

# More cells per row than this are no grid that was measured.
_MOST_CELLS = 20


@dataclass(frozen=True)
class SpecularTable:
    """A table of values, zero where nothing was measured.

    **Arguments:**

    - `rotation`, `incidence`, `azimuth`, `radial`: ascending angles in degrees: `phi_i`
        (0 if not anisotropic), `theta_i`, and the direction as for `around_specular`.
    - `value`: (rotation, incidence, azimuth, radial, channel).
    - `integral`: (rotation, incidence, channel) over the projected solid angle; azimuths
        up to 180 degrees count twice.
    """

    rotation: NDArray[np.float64]
    incidence: NDArray[np.float64]
    azimuth: NDArray[np.float64]
    radial: NDArray[np.float64]
    value: NDArray[np.float64]
    integral: NDArray[np.float64]


def around_the_mirror(measurement: Measurement, format_name: str) -> SpecularTable:
    """The values of reflected light alone, or of transmitted light alone.

    **Arguments:**

    - `measurement`: lit from the front.
    - `format_name`: named in errors.

    **Raises:** `MeasurementError` if the directions are no grid around the specular or the
    straight direction, or zeros cannot say where nothing was measured.
    """
    m = measurement
    theta = np.where(m.transmitted, np.pi - m.theta_r, m.theta_r)
    radial, azimuth = from_specular(m.theta_i, theta, m.phi_r - m.phi_i)
    rotation = m.phi_i if m.symmetry == "anisotropic" else np.zeros(m.n_rows)
    columns: list[NDArray[np.float64]] = [rotation, m.theta_i, azimuth, radial]
    degrees = [rounded_degrees(a) for a in columns]
    pole = degrees[3] == 0
    degrees[2] = np.where(pole, 0.0, degrees[2])
    axes: list[NDArray[np.float64]] = [np.unique(a) for a in degrees]
    if not pole.all():
        axes[2] = np.unique(degrees[2][~pole])
    shape = tuple(map(len, axes))
    if int(np.prod(shape, dtype=object)) > _MOST_CELLS * m.n_rows:
        sizes = " x ".join(map(str, shape))
        raise MeasurementError(
            f"{format_name} holds grids around the specular direction; the {m.n_rows} rows "
            f"are at {sizes} angles (phi_i, theta_i, azimuth, radial); write csv"
        )
    places = [np.searchsorted(axis, a) for axis, a in zip(axes, degrees, strict=True)]
    places[2] = np.where(pole, 0, places[2])
    index = tuple(places)
    value = np.zeros((*shape, m.n_channels))
    seen = np.zeros(value.shape, dtype=bool)
    value[index], seen[index] = np.where(m.valid, m.value, 0.0), m.valid
    if not np.array_equal(value[index], np.where(m.valid, m.value, 0.0)):
        raise MeasurementError(
            f"{format_name} holds one value per pair of directions; some rows repeat the "
            "directions of others with other values; write csv"
        )
    if axes[3][0] == 0:
        value[:, :, :, 0], seen[:, :, :, 0] = value[:, :, :1, 0], seen[:, :, :1, 0]
    _, t, a, r = np.meshgrid(*(np.deg2rad(axis) for axis in axes), indexing="ij")
    theta, _ = around_specular(t, r, a)
    empty = np.moveaxis(zeros_at_the_edge(np.moveaxis(value, -1, 0)), 0, -1)
    above = above_horizon(theta)[..., None]
    if wrong := int(np.count_nonzero(above & (empty == seen))):
        raise MeasurementError(
            f"{format_name} says by zeros at the edge of its grid where nothing was "
            f"measured; that is wrong for {wrong} values (missing inside, or measured as "
            "zero at the edge); write csv"
        )
    weight = np.maximum(np.cos(theta), 0) * np.sin(r)
    rings = np.asarray(
        np.trapezoid(value * weight[..., None], np.deg2rad(axes[3]), axis=3),
        dtype=np.float64,
    )
    circle, whole = np.deg2rad(axes[2]), 2.0
    if axes[2][-1] > 180:
        circle, whole = np.append(circle, circle[0] + 2 * np.pi), 1.0
        rings = np.concatenate([rings, rings[:, :, :1]], axis=2)
        if axes[2][0] == 0:
            # The circle is closed, for programs that interpolate.
            axes[2] = np.append(axes[2], 360.0)
            value = np.concatenate([value, value[:, :, :1]], axis=2)
    integral = np.asarray(np.trapezoid(rings, circle, axis=2), dtype=np.float64)
    return SpecularTable(axes[0], axes[1], axes[2], axes[3], value, whole * integral)
