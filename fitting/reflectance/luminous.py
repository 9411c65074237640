"""The colour of a reflectance: what an eye makes of the factors of all channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fitting.colorimetry import (
    ILLUMINANT,
    OBSERVER,
    ObjectColour,
    colour_of,
    delta_e_2000,
    rgb_colour,
)


def colour_of_factors(
    names: Sequence[str],
    wavelengths_nm: Sequence[float | None],
    factor: Sequence[float],
    covariance: np.ndarray | None,
    *,
    illuminant: str = ILLUMINANT,
    observer: str = OBSERVER,
) -> ObjectColour | None:
    """Colour of reflectance factors ``(c,)`` with a covariance ``(c, c)`` (CIE 15).

    None with fewer than five wavelengths in the visible, or bands other than R, G, B or
    X, Y, Z. Raises `ColourError` for an unknown illuminant or observer.
    """
    at = [w for w in wavelengths_nm if w is not None]
    if len(at) == len(names):
        return colour_of(
            at, factor, covariance=covariance, illuminant=illuminant, observer=observer
        )
    sigma = None if covariance is None else np.sqrt(np.diag(covariance))
    return rgb_colour(names, factor, sigma=sigma)


def colour_difference(one: ObjectColour, other: ObjectColour) -> float:
    """CIEDE2000 of two colours under the same illuminant and observer."""
    return float(delta_e_2000(one.lab, other.lab))
