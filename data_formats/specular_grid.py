"""Polar grids, those around the specular direction among them, as directions and rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from data_formats.columns import FOUR_ANGLES, Columns, Unit
from data_formats.measurement import Channel
from data_formats.provenance import Note

# Cosine of what counts as on the horizon.
_HORIZON = 1e-9


def around_specular(
    theta: ArrayLike, radial: ArrayLike, azimuth: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions given by their distance from a specular direction.

    With `d = (sin r cos a, sin r sin a, cos r)` the direction is
    `(d_x cos t - d_z sin t, d_y, d_x sin t + d_z cos t)`: the source is at azimuth 0,
    `r = 0` is the specular direction, at azimuth pi, and `a = 0` points from it to the
    normal.

    **Arguments:**

    - `theta`: (n,) of the specular direction, rad.
    - `radial`: (n,) angle to it, rad.
    - `azimuth`: (n,) around it, rad.

    **Returns:** theta in [0, pi] and phi, (n,) rad.
    """
    t, r, a = (np.asarray(x, dtype=np.float64) for x in (theta, radial, azimuth))
    x, y, z = np.sin(r) * np.cos(a), np.sin(r) * np.sin(a), np.cos(r)
    x, z = x * np.cos(t) - z * np.sin(t), x * np.sin(t) + z * np.cos(t)
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def from_specular(
    theta_s: NDArray[np.float64], theta: NDArray[np.float64], phi: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The inverse of `around_specular`.

    **Arguments:**

    - `theta_s`: (n,) of the specular direction, rad.
    - `theta`, `phi`: (n,) of the direction, rad; the source is at azimuth 0.

    **Returns:** the angle to the specular direction in [0, pi], and the azimuth; (n,) rad.
    """
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    x, z = (
        x * np.cos(theta_s) + z * np.sin(theta_s),
        z * np.cos(theta_s) - x * np.sin(theta_s),
    )
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def above_horizon(theta: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) whether a direction is above the horizon by more than rounding."""
    return np.cos(theta) > _HORIZON


def left_out_below(
    below: NDArray[np.bool_], value: NDArray[np.float64], notes: list[Note]
) -> None:
    """A note on rows of a grid below the horizon, where there is nothing to see."""
    if count := int(np.count_nonzero(below)):
        other = int(np.count_nonzero((value[below] != 0).any(axis=1)))
        but = f"; {other} of them are not zero" if other else ", all zero"
        notes.append(
            Note(
                "below-horizon-left-out",
                f"rows of the grid on or below the horizon: {count}{but}; left out",
                count,
            )
        )


def first_of_repeats(
    angles: NDArray[np.float64], value: NDArray[np.float64], notes: list[Note]
) -> NDArray[np.bool_]:
    """(n,) rows that do not repeat an earlier row's directions and values.

    A polar grid gives its pole once per azimuth, and 0 and 360 degrees. A pole with
    different values is kept as it is.

    **Arguments:**

    - `angles`: (n, 4) theta_i, phi_i, theta_r, phi_r in rad.
    - `value`: (n, c).
    - `notes`: appended to.
    """
    sin, cos = np.sin(angles), np.cos(angles)
    vectors = [sin[:, ::2] * cos[:, 1::2], sin[:, ::2] * sin[:, 1::2], cos[:, ::2]]
    # NaN would differ from NaN, and 1/3 from 0.33333333333333337.
    mantissa, exponent = np.frexp(np.where(np.isnan(value), np.inf, value))
    # Adding 0 turns -0 into 0.
    directions = [np.round(v, 9) + 0.0 for v in vectors]
    keys = np.hstack([*directions, np.ldexp(np.round(mantissa, 12), exponent) + 0.0])
    first = np.zeros(len(keys), dtype=bool)
    first[np.unique(keys, axis=0, return_index=True)[1]] = True
    if count := int(np.count_nonzero(~first)):
        notes.append(
            Note(
                "repeated-rows-left-out",
                "rows that repeat directions and values of an earlier row (the pole of the "
                f"grid, or 360 degrees): {count}; left out",
                count,
            )
        )
    return first


def zeros_at_the_edge(value: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Zeros that run up to the last entry of the last axis, of any shape.

    Writers of grids put zero where nothing was measured; a zero between values is kept.
    """
    return np.logical_and.accumulate(value[..., ::-1] == 0, axis=-1)[..., ::-1]


def masked_zeros(count: int) -> Note:
    """The note on zeros from `zeros_at_the_edge`."""
    return Note(
        "edge-zeros-masked",
        f"values above the horizon that are zero up to the edge of the grid: {count}; not "
        "measured, masked",
        count,
    )


def projected_integral(
    theta: NDArray[np.float64], phi: NDArray[np.float64], value: NDArray[np.float64]
) -> float:
    """Integral of values over the projected solid angle, by the trapezoidal rule.

    **Arguments:**

    - `theta`, `phi`: (t,) and (p,) of a grid, rad; if phi covers at most half a turn, the
        other half is taken to be the same.
    - `value`: (t, p); NaN counts as zero.
    """
    order = np.argsort(theta)
    weight = np.sin(theta) * np.abs(np.cos(theta))
    rows = np.nan_to_num(value * weight[:, None])[order]
    around = np.trapezoid(np.trapezoid(rows, theta[order], axis=0), phi)
    return float(around * (2 if np.ptp(phi) <= np.pi + _HORIZON else 1))


def columns_of(channels: list[Channel], unit: Unit = "rad", masks: bool = False) -> Columns:
    """The columns of rows of four angles, the values, and as many masks if any."""
    n = len(channels)
    return Columns(
        angles={name: (column, unit) for name, (column, _) in FOUR_ANGLES.items()},
        channels=[(channel, 4 + k) for k, channel in enumerate(channels)],
        valid=list(range(4 + n, 4 + 2 * n)) if masks else [],
    )
