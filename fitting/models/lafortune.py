"""Lafortune: a cosine lobe around a direction of its own, mirror-like, off or backwards."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import AxisPeak, Lobe, Shape
from fitting.models.phong import power
from fitting.parameters import Parameter, coefficient, shape


class Lafortune(Lobe):
    """``f = ks (n + 2) / (2 pi) max(Cx (wix wox + wiy woy) + Cz cos_i cos_o, 0)^n``.

    Lafortune et al. 1997, eq. 8, isotropic, in the normalisation of Ngan et al. 2005. The
    paper's ``Cx = Cy, Cz`` and ``n`` are degenerate with the factor of the lobe, so the
    larger of the two is 1 here: ``(Cx, Cz) = (c_xy, 1) / max(|c_xy|, 1)``. ``c_xy = -1`` is
    Phong's mirror lobe, 1 the way back; between ``-1`` and 0 the lobe leans towards the
    normal, and beyond ``-1`` it leans over, as off-specular peaks do. The normaliser has a
    kink at ``|c_xy| = 1``: continuous, with a jump of the derivative by ``c_xy`` of ``n``
    times the value at the mirror direction of normal incidence. A sum of several lobes is
    written ``2*lafortune``.
    """

    NAME: ClassVar[str] = "lafortune"
    REFERENCE: ClassVar[str] = "Lafortune et al. 1997, eq. 8; Ngan et al. 2005"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "c_xy", -0.9, (-2.0, 2.0), "tangential factor relative to the normal one",
                scale="linear", start=(-1.3, 1.0),
            ),
            shape(
                "exponent", 20.0, (0.1, 1e8), "exponent of the cosine to the axis",
                start=(2.0, 1e3),
            ),
            coefficient("ks", 0.5, "factor of the lobe, at most its albedo"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, n = geometry, shape["exponent"]
        sign, c_xy, c_z = _factors(shape["c_xy"])
        along = sign * (g.wix * g.wox + g.wiy * g.woy)
        up = g.cos_i * g.cos_o
        # 1 - cosine, as half the squared distance to the mirror direction (or the way back)
        # and what the smaller factor takes: all that is subtracted is at most half of it.
        x, y, z = g.wix - sign * g.wox, g.wiy - sign * g.woy, g.cos_i - g.cos_o
        missing = 0.5 * (x * x + y * y + z * z) + (1.0 - c_xy) * along + (1.0 - c_z) * up
        value = power(c_xy * along + c_z * up, missing, n)
        value = (n + 2.0) / (2.0 * jnp.pi) * value
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> AxisPeak:
        sign, c_xy, c_z = _factors(shape["c_xy"])
        return AxisPeak(sign * c_xy, c_z, shape["exponent"])


def _factors(c_xy: Array) -> tuple[Array, Array, Array]:
    """Sign of ``c_xy``, and ``(|c_xy|, 1)`` divided by the larger of the two."""
    sign = jnp.where(c_xy < 0, -1.0, 1.0).astype(c_xy.dtype)
    size = sign * c_xy
    larger = jnp.maximum(size, 1.0)
    return sign, size / larger, 1.0 / larger
