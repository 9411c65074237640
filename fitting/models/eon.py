"""EON: Oren-Nayar that loses no energy, the recommended diffuse base of rough surfaces."""

from __future__ import annotations

import math
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape

C1 = 0.5 - 2.0 / (3.0 * math.pi)
C2 = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


class EON(Lobe):
    """``f = rho / pi A (1 + r s / t) + rho_ms / pi (1 - E(i)) (1 - E(o)) / (1 - Ebar)``.

    Energy-preserving Oren-Nayar of Portsmouth, Kutz and Hill 2025 (JCGT 14(1)), with
    ``rho = albedo`` and ``r = roughness``: ``A = 1 / (1 + c1 r)``, ``s = wi.wo - cos_i
    cos_o``, ``t = max(cos_i, cos_o)`` where ``s > 0`` and 1 elsewhere,
    ``E(mu) = A (1 + r G(mu) / pi)``, ``Ebar = A (1 + c2 r)`` and ``rho_ms = rho^2 Ebar /
    (1 - rho (1 - Ebar))``. It has the albedo 1 in every direction at ``rho = 1``; ``rho``
    is the albedo of a facet, above that of the surface for ``r > 0``.

    ``rho`` enters nonlinearly: the two basis functions are the single and the multiple
    scattering, with the amplitudes ``rho`` and ``rho_ms``.
    """

    NAME: ClassVar[str] = "eon"
    REFERENCE: ClassVar[str] = "Portsmouth, Kutz and Hill 2025, JCGT 14(1)"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = False
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "roughness", 0.5, (0.0, 1.0), "roughness r, from 0 (Lambert) to 1",
                scale="linear", start=(0.1, 0.9),
            ),
            coefficient(
                "albedo", 0.5, "single-scattering albedo of a facet", support=(0.0, 1.0)
            ),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, r = geometry, shape["roughness"]
        up = g.reflects
        a = 1.0 / (1.0 + C1 * r)
        s = g.wix * g.wox + g.wiy * g.woy
        larger = jnp.where(up, jnp.maximum(g.cos_i, g.cos_o), 1.0)
        # 1 + s = 2 cos_d^2 - cos_i cos_o cancels nothing, and is never negative.
        away = (1.0 - r) + r * (2.0 * g.cos_d * g.cos_d - g.cos_i * g.cos_o)
        single = jnp.where(s > 0, 1.0 + r * jnp.where(s > 0, s, 0.0) / larger, away)
        # With 1 - E = A r k and 1 - Ebar = A r (c1 - c2) one r cancels: regular at r = 0.
        k_i, k_o = _missing(g.wix, g.wiy, g.cos_i), _missing(g.wox, g.woy, g.cos_o)
        multiple = r * k_i * k_o / (C1 - C2)
        scale = a / jnp.pi
        return jnp.where(up, scale * single, 0.0), jnp.where(up, scale * multiple, 0.0)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        """``rho, rho_ms``; above ``rho = 1`` the latter goes on along its tangent."""
        (rho,) = coefficients
        r = shape["roughness"]
        lost = (C1 - C2) * r / (1.0 + C1 * r)
        inside = jnp.minimum(rho, 1.0)
        slope = 2.0 + lost / (1.0 - lost)
        beyond = slope * jnp.maximum(rho - 1.0, 0.0)
        return rho, inside**2 * (1.0 - lost) / (1.0 - inside * lost) + beyond

    def peak(self, shape: Shape) -> None:
        return None


def _missing(x: Array, y: Array, mu: Array) -> Array:
    """``k = c1 - G(mu) / pi``, so that ``1 - E(mu) = A r k``.

    The paper's ``G`` cancels against ``c1`` towards grazing. With ``S = sin(theta)``,
    ``1 - S = mu^2 / (1 + S)`` and ``theta = pi/2 - asin(mu)`` every difference left is
    benign and ``k`` keeps its digits down to ``k = 0`` at ``mu = 0``.
    """
    s2 = x * x + y * y
    tilted = s2 > 0
    s = jnp.where(tilted, jnp.sqrt(jnp.where(tilted, s2, 1.0)), 0.0)
    third = (2.0 / 3.0) * mu * (1.0 + s + s * s) / (1.0 + s)
    rest = s * (jnp.arctan2(mu, s) + s * mu - third)
    return C1 * mu * mu / (1.0 + s) + rest / math.pi
