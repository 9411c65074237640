"""Rows of a measurement as a table over four lists of angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Measurement, MeasurementError

# Of a degree: what conversions between units leave.
_DIGITS = 9


@dataclass(frozen=True)
class AngleGrid:
    """A table of values.

    **Arguments:**

    - `theta_i`, `phi_i`, `theta_r`, `phi_r`: ascending angles in degrees, theta from the
        normal of the side that the light is on. Isotropic data have `phi_i` 0.
    - `value`: (theta_i, phi_i, theta_r, phi_r, channel).
    """

    theta_i: NDArray[np.float64]
    phi_i: NDArray[np.float64]
    theta_r: NDArray[np.float64]
    phi_r: NDArray[np.float64]
    value: NDArray[np.float64]


def rounded_degrees(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """An angle in degrees from 0 to below 360, without what conversions leave."""
    degrees = np.round(np.mod(np.rad2deg(angle), 360), _DIGITS)
    return np.asarray(degrees % 360, dtype=np.float64)


def on_grid(measurement: Measurement, format_name: str) -> AngleGrid:
    """The values of reflected light alone, or of transmitted light alone, on a grid.

    At `theta_r = 0` one value stands for all azimuths.

    **Arguments:**

    - `measurement`: lit from the front; every value is used, valid or not.
    - `format_name`: named in errors.

    **Raises:** `MeasurementError` if the directions are no complete grid, or a value is not
    known.
    """
    m = measurement
    if m.from_back.any():
        raise MeasurementError(
            f"{format_name} holds light from the front; {int(m.from_back.sum())} rows are "
            "lit from the back; write them as csv"
        )
    turned = m.phi_i if m.symmetry != "anisotropic" else np.zeros(m.n_rows)
    theta_r = np.where(m.transmitted, np.pi - m.theta_r, m.theta_r)
    columns = [m.theta_i, m.phi_i - turned, theta_r, m.phi_r - turned]
    degrees = [rounded_degrees(a) for a in columns]
    pole = degrees[2] == 0
    axes = [np.unique(a) for a in degrees]
    if not pole.all():
        axes[3] = np.unique(degrees[3][~pole])
    shape = tuple(map(len, axes))
    n_cells = int(np.prod(shape, dtype=object))
    n_poles = int(np.count_nonzero(pole))
    if n_cells > m.n_rows + n_poles * shape[3]:
        sizes = " x ".join(map(str, shape))
        raise MeasurementError(
            f"{format_name} holds complete grids; the {m.n_rows} rows would leave holes in "
            f"a grid of {sizes} angles (theta_i, phi_i, theta_r, phi_r); write them as csv"
        )
    places = [np.searchsorted(axis, a) for axis, a in zip(axes, degrees, strict=True)]
    places[3] = np.where(pole, 0, places[3])
    value = np.full((*shape, m.n_channels), np.nan)
    index = tuple(places)
    value[index] = m.value
    if not np.array_equal(value[index], m.value, equal_nan=True):
        raise MeasurementError(
            f"{format_name} holds one value per pair of directions; some rows repeat the "
            "directions of others with other values; write them as csv"
        )
    if axes[2][0] == 0:
        value[:, :, 0] = value[:, :, 0, :1]
    if unknown := int(np.count_nonzero(np.isnan(value).any(axis=-1))):
        raise MeasurementError(
            f"{format_name} holds complete grids; {unknown} of {n_cells} pairs of "
            "directions have no value; write them as csv"
        )
    return AngleGrid(axes[0], axes[1], axes[2], axes[3], value)
