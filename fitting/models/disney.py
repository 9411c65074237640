"""Disney: the principled model of 2012, to hand a material over to a renderer."""

from __future__ import annotations

import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf
from fitting.models.burley import rim
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape

SMALLEST_WIDTH = 1e-3
COAT_F0 = 0.04
COAT_MASKING_WIDTH = 0.25
FLOOR = 1e-6


class Disney(Lobe):
    """``f = (1 - m) (mix(fd, ss) base / pi + sheen q) + D G F + clearcoat / 4 Dc Gc Fc``.

    Burley 2012, section 5, with the masking of its revision of 2014 and of the published
    program: separable Smith terms of the same width as the distribution. Per channel and
    without the two tints, because a channel has no hue. With ``m = metallic`` and ``q =
    (1 - cos_d)^5``:

    - ``fd``: Burley's diffuse base, see the lobe ``burley``; ``ss = 1.25 (s_i s_o (1 /
      (cos_i + cos_o) - 1/2) + 1/2)`` with ``s = 1 + (roughness cos_d^2 - 1) (1 - cos)^5``.
    - ``D``: GGX with ``alpha_x = r^2 / a, alpha_y = r^2 a`` (at least 1e-3), ``a^2 = 1 -
      0.9 anisotropic``; ``F = F0 (1 - q) + q``, ``F0 = mix(0.08 specular, base, m)``.
    - ``Dc``: GTR with exponent 1 and the width ``mix(0.1, 0.001, clearcoat_gloss)``;
      ``Gc`` with the width 0.25; ``Fc`` with 0.04 for ``F0``.

    The first basis function is multiplied by ``base_color``, linear reflectance and no
    screen value; the second by 1. It does not conserve energy, and ``ss`` has a pole where
    both directions are horizontal: the sum of the cosines is taken as at least 1e-6.
    """

    NAME: ClassVar[str] = "disney"
    REFERENCE: ClassVar[str] = "Burley 2012, section 5, revised 2014"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = False
    ALBEDO_BOUND: ClassVar[float | None] = None

    anisotropic: bool = eqx.field(static=True, default=False)

    def parameters(self) -> tuple[Parameter, ...]:
        turned = (
            _share("anisotropic", 0.3, "how much longer the highlight is than wide"),
            shape(
                "angle", 0.4, (0.0, math.pi), "azimuth of the tangent",
                unit="rad", scale="periodic", start=(0.0, math.pi),
            ),
        )  # fmt: skip
        return (
            _share("metallic", 0.1, "share of metal"),
            _share("subsurface", 0.1, "share of the flat subsurface base in the diffuse"),
            _share("specular", 0.5, "reflectance at normal incidence, 0.08 at 1"),
            _share("roughness", 0.5, "square root of the slope width", start=(0.1, 0.9)),
            *(turned if self.anisotropic else ()),
            _share("sheen", 0.1, "bright rim of cloth"),
            _share("clearcoat", 0.1, "strength of the second highlight"),
            _share("clearcoat_gloss", 0.5, "sharpness of the second highlight"),
            coefficient(
                "base_color", 0.5, "linear reflectance of the base", support=(0.0, 1.0)
            ),
        )

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, up = geometry, geometry.reflects
        cos_i, cos_o = jnp.where(up, g.cos_i, 1.0), jnp.where(up, g.cos_o, 1.0)
        metal, body = shape["metallic"], 1.0 - shape["metallic"]
        d2, one = g.cos_d * g.cos_d, jnp.ones_like(g.cos_d)

        at_grazing = shape["roughness"] * d2
        f90 = 0.5 + 2.0 * at_grazing
        diffuse = rim(f90, cos_i) * rim(f90, cos_o)
        flat = rim(at_grazing, cos_i) * rim(at_grazing, cos_o)
        total = jnp.maximum(cos_i + cos_o, FLOOR)
        under = 1.25 * (flat * (1.0 / total - 0.5) + 0.5)
        mixed = diffuse * (1.0 - shape["subsurface"]) + under * shape["subsurface"]

        widths = _widths(shape)
        s = microfacet.stretched(widths, g)
        highlight = ndf.ggx(s.h2, jnp.where(up, g.hz, 1.0), s.area)
        highlight = highlight * _masking(s.i2, cos_i) * _masking(s.o2, cos_o)
        facing, rising = fresnel.split("schlick", shape, one, g.cos_d)

        specular = 0.08 * shape["specular"] * body * facing + rising
        coat = (COAT_F0 * facing + rising) * _coat(
            shape["clearcoat_gloss"], g, cos_i, cos_o
        )
        with_base = body * mixed / jnp.pi + metal * facing * highlight
        without = (
            body * shape["sheen"] * rising
            + specular * highlight
            + 0.25 * shape["clearcoat"] * coat
        )
        return jnp.where(up, with_base, 0.0), jnp.where(up, without, 0.0)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        (base,) = coefficients
        return base, jnp.ones_like(base)

    def peak(self, shape: Shape) -> SlopeWidths:
        """Half way, as a factor, between the highlight's widths and a hemisphere's."""
        widths = _widths(shape)
        roots = {n: jnp.sqrt(v) for n, v in widths.items() if n != "angle"}
        return microfacet.slope_widths({**widths, **roots})


def _share(
    name: str, default: float, meaning: str, start: tuple[float, float] = (0.0, 1.0)
) -> Parameter:
    return shape(name, default, (0.0, 1.0), meaning, scale="linear", start=start)


def _widths(shape: Shape) -> dict[str, Array]:
    """The slope widths under the names that all lobes around the half vector use."""
    r2 = shape["roughness"] ** 2
    if "anisotropic" not in shape:
        return {"alpha": jnp.maximum(r2, SMALLEST_WIDTH)}
    # 1 - 0.9 x, without its rounding at x = 1.
    aspect = jnp.sqrt(0.1 + 0.9 * (1.0 - shape["anisotropic"]))
    return {
        "alpha_x": jnp.maximum(r2 / aspect, SMALLEST_WIDTH),
        "alpha_y": jnp.maximum(r2 * aspect, SMALLEST_WIDTH),
        "angle": shape["angle"],
    }


def _masking(t2: Array, cosine: Array) -> Array:
    """Smith's ``G1 / (2 cos)`` of GGX, with ``t2`` the squared stretched tangent part."""
    return 1.0 / (cosine + jnp.sqrt(t2 + cosine * cosine))


def _coat(gloss: Array, g: Geometry, cos_i: Array, cos_o: Array) -> Array:
    """``D G`` of the clear coat: ``D = (a^2 - 1) / (pi ln(a^2) (s2h + a^2 ch^2))``."""
    a = 0.1 * (1.0 - gloss) + 1e-3 * gloss
    a2 = a * a
    d = (a2 - 1.0) / (jnp.pi * jnp.log(a2) * (g.hx * g.hx + g.hy * g.hy + a2 * g.hz * g.hz))
    m2 = COAT_MASKING_WIDTH**2
    of_i = _masking(m2 * (g.wix * g.wix + g.wiy * g.wiy), cos_i)
    of_o = _masking(m2 * (g.wox * g.wox + g.woy * g.woy), cos_o)
    return d * of_i * of_o
