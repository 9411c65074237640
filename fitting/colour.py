"""Colour differences between measured and fitted spectra, by colour-science."""

from __future__ import annotations

import numpy as np

from fitting.colorimetry import (
    FEWEST_WAVELENGTHS,
    VISIBLE_NM,
    colour_science,
    delta_e_2000,
    tristimulus_weights,
)
from fitting.result import Colour
from fitting.rows import Rows

_STEP_NM = 5.0


def colour_difference(
    wavelengths: np.ndarray, rows: Rows, predicted: np.ndarray
) -> Colour | None:
    """CIE Delta E 2000 of reflectance factors ``pi f``, row by row, under D65.

    Only rows whose whole visible spectrum is valid count. The spectra are interpolated to
    5 nm over their own range within 380 to 780 nm, which is stated; L*a*b* is relative to
    the illuminant over the same range. None with fewer than five visible wavelengths, with
    all of them within 5 nm, or without a complete row.
    """
    order = np.argsort(wavelengths)
    visible = (wavelengths[order] >= VISIBLE_NM[0]) & (wavelengths[order] <= VISIBLE_NM[1])
    order = order[visible]
    full = rows.valid[:, order].all(axis=1)
    if order.size < FEWEST_WAVELENGTHS or not full.any():
        return None
    if np.ptp(wavelengths[order]) < _STEP_NM:
        return None
    weights = tristimulus_weights(
        wavelengths[order], interpolation="linear", extrapolation="none", step_nm=_STEP_NM
    )
    white_xy = weights.white[:2] / weights.white.sum()

    def lab(values: np.ndarray) -> np.ndarray:
        xyz = np.pi * values[full][:, order] @ weights.matrix
        return colour_science().XYZ_to_Lab(xyz / 100.0, white_xy)

    difference = delta_e_2000(lab(rows.value), lab(predicted))
    return Colour(
        illuminant=weights.illuminant,
        observer=weights.observer,
        range_nm=weights.summed_nm,
        mean=float(np.mean(difference)),
        percentile_95=float(np.percentile(difference, 95)),
        maximum=float(np.max(difference)),
    )
