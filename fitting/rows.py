"""The rows of a measurement that a model is compared with."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np

from data_formats import Measurement, MeasurementError
from fitting.geometry import Geometry
from fitting.models import Way
from fitting.padding import padded_geometry
from fitting.solid_angle import from_normal, solid_angle_weights

_LARGEST = 1e100

_NO_LOBE: dict[Way, str] = {
    "front": "rows of light reflected at the front, for which the model has no lobe",
    "back": "rows of light reflected at the back (theta_i > 90 deg), for which the model "
    "has no lobe (the option 'back' makes one)",
    "down": "transmitted rows (theta_r > 90 deg), for which the model has no lobe (such as "
    "lambert_transmission)",
    "up": "transmitted rows lit from the back (theta_i > 90 deg), for which the model has "
    "no lobe (such as lambert_transmission)",
}


def ways_of(measurement: Measurement) -> np.ndarray:
    """``(n,)`` the way of light of every row, as lobes name them."""
    through, back = measurement.transmitted, measurement.from_back
    # Of grazing light the detector tells the side.
    back = back | (~through & (measurement.theta_r > 0.5 * math.pi + 1e-9))
    reflected = np.where(back, "back", "front")
    return np.where(through, np.where(back, "up", "down"), reflected)


@dataclass(frozen=True)
class Rows:
    """The rows that a fit uses, as plain arrays, and why others were left out.

    The geometry is that of `padding.padded_geometry`, which all problems of these rows
    share.
    """

    index: np.ndarray
    padded: Geometry
    value: np.ndarray
    valid: np.ndarray
    sigma: np.ndarray | None
    solid_angle: np.ndarray
    left_out: tuple[str, ...]
    way: np.ndarray
    fitted: np.ndarray | None = None

    @property
    def geometry(self) -> Geometry:
        """The geometry of the rows alone, ``(n,)``."""
        return jax.tree.map(lambda a: a[: self.index.size], self.padded)


def select_rows(
    measurement: Measurement, max_theta_deg: float, ways: Sequence[Way] = ("front",)
) -> Rows:
    """Rows that a model can be compared with which knows these ways of light.

    Raises `MeasurementError` if none is left.
    """
    m = measurement
    limit = math.radians(max_theta_deg) + 1e-6
    steepest = np.maximum(from_normal(m.theta_i), from_normal(m.theta_r))
    way = ways_of(m)
    unknown = ~np.isin(way, ways)
    grazing = ~unknown & (steepest > limit)
    empty = ~unknown & ~grazing & ~m.valid.any(axis=1)
    keep = ~unknown & ~grazing & ~empty
    reasons = [(unknown & (way == w), text) for w, text in _NO_LOBE.items()]
    reasons += [
        (grazing, f"rows beyond the grazing cut-off of {max_theta_deg:g} deg"),
        (empty, "rows without a valid value"),
    ]
    left_out = tuple(f"{int(r.sum())} {text}" for r, text in reasons if r.any())
    if not keep.any():
        raise MeasurementError(
            f"{m.provenance.path or 'measurement'}: no row is left for the model "
            f"({'; '.join(left_out) or 'it is empty'}); see `brdf info`"
        )
    top = float(np.abs(np.where(m.valid[keep], m.value[keep], 0.0)).max())
    if top > _LARGEST:
        raise MeasurementError(
            f"{m.provenance.path or 'measurement'}: the largest value is {top:.3g} 1/sr; "
            f"expected a BRDF below {_LARGEST:g}; check the units"
        )
    angles = (m.theta_i[keep], m.phi_i[keep], m.theta_r[keep], m.phi_r[keep])
    return Rows(
        index=np.flatnonzero(keep),
        padded=padded_geometry(*angles),
        value=m.value[keep],
        valid=m.valid[keep],
        sigma=None if m.sigma is None else m.sigma[keep],
        solid_angle=solid_angle_weights(*angles),
        left_out=left_out,
        way=way[keep],
    )


def weighted(rows: Rows, weights: np.ndarray) -> Rows:
    """The same rows, each counting as much as ``weights`` say, one per row of the file.

    Raises `MeasurementError` if there are more or fewer, or if no row that is used counts.
    """
    if rows.index.size and rows.index.max() >= weights.size:
        raise MeasurementError(
            f"found {weights.size} weights; expected one for every row of the measurement"
        )
    own = weights[rows.index]
    if not np.any(own > 0):
        raise MeasurementError("no row that the fit uses has a weight above 0")
    return dataclasses.replace(rows, solid_angle=own / own.mean())


def with_noise_of(rows: Rows, fitted: np.ndarray) -> Rows:
    """The same rows, whose assumed noise follows a fit instead of the noisy values."""
    return dataclasses.replace(rows, fitted=fitted)
