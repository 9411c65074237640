"""A polished plate as a goniometer sees it: the specular beams, as wide as its aperture."""

from __future__ import annotations

import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import slab
from fitting.models.lobe import Lobe, Passage, Shape, SlopeWidths, Way
from fitting.parameters import Parameter, shape


class SmoothSlab(Lobe):
    """``f = R K`` and ``f = T K`` with ``K = exp(-q / width^2) / (pi width^2)``.

    ``R`` and ``T`` are those of `slab`; the beams are widened by a Gaussian of ``q =
    |beta_i + beta_o|^2``, the squared distance of the direction cosines to the mirror
    direction, and to the way straight on, which have the same ones. ``width`` is that of
    the instrument: of the beam and the aperture together. As ``width`` goes to 0 it is the
    smooth plate, whose hemispherical reflectance and transmittance are ``R`` and ``T``.
    They are taken at ``cos^2 = 1 - |beta_i - beta_o|^2 / 4``, which is the same from both
    ends. Alike from both sides.
    """

    NAME: ClassVar[str] = "smooth_slab"
    REFERENCE: ClassVar[str] = "Born and Wolf, sec. 1.5.2 and 1.6.4"
    WAYS: ClassVar[tuple[Way, ...]] = ("front", "back", "down", "up")
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    polarisation: slab.Polarisation = eqx.field(static=True, default="kept")

    def parameters(self) -> tuple[Parameter, ...]:
        width = shape(
            "width", 0.01, (1e-4, 0.3), "of the instrument, in direction cosines",
            start=(1e-3, 0.1),
        )  # fmt: skip
        return (width, *slab.parameters(), *slab.factors())

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, _ = geometry.from_front
        width = shape["width"]
        length = 2.0 * g.cos_d / width
        q = (length * g.hx) ** 2 + (length * g.hy) ** 2
        # Beyond this the exponential underflows, and its derivatives with it.
        near = q < -0.9 * math.log(jnp.finfo(q.dtype).tiny)
        kernel = jnp.where(near, jnp.exp(-jnp.where(near, q, 0.0)), 0.0)
        kernel = kernel / (jnp.pi * width * width)
        lean = 0.5 * (g.cos_i - g.cos_o)
        square = g.cos_d * g.cos_d + lean * lean
        some = square > 0
        cos = jnp.where(some, jnp.sqrt(jnp.where(some, square, 1.0)), 0.0)
        r, t = slab.reflected_and_transmitted(
            cos, shape["eta"], shape["optical_depth"], self.polarisation
        )
        return (
            jnp.where(g.reflects, kernel * r, 0.0),
            jnp.where(g.transmits, kernel * t, 0.0),
        )

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        # The slope of the half vector is half of the distance, at normal incidence.
        half = 0.5 * shape["width"]
        return SlopeWidths(half, half, jnp.zeros_like(half))

    def passage(self, shape: Shape) -> Passage:
        return Passage(self.peak(shape))
