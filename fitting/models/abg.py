"""ABg: scatter of polished optics and smooth coatings, a shoulder and a power-law skirt."""

from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape


class ABg(Lobe):
    """``f = A / (B + |beta - beta_0|^g) = b0 / (1 + (|beta - beta_0| / shoulder)^g)``.

    ``|beta - beta_0|`` is the distance of the scattered from the mirror direction, both
    projected on the surface: ``|xy(wi) + xy(wo)| = 2 cos_d sin(theta_h)``. Optical design
    programs ask for ``B = shoulder^g`` and ``A = b0 B``. Here the height ``b0`` and the
    ``shoulder`` at half of it are fitted, because ``B`` and ``g`` are nearly the same to
    data that do not reach the shoulder. No shadowing and no Fresnel term.

    Source: Pfisterer 2011, "Approximated scatter models for stray light analysis".
    """

    NAME: ClassVar[str] = "abg"
    REFERENCE: ClassVar[str] = "Pfisterer 2011, the ABg model of optical design programs"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = math.pi

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "shoulder", 0.01, (1e-5, 1.0), "|beta - beta_0| where f falls to b0 / 2",
                start=(1e-3, 0.3),
            ),
            shape(
                "g", 2.0, (0.5, 4.0), "fall of the skirt, |beta - beta_0|^-g",
                scale="linear", start=(1.0, 3.0),
            ),
            coefficient("b0", 1.0, "BRDF in the mirror direction", unit="1/sr"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        per_shoulder = 2.0 * g.cos_d / shape["shoulder"]
        u = (per_shoulder * g.hx) ** 2 + (per_shoulder * g.hy) ** 2
        # The power is taken of 1 at the peak, where its slope is infinite for g < 1.
        off = u > 0
        power = 0.5 * shape["g"] * jnp.log(jnp.where(off, u, 1.0))
        value = jnp.where(off, jax.nn.sigmoid(-power), 1.0)
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return power_law_peak(shape["shoulder"], shape["g"])


def power_law_peak(shoulder: Array, fall: Array) -> SlopeWidths:
    """Nodes for a lobe that is flat up to ``shoulder`` and then goes as ``r^-fall``.

    The energy within ``r`` grows as ``r^(2 - fall)``: for steep skirts it lies at the
    shoulder, for flat ones at the horizon, and at 2 it is spread over all decades between.
    """
    alpha = shoulder ** jax.nn.sigmoid(2.0 * (fall - 2.0))
    return SlopeWidths(alpha, alpha, jnp.zeros_like(alpha))
