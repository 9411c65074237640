"""glTF: the metallic-roughness material of glTF 2.0, to hand one over to a viewer."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape

_FACETS = microfacet.Facets(ndf.ggx, shadowing.cos_lambda_ggx)


class GLTF(Lobe):
    """``f = (1 - m) ((1 - w F) base / pi + w F D V) + m D V (base + (1 - base) q)``.

    glTF 2.0, appendix B, with the extensions KHR_materials_ior and KHR_materials_specular:
    ``m = metallic``, ``w = specular``, ``q = (1 - cos_d)^5``, ``F = F0 + (1 - F0) q`` with
    ``F0 = ((ior - 1) / (ior + 1))^2``, and ``D V`` GGX of ``alpha = roughness^2`` with
    height-correlated masking. Fresnel's term is that of the half vector for the base, too:
    reciprocal, but what a grazing highlight reflects is not all taken from the base, and
    the albedo may exceed 1 there. The first basis function is multiplied by ``base_color``,
    linear reflectance; the second by 1.
    """

    NAME: ClassVar[str] = "gltf"
    REFERENCE: ClassVar[str] = "glTF 2.0, appendix B, Khronos 2021; KHR_materials_specular"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = False
    ALBEDO_BOUND: ClassVar[float | None] = None

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "metallic", 0.1, (0.0, 1.0), "share of metal", scale="linear",
                start=(0.0, 1.0),
            ),
            shape(
                "roughness", 0.4, (0.01, 1.0), "square root of the slope width",
                scale="linear", start=(0.1, 0.9),
            ),
            shape(
                "ior", 1.5, (1.01, 4.0), "index of refraction of the dielectric",
                scale="linear", start=(1.3, 2.0),
            ),
            shape(
                "specular", 0.9, (0.0, 1.0), "strength of the dielectric's highlight",
                scale="linear", start=(0.2, 1.0),
            ),
            coefficient(
                "base_color", 0.5, "linear reflectance of the base", support=(0.0, 1.0)
            ),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, up = geometry, geometry.reflects
        metal, body = shape["metallic"], 1.0 - shape["metallic"]
        width = {"alpha": shape["roughness"] ** 2}
        highlight = microfacet.single_scattering("correlated", _FACETS, width)(g)
        facing, rising = fresnel.split("schlick", shape, jnp.ones_like(g.cos_d), g.cos_d)
        root = (shape["ior"] - 1.0) / (shape["ior"] + 1.0)
        f0 = root * root
        # 1 - F = (1 - F0) (1 - q), which cancels nothing.
        left = (1.0 - shape["specular"]) + shape["specular"] * (1.0 - f0) * facing
        reflected = shape["specular"] * (f0 * facing + rising)
        with_base = body * left / jnp.pi + metal * facing * highlight
        without = highlight * (body * reflected + metal * rising)
        return jnp.where(up, with_base, 0.0), jnp.where(up, without, 0.0)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        (base,) = coefficients
        return base, jnp.ones_like(base)

    def peak(self, shape: Shape) -> SlopeWidths:
        """Half way, as a factor, between the highlight's width and a hemisphere's."""
        return microfacet.slope_widths({"alpha": shape["roughness"]})
