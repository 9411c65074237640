"""ABC smooth: scatter of smooth surfaces with a Fresnel term, for gloss with a skirt."""

from __future__ import annotations

import math
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.abg import power_law_peak
from fitting.models.fresnel import dielectric
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape


class ABCSmooth(Lobe):
    """``f = a F(cos_t; eta) / (1 + b |xy(wi) + xy(wo)|^2)^c``.

    Low et al. 2012, the smooth-surface model, whose published fits it evaluates: the ABC
    power spectrum of Rayleigh-Rice scatter, with the exact reflectance ``F`` of a
    dielectric at ``cos_t^2 = 1 - |xy(wi) - xy(wo)|^2 / 4``. That is the half angle
    between the directions where both have the same polar angle, as near the peak.
    Nothing keeps its albedo below 1.
    """

    NAME: ClassVar[str] = "abc_smooth"
    REFERENCE: ClassVar[str] = "Low et al. 2012, ACM TOG 31(1), the smooth-surface model"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = math.pi

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "b", 1e3, (1.0, 1e8), "inverse square of the shoulder", start=(10.0, 1e6)
            ),
            shape(
                "c", 1.0, (0.01, 4.0), "fall of the skirt, |beta - beta_0|^(-2 c)",
                start=(0.3, 2.0),
            ),
            shape(
                "eta", 1.5, (1.01, 100.0), "index of refraction relative to the outside",
                start=(1.3, 3.0),
            ),
            coefficient("a", 1.0, "BRDF in the mirror direction for F = 1", unit="1/sr"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        length = 2.0 * g.cos_d
        q = (length * g.hx) ** 2 + (length * g.hy) ** 2
        power = jnp.exp(-shape["c"] * jnp.log1p(shape["b"] * q))
        # The paper's difference from 1 is also a sum, which cancels nothing at grazing.
        lean = 0.5 * (g.cos_i - g.cos_o)
        square = g.cos_d * g.cos_d + lean * lean
        known = g.reflects & (square > 0)
        cos_t = jnp.sqrt(jnp.where(known, square, 1.0))
        return (jnp.where(g.reflects, power * dielectric(cos_t, shape["eta"]), 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return power_law_peak(shape["b"] ** -0.5, 2.0 * shape["c"])
