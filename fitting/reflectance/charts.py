"""Charts of a hemisphere: rays from where a lobe peaks, and directions along them.

A point has the azimuth ``psi`` and the distance ``t >= 0``. Each owner, a fixed direction
``w``, has a chart of its own; both sides of the surface are folded onto z > 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fitting.reflectance.region import Cap

Quadratic = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class HalfVector:
    """Slopes ``t (cos psi, sin psi)`` of the half vector of ``w`` and the direction.

    ``direction = 2 (w.h) h - w`` with ``h ~ (t cos psi, t sin psi, 1)``. ``w (N, 3)``;
    ``widths`` are the slope widths along two axes and the azimuth of the first, rad.
    """

    w: np.ndarray
    widths: tuple[float, float, float]

    @property
    def owners(self) -> int:
        return len(self.w)

    def start(self) -> np.ndarray:
        """Azimuth of the plane of incidence, at which a first ray goes."""
        return np.arctan2(self.w[:, 1], self.w[:, 0])

    def stretched(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``psi``, the scale of ``t`` and ``dpsi/dphi`` at azimuths of the round lobe."""
        ax, ay, angle = self.widths
        x, y = ax * np.cos(phi), ay * np.sin(phi)
        rho2 = x * x + y * y
        return np.arctan2(y, x) + angle, np.sqrt(rho2), ax * ay / rho2

    def round_azimuth(self, psi: np.ndarray) -> np.ndarray:
        """The inverse of `stretched`."""
        ax, ay, angle = self.widths
        return np.arctan2(ax * np.sin(psi - angle), ay * np.cos(psi - angle))

    def azimuth_of(self, direction: np.ndarray) -> np.ndarray:
        """``psi`` of directions ``(..., N, 3)``."""
        h = direction + self.w
        return np.arctan2(h[..., 1], h[..., 0])

    def quadratic(self, cap: Cap, owner: np.ndarray, psi: np.ndarray) -> Quadratic:
        """``2 (p t + w_z)(q t + a_z) >= (cos kappa + w.a)(1 + t^2)``, as A, B, C."""
        w, a, vers, cos = _of_owner(self.w, cap, owner, psi)
        c, s = np.cos(psi), np.sin(psi)
        p, q = w[0] * c + w[1] * s, a[0] * c + a[1] * s
        k = cos + w[0] * a[0] + w[1] * a[1] + w[2] * a[2]
        # The mirror direction of w less the axis.
        gap = (-w[0] - a[0]) ** 2 + (-w[1] - a[1]) ** 2 + (w[2] - a[2]) ** 2
        const = vers - 0.5 * gap
        return 2.0 * p * q - k, 2.0 * (p * a[2] + q * w[2]), const + 0.0 * psi

    def directions(
        self, owner: np.ndarray, psi: np.ndarray, t: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Directions ``(..., 3)``, and ``cos dw / (t dt dpsi)``.

        ``dw = 4 (w.h) dw_h`` and ``dw_h = cos^3(theta_h) t dt dpsi``.
        """
        w = np.moveaxis(self.w[owner], -1, 0)
        hz = 1.0 / np.sqrt(1.0 + t * t)
        hx, hy = t * hz * np.cos(psi), t * hz * np.sin(psi)
        cos_d = w[0] * hx + w[1] * hy + w[2] * hz
        out = np.stack(
            [2 * cos_d * hx - w[0], 2 * cos_d * hy - w[1], 2 * cos_d * hz - w[2]], axis=-1
        )
        out[..., 2] = np.maximum(out[..., 2], 0.0)
        return out, out[..., 2] * 4.0 * np.maximum(cos_d, 0.0) * hz**3


@dataclass(frozen=True)
class Polar:
    """Stereographic around a centre: ``t`` is the tangent of half the angle from it.

    ``direction = ((1 - t^2) c + 2 t e) / (1 + t^2)``. ``centre (N, 3)``; ``azimuth (N,)``,
    rad, is that of the first ray for centres at the normal; ``scale`` that of ``t``.
    """

    centre: np.ndarray
    azimuth: np.ndarray
    scale: float

    @property
    def owners(self) -> int:
        return len(self.centre)

    def _frame(self) -> tuple[np.ndarray, np.ndarray]:
        c = self.centre
        tilted = c[:, 0] ** 2 + c[:, 1] ** 2 > 1e-24
        phi = np.where(tilted, np.arctan2(c[:, 1], c[:, 0]), self.azimuth)
        across = np.stack([-np.sin(phi), np.cos(phi), 0.0 * phi], axis=-1)
        return np.cross(across, c), across

    def start(self) -> np.ndarray:
        return np.zeros(self.owners)

    def stretched(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return phi, np.full(phi.shape, self.scale), np.ones(phi.shape)

    def round_azimuth(self, psi: np.ndarray) -> np.ndarray:
        return psi

    def azimuth_of(self, direction: np.ndarray) -> np.ndarray:
        along, across = self._frame()
        return np.arctan2(
            np.sum(direction * across, axis=-1), np.sum(direction * along, axis=-1)
        )

    def quadratic(self, cap: Cap, owner: np.ndarray, psi: np.ndarray) -> Quadratic:
        """``(1 - t^2) c.a + 2 t e.a >= cos kappa (1 + t^2)``, as A, B, C."""
        c, a, vers, cos = _of_owner(self.centre, cap, owner, psi)
        along, across = self._frame()
        lead, side = (np.sum(v * cap.axis, axis=1)[owner] for v in (along, across))
        lead, side = (v.reshape(v.shape + (1,) * (psi.ndim - v.ndim)) for v in (lead, side))
        dot = c[0] * a[0] + c[1] * a[1] + c[2] * a[2]
        gap = (c[0] - a[0]) ** 2 + (c[1] - a[1]) ** 2 + (c[2] - a[2]) ** 2
        b = 2.0 * (lead * np.cos(psi) + side * np.sin(psi))
        return -dot - cos + 0.0 * psi, b, vers - 0.5 * gap + 0.0 * psi

    def directions(
        self, owner: np.ndarray, psi: np.ndarray, t: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Directions ``(..., 3)``, and ``cos dw / (t dt dpsi) = 4 cos / (1 + t^2)^2``."""
        along, across = self._frame()
        c, u, v = self.centre[owner], along[owner], across[owner]
        s = 1.0 / (1.0 + t * t)
        cos, sin = (1.0 - t * t) * s, 2.0 * t * s
        e = np.cos(psi)[..., None] * u + np.sin(psi)[..., None] * v
        out = cos[..., None] * c + sin[..., None] * e
        out[..., 2] = np.maximum(out[..., 2], 0.0)
        return out, out[..., 2] * 4.0 * s * s


Chart = HalfVector | Polar


def _of_owner(
    vectors: np.ndarray, cap: Cap, owner: np.ndarray, psi: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Components of the owners' vectors, the axis, versine and cosine, for ``psi``."""
    extra = (1,) * (psi.ndim - owner.ndim)
    w = np.moveaxis(vectors[owner], -1, 0)
    w = w.reshape(w.shape + extra)
    vers, cos = (
        v if v.ndim == 0 else v[owner].reshape(owner.shape + extra)
        for v in (cap.versine, cap.cosine)
    )
    axis = cap.axis
    if axis.ndim > 1:
        axis = np.moveaxis(axis[owner], -1, 0)
        axis = axis.reshape(axis.shape + extra)
    return w, axis, vers, cos
