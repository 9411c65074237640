"""Phong: a power of the cosine around the mirror direction, for fits of older systems."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import AxisPeak, Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape


class Phong(Lobe):
    """``f = ks (n + 2) / (2 pi) max(r.wo, 0)^n``, ``r`` the mirror image of ``wi``.

    Phong 1975 in the normalisation of Lafortune and Willems 1994: the albedo at normal
    incidence is ``ks`` for every exponent. Towards grazing half of the lobe lies below the
    horizon and is lost. It is round around the mirror direction, where real lobes are
    narrower across the plane of incidence: a half-vector lobe fits measurements better.
    """

    NAME: ClassVar[str] = "phong"
    REFERENCE: ClassVar[str] = "Phong 1975; Lafortune and Willems 1994"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    RETRO: ClassVar[bool] = True

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "exponent", 20.0, (0.1, 1e8), "exponent of the cosine to the mirror",
                start=(2.0, 1e4),
            ),
            coefficient("ks", 0.5, "albedo of the lobe at normal incidence"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, n = geometry, shape["exponent"]
        across = g.wix * g.wox + g.wiy * g.woy
        cosine = g.cos_i * g.cos_o - across
        x, y, z = g.wix + g.wox, g.wiy + g.woy, g.cos_i - g.cos_o
        missing = 0.5 * (x * x + y * y + z * z)
        value = (n + 2.0) / (2.0 * jnp.pi) * power(cosine, missing, n)
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> AxisPeak:
        one = jnp.ones_like(shape["exponent"])
        return AxisPeak(-one, one, shape["exponent"])


def power(cosine: Array, missing: Array, exponent: Array) -> Array:
    """``max(cosine, 0)^exponent`` for a cosine that is also known as ``1 - missing``.

    Near the axis of a narrow lobe only ``missing`` has digits left, far from it only
    ``cosine`` (and XLA's `log1p` loses 7 bits below -0.3). A cosine that is not a normal
    number counts as zero.
    """
    shines = cosine > jnp.finfo(cosine.dtype).tiny
    near = shines & (missing < 0.25)
    far = shines & ~near
    log = jnp.where(
        near,
        jnp.log1p(-jnp.where(near, missing, 0.0)),
        jnp.log(jnp.where(far, cosine, 1.0)),
    )
    return jnp.where(shines, jnp.exp(exponent * log), 0.0)
