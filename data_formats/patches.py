"""Pairs of patches of directions, as matrices and trees of BSDF values have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Channel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Patches:
    """Centres of pairs of patches, in the frame of the file.

    theta is counted from the normal of the side that each patch is on; azimuths are those
    of the vectors from the surface.

    **Arguments:**

    - `theta_i`, `phi_i`, `theta_r`, `phi_r`: (n,) rad.
    - `area`: (n,) sr; the projected solid angle of the outgoing patch.
    - `key`: the same for the same patches.
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi_r: Array
    area: Array
    key: object


@dataclass
class Group:
    """The values of one way of the light on the same patches.

    **Arguments:**

    - `way`: `"reflection"` or `"transmission"`.
    - `side`: that the light falls on, `"front"` or `"back"`.
    - `patches`: the n pairs.
    - `values`: (n,) BSDF in 1/sr of each channel.
    """

    way: str
    side: str
    patches: Patches
    values: dict[Channel, Array] = field(default_factory=dict)

    def angles(self) -> tuple[Array, Array, Array, Array]:
        """The four angles with `z` out of the front: the file's frame turned about `y`."""
        p = self.patches
        back_i = self.side == "back"
        back_r = back_i != (self.way == "transmission")
        return (
            np.pi - p.theta_i if back_i else p.theta_i,
            _turned(p.phi_i),
            np.pi - p.theta_r if back_r else p.theta_r,
            _turned(p.phi_r),
        )

    def columns(self, channels: Sequence[Channel]) -> Array:
        """(n, channels) values, NaN where there are none."""
        absent = np.full(len(self.patches.area), np.nan)
        return np.column_stack([self.values.get(c, absent) for c in channels])


def _turned(phi: Array) -> Array:
    """`pi - phi`, from -pi to pi."""
    return np.pi - np.remainder(phi, 2 * np.pi)
