"""OpenPBR: the opaque base of OpenPBR 1.1, to hand a material over to a renderer."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models import fresnel, microfacet, ndf, shadowing
from fitting.models.eon import EON
from fitting.models.interfaced_lambert import transmittance
from fitting.models.lobe import Lobe, Shape, SlopeWidths
from fitting.parameters import Parameter, coefficient, shape

NODES = (16, 10)


class OpenPBR(Lobe):
    """``f = (1 - m) (f_spec + (1 - E_spec(wo)) f_diffuse) + m f_metal``.

    OpenPBR Surface 1.1 with ``m = base_metalness``: the slabs "glossy-diffuse" and "metal",
    without coat, fuzz, thin film, subsurface and transmission. Both highlights are GGX with
    ``alpha = specular_roughness^2`` and height-correlated shadowing, single scattering:

    - ``f_spec`` with the exact Fresnel reflectance for the index ``specular_ior``;
    - ``f_metal`` with ``base_color + (1 - base_color) (1 - cos_d)^5``, which is the
      specification's F82-tint where ``specular_color`` is 1;
    - ``f_diffuse`` is EON with ``base_color`` and ``base_diffuse_roughness``, see ``eon``.

    What the highlight takes away from the light is ``E_spec``, its directional albedo, seen
    from the detector alone (the specification's albedo scaling). The model is therefore not
    reciprocal, but loses no energy beyond single scattering. ``1 - E_spec`` is within
    3.2e-3 of the integral, see `passing`; so is the largest albedo of 1. No bound is
    declared, because it does not scale with ``base_color``: the highlight stays. The three
    basis functions are multiplied by ``base_color``, by EON's multiple scattering of it,
    and by 1.
    """

    NAME: ClassVar[str] = "openpbr"
    REFERENCE: ClassVar[str] = "OpenPBR Surface 1.1, Academy Software Foundation 2024"
    RECIPROCAL: ClassVar[bool] = False
    LINEAR: ClassVar[bool] = False
    ALBEDO_BOUND: ClassVar[float | None] = None
    PER_ANGLE: ClassVar[bool] = True

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "base_metalness", 0.1, (0.0, 1.0), "share of metal",
                scale="linear", start=(0.0, 1.0),
            ),
            shape(
                "base_diffuse_roughness", 0.3, (0.0, 1.0), "roughness of the diffuse base",
                scale="linear", start=(0.1, 0.9),
            ),
            shape(
                "specular_roughness", 0.3, (0.01, 1.0), "square root of the slope width",
                scale="linear", start=(0.1, 0.9),
            ),
            shape(
                "specular_ior", 1.5, (1.01, 4.0), "index of refraction of the dielectric",
                scale="linear", start=(1.3, 2.0),
            ),
            coefficient(
                "base_color", 0.5, "linear reflectance of the base", support=(0.0, 1.0)
            ),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, up = geometry, geometry.reflects
        metal, body = shape["base_metalness"], 1.0 - shape["base_metalness"]
        eta, alpha = shape["specular_ior"], shape["specular_roughness"] ** 2
        highlight = _highlight(alpha, g)
        facing, rising = fresnel.split("schlick", shape, highlight, g.cos_d)
        glossy = highlight * fresnel.dielectric(g.cos_d, eta)
        passes = jnp.where(up, body * _passing(g, alpha, eta), 0.0)
        single, multiple = EON().basis(_diffuse(shape), g)
        return (
            passes * single + metal * facing,
            passes * multiple,
            body * glossy + metal * rising,
        )

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        single, multiple = EON().amplitudes(_diffuse(shape), coefficients)
        return single, multiple, jnp.ones_like(single)

    def peak(self, shape: Shape) -> SlopeWidths:
        """Half way, as a factor, between the highlight's width and a hemisphere's."""
        return microfacet.slope_widths({"alpha": shape["specular_roughness"]})


def _diffuse(shape: Shape) -> dict[str, Array]:
    return {"roughness": shape["base_diffuse_roughness"]}


def _highlight(alpha: Array, g: Geometry) -> Array:
    """GGX without Fresnel, ``D V``, 1/sr."""
    up = g.reflects
    s = microfacet.stretched({"alpha": alpha}, g)
    cos_i, cos_o = jnp.where(up, g.cos_i, 1.0), jnp.where(up, g.cos_o, 1.0)

    def cos_lambda() -> tuple[Array, Array]:
        return (
            shadowing.cos_lambda_ggx(s.i2, cos_i),
            shadowing.cos_lambda_ggx(s.o2, cos_o),
        )

    v = shadowing.visibility("correlated", g, up, cos_lambda)
    return jnp.where(up, ndf.ggx(s.h2, jnp.where(up, g.hz, 1.0), s.area) * v, 0.0)


def _passing(g: Geometry, alpha: Array, eta: Array) -> Array:
    """`passing` at the detector; not at the source, which nobody asks for."""
    if g.polar is None:
        return passing(g.wox**2 + g.woy**2, g.cos_o, alpha, eta)
    return g.over_angles(lambda sine2, c: passing(sine2, c, alpha, eta))[1]


def passing(sine2: Array, cosine: Array, alpha: Array, eta: Array) -> Array:
    """``1 - E_spec``: what a rough dielectric highlight leaves for the base below.

    ``E_spec`` is the mean of ``F G2 / G1(o)`` over the facets that the detector sees.
    Stretched to ``alpha = 1`` these mirror the detector's direction ``v`` into the cap
    ``c_z > -v_z`` of the sphere, evenly (Dupuy and Benyoub 2023), so the mean is one over a
    cap: Gauss-Legendre with 16 nodes in the polar angle by 10 in the azimuth. Error below
    1.8e-3 up to ``eta = 2.5`` and 3.2e-3 up to 4, for all widths and directions. ``1 - F G2
    / G1`` is averaged as a sum of what is not negative, so that nothing cancels where the
    highlight takes nearly all.
    """
    alpha, eta = (jnp.broadcast_to(p, sine2.shape)[..., None, None] for p in (alpha, eta))
    mu = jnp.maximum(cosine, 0.0)[..., None, None]
    tilted = sine2 > 0
    sine = jnp.where(tilted, jnp.sqrt(jnp.where(tilted, sine2, 1.0)), 0.0)[..., None, None]
    length = jnp.sqrt((alpha * sine) ** 2 + mu * mu)
    vx, vz = alpha * sine / length, mu / length
    (x, rest, dx), (y, _, dy) = (_unit_nodes(n, mu.dtype) for n in NODES)
    end = jnp.arctan2(vx, -vz)
    theta, phi = end * x[:, None], jnp.pi * y
    sin_c = jnp.sin(theta)
    weight = sin_c * end * dx[:, None] * dy / (1.0 + vz)

    px, py = sin_c * jnp.cos(phi) + vx, sin_c * jnp.sin(phi)
    # cos(theta) + v_z, which is zero at the rim.
    pz = 2.0 * jnp.sin(0.5 * (end + theta)) * jnp.sin(0.5 * end * rest[:, None])
    flat2 = px * px + py * py
    norm = jnp.sqrt(alpha * alpha * flat2 + pz * pz)
    # wo.h = (v.c + 1) |stretched wo| / norm, and 2 (v.c + 1) = |v + c|^2.
    cos_d = 0.5 * length * (flat2 + pz * pz) / norm
    scale = 2.0 * cos_d / norm
    cos_i = scale * pz - mu
    seen = cos_i > 0
    cos_i = jnp.where(seen, cos_i, 1.0)
    ix, iy = scale * alpha * px - sine, scale * alpha * py
    i2 = alpha * alpha * (ix * ix + iy * iy)
    root = jnp.sqrt(i2 + cos_i * cos_i)
    below = mu * root + cos_i * length
    shadowed = mu * i2 / ((root + cos_i) * below)
    lit = cos_i * (mu + length) / below
    lost = jnp.where(seen, shadowed + lit * transmittance(cos_d, eta), 1.0)
    return jnp.sum(weight * lost, axis=(-2, -1))


def _unit_nodes(count: int, dtype) -> tuple[Array, Array, Array]:
    """Gauss-Legendre nodes on [0, 1], their distances from 1, and weights."""
    x, w = np.polynomial.legendre.leggauss(count)
    x = 0.5 * (x + 1.0)
    return jnp.asarray(x, dtype), jnp.asarray(1.0 - x, dtype), jnp.asarray(0.5 * w, dtype)
