"""A thin plate with rough faces, the same medium on both sides: foil, film, window."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import microfacet, slab
from fitting.models.lobe import Lobe, Passage, Shape, SlopeWidths, Way
from fitting.models.microfacet import ALPHA_SUPPORT
from fitting.models.rough_dielectric import FACETS, Distribution
from fitting.parameters import Parameter
from fitting.parameters import shape as shape_parameter


class ThinSlab(Lobe):
    """Facets that reflect and transmit like a plate, ``R`` and ``T`` of `slab`::

        f_r = D(h) R(cos_d) G2 / (4 cos_i cos_o)
        f_t = D(h') T(cos_d') G2 / (4 cos_i |cos_o|)

    with ``h', cos_d'`` of the detector mirrored at the surface: light goes straight on,
    widened as much as it is in reflection, or by ``alpha_t`` with the option
    ``two_widths``. Alike from both sides. Burley 2015 (thin surfaces) takes ``alpha_t =
    ((0.65 eta - 0.35) sqrt(alpha))^2``. Single scattering.
    """

    NAME: ClassVar[str] = "thin_slab"
    REFERENCE: ClassVar[str] = "Burley 2015, thin surfaces; Walter et al. 2007, eq. 20"
    WAYS: ClassVar[tuple[Way, ...]] = ("front", "back", "down", "up")
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = 1.0
    PER_ANGLE: ClassVar[bool] = True

    distribution: Distribution = eqx.field(static=True, default="ggx")
    polarisation: slab.Polarisation = eqx.field(static=True, default="kept")
    two_widths: bool = eqx.field(static=True, default=False)

    @property
    def albedo_bound(self) -> float:
        """1; with two widths each part is below 1, at different angles of its facets."""
        return 2.0 if self.two_widths else 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        widths = microfacet.width_parameters(False)
        if self.two_widths:
            through = shape_parameter(
                "alpha_t", 0.1, ALPHA_SUPPORT, "slope width for transmitted light",
                start=(0.01, 1.0),
            )  # fmt: skip
            widths = (*widths, through)
        return (*widths, *slab.parameters(), *slab.factors())

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        front, _ = geometry.from_front
        straight = front.unfolded
        reflected, _ = self._plate(shape, front.cos_d)
        _, transmitted = self._plate(shape, straight.cos_d)
        facets = FACETS[self.distribution]
        wide = {**shape, "alpha": shape["alpha_t"]} if self.two_widths else shape
        at_front = microfacet.single_scattering("uncorrelated", facets, shape)(front)
        through = microfacet.single_scattering("uncorrelated", facets, wide)(straight)
        # Unfolded, what is reflected along the horizon would count a second time.
        return (
            at_front * reflected,
            jnp.where(geometry.transmits, through * transmitted, 0.0),
        )

    def _plate(self, shape: Shape, cos_d: Array) -> tuple[Array, Array]:
        return slab.reflected_and_transmitted(
            cos_d, shape["eta"], shape["optical_depth"], self.polarisation
        )

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> SlopeWidths:
        return microfacet.slope_widths(shape)

    def passage(self, shape: Shape) -> Passage:
        alpha = shape["alpha_t"] if self.two_widths else shape["alpha"]
        return Passage(microfacet.slope_widths({"alpha": alpha}))
