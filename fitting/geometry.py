"""Directions as the models need them: components, computed once, never angles.

``wi`` points from the surface to the source, ``wo`` to the detector, z is the normal.
A negative z component is the back of the sample: light that arrives there, or leaves it.
Half vectors are formed here in float64 and stored, because ``sin^2(theta_h)`` taken from
``1 - cos^2`` loses every digit of a narrow peak in float32.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Container
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpy.typing import ArrayLike

Vector = Float[Array, " n"]


class PolarAngles(eqx.Module):
    """The few polar angles that a goniometer's many rows are made of.

    ``index_i, index_o (n,)`` tell which of the ``(m,)`` angles each row has.
    """

    sine2: Float[Array, " m"]
    cosine: Float[Array, " m"]
    index_i: Int[Array, " n"]
    index_o: Int[Array, " n"]


class Geometry(eqx.Module):
    """Pairs of directions, structure of arrays; every field has the same shape.

    ``cos_i, cos_o`` are the z components; ``hx, hy, hz`` the unit half vector
    ``(wi + wo) / |wi + wo|``; ``cos_d = wi . wh``. At ``wi = -wo`` the half vector is not
    defined and is taken as the normal with ``cos_d = 0``; every lobe is zero there.
    """

    wix: Vector
    wiy: Vector
    cos_i: Vector
    wox: Vector
    woy: Vector
    cos_o: Vector
    hx: Vector
    hy: Vector
    hz: Vector
    cos_d: Vector
    polar: PolarAngles | None = None

    def over_angles(self, function: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
        """``function(sin^2(theta), |cos(theta)|)`` at the source's and detector's angles.

        For costly functions of one polar angle: where the angles that occur are known,
        they are evaluated once each.
        """
        if self.polar is None:
            return (
                function(self.wix**2 + self.wiy**2, abs(self.cos_i)),
                function(self.wox**2 + self.woy**2, abs(self.cos_o)),
            )
        values = function(self.polar.sine2, abs(self.polar.cosine))
        return values[self.polar.index_i], values[self.polar.index_o]

    @property
    def turned(self) -> Geometry:
        """The same detectors with the source turned by 180 degrees around the normal."""
        turned = from_components(
            -self.wix, -self.wiy, self.cos_i, self.wox, self.woy, self.cos_o
        )
        return dataclasses.replace(turned, polar=self.polar)

    @property
    def swapped(self) -> Geometry:
        """The same pairs with source and detector exchanged."""
        return Geometry(
            wix=self.wox, wiy=self.woy, cos_i=self.cos_o,
            wox=self.wix, woy=self.wiy, cos_o=self.cos_i,
            hx=self.hx, hy=self.hy, hz=self.hz, cos_d=self.cos_d,
        )  # fmt: skip

    @property
    def turned_over(self) -> Geometry:
        """The same pairs with front and back of the sample exchanged: z reversed."""
        return dataclasses.replace(self, cos_i=-self.cos_i, cos_o=-self.cos_o, hz=-self.hz)

    @property
    def from_front(self) -> tuple[Geometry, Array]:
        """The pairs turned over where the light arrives at the back, and where that is."""
        back = (self.cos_i < 0) | ((self.cos_i == 0) & (self.cos_o < 0))
        lib = _library(self.cos_i, self.cos_o)
        sign = lib.where(back, -1.0, 1.0).astype(self.cos_i.dtype)
        front = dataclasses.replace(
            self, cos_i=sign * self.cos_i, cos_o=sign * self.cos_o, hz=sign * self.hz
        )
        return front, back

    @property
    def unfolded(self) -> Geometry:
        """The same sources with the detector mirrored at the plane of the surface.

        Light that goes straight through is then light that is reflected like in a mirror.
        The tangential part of ``wi + wo`` is taken from the stored half vector, which has
        all its digits where the directions are nearly opposite.
        """
        lib = _library(self.cos_i, self.cos_o)
        twice = 2.0 * self.cos_d
        sx, sy, sz = twice * self.hx, twice * self.hy, self.cos_i - self.cos_o
        hx, hy, hz, cos_d = _half(lib, sx, sy, sz)
        return dataclasses.replace(
            self, cos_o=-self.cos_o, hx=hx, hy=hy, hz=hz, cos_d=cos_d
        )

    def refracting(self, eta: Array) -> tuple[Array, Array, Array]:
        """``-(w_f + eta w_b)`` of the directions in front and behind, of transmitted pairs.

        Along the half vector of refraction, of Walter et al. 2007, eq. 16, as seen from
        both sides. As ``(eta - 1) w_f - eta (wi + wo)``, with the stored half vector.
        """
        lib = _library(self.cos_i, self.cos_o)
        down = self.cos_i > 0
        step, twice = eta - 1.0, 2.0 * self.cos_d * eta
        front = (
            lib.where(down, self.wix, self.wox),
            lib.where(down, self.wiy, self.woy),
            lib.where(down, self.cos_i, self.cos_o),
        )
        half = (self.hx, self.hy, self.hz)
        x, y, z = (step * f - twice * h for f, h in zip(front, half, strict=True))
        return x, y, z

    def on(self, ways: Container[str]) -> Array:
        """True where the light takes one of these ways: see `fitting.models.lobe.Way`."""
        # Only what is asked for: of few rows, on numpy, each takes as long as the rest.
        seen = (self.cos_i > 0) & False
        if "down" in ways:
            seen = seen | (self.transmits & (self.cos_i > 0))
        if "up" in ways:
            seen = seen | (self.transmits & (self.cos_i < 0))
        if "front" in ways:
            seen = seen | self.reflects
        if "back" in ways:
            seen = seen | self.turned_over.reflects
        return seen

    @property
    def reflects(self) -> Array:
        """True where source and detector are both on the side of the normal."""
        return (self.cos_i >= 0) & (self.cos_o >= 0) & (self.cos_i + self.cos_o > 0)

    @property
    def transmits(self) -> Array:
        """True where source and detector are on different sides.

        The horizon belongs to reflection: a pair is never on both.
        """
        down = (self.cos_i > 0) & (self.cos_o < 0)
        return down | ((self.cos_i < 0) & (self.cos_o > 0))


def from_components(wix, wiy, wiz, wox, woy, woz) -> Geometry:
    """Geometry of unit vectors given by components; works on numpy and JAX arrays.

    Differentiable in the directions everywhere but at ``wi = -wo``, where the gradient
    is zero.
    """
    lib = _library(wix, wiz, wox, woz)
    hx, hy, hz, cos_d = _half(lib, wix + wox, wiy + woy, wiz + woz)
    return Geometry(
        wix=wix, wiy=wiy, cos_i=wiz, wox=wox, woy=woy, cos_o=woz,
        hx=hx, hy=hy, hz=hz, cos_d=cos_d,
    )  # fmt: skip


def _library(*arrays: Any) -> Any:
    """numpy where all arrays are numpy's, or its scalars, else JAX."""
    return np if all(isinstance(a, np.ndarray | np.generic) for a in arrays) else jnp


def _half(lib: Any, sx, sy, sz) -> tuple:
    """Unit vector and half length of ``wi + wo``."""
    norm2 = sx * sx + sy * sy + sz * sz
    defined = norm2 > 1e-24
    norm = lib.sqrt(lib.where(defined, norm2, 1.0))
    return (
        lib.where(defined, sx / norm, 0.0),
        lib.where(defined, sy / norm, 0.0),
        lib.where(defined, sz / norm, 1.0),
        lib.where(defined, 0.5 * norm, 0.0),
    )


def from_angles(
    theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
) -> Geometry:
    """Geometry of polar and azimuthal angles in radians, in float64 (numpy arrays).

    ``theta`` is measured from the normal, in [0, pi]; specular is ``phi_r - phi_i = pi``.
    """
    ti, pi, tr, pr = np.broadcast_arrays(
        *(np.asarray(a, dtype=np.float64) for a in (theta_i, phi_i, theta_r, phi_r))
    )
    return from_components(
        np.sin(ti) * np.cos(pi), np.sin(ti) * np.sin(pi), _cos(ti),
        np.sin(tr) * np.cos(pr), np.sin(tr) * np.sin(pr), _cos(tr),
    )  # fmt: skip


def _cos(theta: np.ndarray) -> np.ndarray:
    # np.cos(np.pi / 2) is 6e-17, not 0: a grazing direction is on the horizon, not above.
    cosine = np.cos(theta)
    return np.where(np.abs(cosine) < 1e-15, 0.0, cosine)
