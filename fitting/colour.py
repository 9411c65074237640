"""Colour differences between measured and fitted spectra, by colour-science."""

from __future__ import annotations

import warnings

import numpy as np

from fitting.problem import Rows
from fitting.result import Colour

ILLUMINANT = "D65"
OBSERVER = "CIE 1931 2 Degree Standard Observer"
_VISIBLE = (380.0, 780.0)


def colour_difference(
    wavelengths: np.ndarray, rows: Rows, predicted: np.ndarray
) -> Colour | None:
    """CIE Delta E 2000 of reflectance factors ``pi f``, row by row, under D65.

    Only rows whose whole visible spectrum is valid count. The spectra are interpolated to
    5 nm over their own range within 380 to 780 nm, which is stated; L*a*b* is relative to
    the illuminant over the same range. None with fewer than five visible wavelengths, or
    without a complete row.
    """
    order = np.argsort(wavelengths)
    visible = (wavelengths[order] >= _VISIBLE[0]) & (wavelengths[order] <= _VISIBLE[1])
    order = order[visible]
    full = rows.valid[:, order].all(axis=1)
    if order.size < 5 or not full.any():
        return None
    wavelengths = wavelengths[order]
    with warnings.catch_warnings():
        # It warns about optional packages of its own plots, which are not used here.
        warnings.simplefilter("ignore")
        import colour
    low, high = float(wavelengths[0]), float(wavelengths[-1])
    grid = np.arange(np.ceil(low / 5) * 5, high + 1e-9, 5.0)
    cmfs = colour.MSDS_CMFS[OBSERVER]
    source = colour.SDS_ILLUMINANTS[ILLUMINANT]
    weights = np.stack(
        [np.interp(grid, cmfs.wavelengths, v) for v in cmfs.values.T], axis=1
    )
    weights = weights * np.interp(grid, source.wavelengths, source.values)[:, None]
    weights = weights / weights[:, 1].sum()
    white = weights.sum(axis=0)
    white_xy = white[:2] / white.sum()

    def lab(values: np.ndarray) -> np.ndarray:
        factor = np.pi * np.stack([np.interp(grid, wavelengths, v) for v in values])
        return colour.XYZ_to_Lab(factor @ weights, white_xy)

    difference = colour.delta_E(
        lab(rows.value[full][:, order]), lab(predicted[full][:, order]), method="CIE 2000"
    )
    return Colour(
        illuminant=ILLUMINANT,
        observer=OBSERVER,
        range_nm=(float(grid[0]), float(grid[-1])),
        mean=float(np.mean(difference)),
        percentile_95=float(np.percentile(difference, 95)),
        maximum=float(np.max(difference)),
    )
