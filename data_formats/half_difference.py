"""From half and difference angles to the directions of source and detector.

`h` is the unit vector between `wi` and `wo`, and `d` is `wi` seen from it:
`wi = R_z(phi_h) R_y(theta_h) d`, `wo` the same with `d_x, d_y` negated (S. Rusinkiewicz,
"A new change of variables for efficient BRDF representation", 1998).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FourAngles = tuple[Array, Array, Array, Array]


def directions(
    theta_h: Array, theta_d: Array, phi_d: Array, phi_h: Array | None = None
) -> FourAngles:
    """`theta_i, phi_i, theta_r, phi_r` in radians, of the arrays' common shape.

    **Arguments:**

    - `theta_h`, `theta_d`, `phi_d`: rad; of shapes that go together.
    - `phi_h`: rad; `None`: the sample is isotropic, and turned so that `phi_i = 0`.
    """
    cos_h, sin_h = np.cos(theta_h), np.sin(theta_h)
    cos_d, sin_d = np.cos(theta_d), np.sin(theta_d)
    along, across = sin_d * np.cos(phi_d), sin_d * np.sin(phi_d)
    near, far = cos_h * cos_d, sin_h * along
    theta_i, phi_i = _angles(sin_h * cos_d + cos_h * along, across, near - far)
    theta_r, phi_r = _angles(sin_h * cos_d - cos_h * along, -across, near + far)
    if phi_h is None:
        # From -pi to pi: a difference that rounding leaves beyond them is turned back.
        dphi = np.remainder(phi_r - phi_i + np.pi, 2 * np.pi) - np.pi
        return theta_i, np.zeros_like(theta_i), theta_r, dphi
    return theta_i, phi_i + phi_h, theta_r, phi_r + phi_h


def half_difference(
    theta_i: Array, phi_i: Array, theta_r: Array, phi_r: Array
) -> tuple[Array, Array, Array]:
    """`theta_h, theta_d, phi_d` of pairs of directions; `phi_d` in (-pi, pi]."""
    azimuth = phi_r - phi_i
    ix, iz = np.sin(theta_i), np.cos(theta_i)
    rx, ry = np.sin(theta_r) * np.cos(azimuth), np.sin(theta_r) * np.sin(azimuth)
    hx, hy, hz = ix + rx, ry, iz + np.cos(theta_r)
    length = np.sqrt(hx**2 + hy**2 + hz**2)
    across = np.hypot(hx, hy)
    theta_h = np.arctan2(across, hz)
    phi_h = np.arctan2(hy, hx)
    cos_h, sin_h = hz / length, across / length
    plane = ix * np.cos(phi_h)
    dx = cos_h * plane - sin_h * iz
    dy = -ix * np.sin(phi_h)
    dz = sin_h * plane + cos_h * iz
    return theta_h, np.arctan2(np.hypot(dx, dy), dz), np.arctan2(dy, dx)


def _angles(x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
