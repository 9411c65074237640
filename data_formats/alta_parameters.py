"""The parametrisations of directions of ALTA, as four angles.

Where ALTA writes half and difference angles, the difference vector is that of the view.
Source: `params.cpp` of ALTA.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.half_difference import FourAngles, directions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Parametrisation:
    """How the first columns of a row give its directions.

    **Arguments:**

    - `columns`: what they are.
    - `angles`: from the columns to `theta_i, phi_i, theta_r, phi_r`; NaN where a row is no
        pair of directions.
    - `from_half`: whether a grid of it reaches below the horizon.
    """

    columns: tuple[str, ...]
    angles: Callable[..., FourAngles]
    from_half: bool = False


def _spherical(theta_l: Array, phi_l: Array, theta_v: Array, phi_v: Array) -> FourAngles:
    # ALTA goes over vectors: a negative theta is the other azimuth.
    return (*_unsigned(theta_l, phi_l), *_unsigned(theta_v, phi_v))


def _unsigned(theta: Array, phi: Array) -> tuple[Array, Array]:
    return np.abs(theta), np.where(theta < 0, phi + np.pi, phi)


def _isotropic(theta_v: Array, theta_l: Array, dphi: Array) -> FourAngles:
    return _in_plane(*_spherical(theta_l, dphi, theta_v, np.zeros_like(dphi)))


def _projected(theta_l: Array, x: Array, y: Array) -> FourAngles:
    zero = np.zeros_like(x)
    return _in_plane(*_spherical(theta_l, zero, np.hypot(x, y), np.arctan2(y, x)))


def _from_normal(x: Array, y: Array) -> FourAngles:
    return _projected(np.zeros_like(x), x, y)


def _in_plane(theta_i: Array, phi_i: Array, theta_r: Array, phi_r: Array) -> FourAngles:
    """Turned so that `phi_i = 0`."""
    return theta_i, np.zeros_like(phi_i), theta_r, phi_r - phi_i


def _vectors(*xyz: Array) -> FourAngles:
    """The view first, then the light."""
    v, light = xyz[:3], xyz[3:]
    lengths = [np.sqrt(sum(c**2 for c in vector)) for vector in (v, light)]
    wrong = np.max([np.abs(length - 1) for length in lengths], axis=0) > 0.01
    theta_r, theta_i = (np.arctan2(np.hypot(a[0], a[1]), a[2]) for a in (v, light))
    theta_i = np.where(wrong, np.nan, theta_i)
    return theta_i, np.arctan2(light[1], light[0]), theta_r, np.arctan2(v[1], v[0])


def _half(theta_h: Array, theta_d: Array, phi_d: Array) -> FourAngles:
    theta_v, phi_v, theta_l, phi_l = directions(theta_h, theta_d, phi_d)
    return _in_plane(theta_l, phi_l, theta_v, phi_v)


def _half_turned(theta_h: Array, phi_h: Array, theta_d: Array, phi_d: Array) -> FourAngles:
    theta_v, phi_v, theta_l, phi_l = directions(theta_h, theta_d, phi_d, phi_h)
    return theta_l, phi_l, theta_v, phi_v


def _arccos(cosine: Array) -> Array:
    return np.arccos(np.where(np.abs(cosine) <= 1 + 1e-9, np.clip(cosine, -1, 1), np.nan))


PARAMETRISATIONS: dict[str, Parametrisation] = {
    "SPHERICAL_TL_PL_TV_PV": Parametrisation(
        ("theta_l", "phi_l", "theta_v", "phi_v"), _spherical
    ),
    "ISOTROPIC_TV_TL_DPHI": Parametrisation(("theta_v", "theta_l", "dphi"), _isotropic),
    "ISOTROPIC_TL_TV_PROJ_DPHI": Parametrisation(
        ("theta_l", "theta_v cos dphi", "theta_v sin dphi"), _projected
    ),
    "ISOTROPIC_TV_PROJ_DPHI": Parametrisation(
        ("theta_v cos dphi", "theta_v sin dphi"), _from_normal
    ),
    "CARTESIAN": Parametrisation(("v_x", "v_y", "v_z", "l_x", "l_y", "l_z"), _vectors),
    "RUSIN_TH_PH_TD_PD": Parametrisation(
        ("theta_h", "phi_h", "theta_d", "phi_d"), _half_turned, from_half=True
    ),
    "RUSIN_TH_TD_PD": Parametrisation(
        ("theta_h", "theta_d", "phi_d"), _half, from_half=True
    ),
    "RUSIN_TH_TD": Parametrisation(
        ("theta_h", "theta_d"),
        lambda theta_h, theta_d: _half(theta_h, theta_d, np.full_like(theta_h, np.pi / 2)),
        from_half=True,
    ),
    "COS_TH_TD": Parametrisation(
        ("cos theta_h", "cos theta_d"),
        lambda h, d: _half(_arccos(h), _arccos(d), np.zeros_like(h)),
        from_half=True,
    ),
    "COS_TH": Parametrisation(
        ("cos theta_h",),
        lambda h: _half(_arccos(h), np.zeros_like(h), np.zeros_like(h)),
        from_half=True,
    ),
}
