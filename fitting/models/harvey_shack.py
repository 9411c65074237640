"""Harvey-Shack: scatter of polished optics, also over wavelengths (option spectral)."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.abg import power_law_peak
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, given, shape

REFERENCE_NM = 550.0


class HarveyShack(Lobe):
    """``f = b0 (1 + |beta - beta_0|^2 / shoulder^2)^(slope / 2)``.

    ``|beta - beta_0| = |xy(wi) + xy(wo)| = 2 cos_d sin(theta_h)``, as for `abg`. With the
    option ``spectral`` one surface serves all wavelengths: Rayleigh-Rice scatter has the
    shape of the surface's power spectrum at the spatial frequency ``|beta - beta_0| / l``
    and goes with ``l^-4``, so that ``b0`` and ``shoulder`` hold at ``l0 = 550 nm`` and
    ``f = b0 (l0 / l)^4 (1 + (|beta - beta_0| l0 / (l shoulder))^2)^(slope / 2)``.
    No obliquity factor and no Fresnel term.

    Source: Harvey 1976, the shift-invariant profile; Stover 2012, "Optical Scattering",
    for Rayleigh-Rice.
    """

    NAME: ClassVar[str] = "harvey_shack"
    REFERENCE: ClassVar[str] = "Harvey 1976; Stover 2012 for the scaling with wavelength"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None

    spectral: bool = eqx.field(static=True, default=False)

    def parameters(self) -> tuple[Parameter, ...]:
        own = (
            shape(
                "shoulder", 0.01, (1e-5, 1.0), "|beta - beta_0| where the skirt begins",
                start=(1e-3, 0.3),
            ),
            shape(
                "slope", -2.0, (-6.0, -0.1), "exponent of |beta - beta_0| in the skirt",
                scale="linear", start=(-3.0, -1.0),
            ),
            coefficient("b0", 1.0, "BRDF in the mirror direction", unit="1/sr"),
        )  # fmt: skip
        if not self.spectral:
            return own
        wavelength = given(
            "wavelength", REFERENCE_NM, (100.0, 20000.0), "wavelength of the channel",
            unit="nm",
        )  # fmt: skip
        return (wavelength, *own)

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g = geometry
        per_shoulder = 2.0 * g.cos_d / self._shoulder(shape)
        u = (per_shoulder * g.hx) ** 2 + (per_shoulder * g.hy) ** 2
        value = jnp.exp(0.5 * shape["slope"] * jnp.log1p(u))
        if self.spectral:
            value = (REFERENCE_NM / shape["wavelength"]) ** 4 * value
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return power_law_peak(self._shoulder(shape), -shape["slope"])

    def _shoulder(self, shape: Shape) -> Array:
        """The shoulder at the wavelength of the channel."""
        if not self.spectral:
            return shape["shoulder"]
        return shape["shoulder"] * (shape["wavelength"] / REFERENCE_NM)
