"""Interfaced Lambert ("plastic"): a matt body under a smooth clear surface."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


class InterfacedLambert(Lobe):
    """``f = (1 - F(cos_i)) (1 - F(cos_o)) rho / (pi eta^2 (1 - rho K))``.

    A Lambertian body of albedo ``rho`` seen through a smooth dielectric interface of index
    ``eta``, with all reflections between the two: ``K = 1 - (1 - Fbar) / eta^2`` is the
    mean internal reflectance (Saunderson 1942) and ``Fbar = 2 int F c dc`` the mean
    external one. The reflection of the interface itself is another lobe; its albedo ``F``
    and this one's, ``(1 - F) (1 - K) rho / (1 - rho K)``, add up to 1 at ``rho = 1``.

    ``rho`` enters nonlinearly, with the amplitude ``rho / (1 - rho K)``.
    """

    NAME: ClassVar[str] = "interfaced_lambert"
    REFERENCE: ClassVar[str] = "Saunderson 1942; Wolff 1994"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = False
    ALBEDO_BOUND: ClassVar[float | None] = 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "eta", 1.5, (1.01, 4.0), "index of refraction relative to the outside",
                scale="linear", start=(1.3, 2.0),
            ),
            coefficient("albedo", 0.5, "albedo of the body", support=(0.0, 1.0)),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        g, eta = geometry, shape["eta"]
        cos_i = jnp.where(g.reflects, g.cos_i, 0.0)
        cos_o = jnp.where(g.reflects, g.cos_o, 0.0)
        both = transmittance(cos_i, eta) * transmittance(cos_o, eta)
        return (both / (jnp.pi * eta * eta),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        """``rho / (1 - rho K)``; above ``rho = 1`` it goes on along its tangent."""
        (rho,) = coefficients
        eta = shape["eta"]
        escaping = mean_transmittance(eta) / (eta * eta)
        inside = jnp.minimum(rho, 1.0)
        # 1 - rho K with K = 1 - escaping, as a sum of what is not negative.
        below = (1.0 - inside) + inside * escaping
        beyond = jnp.maximum(rho - 1.0, 0.0) / (escaping * escaping)
        return (inside / below + beyond,)

    def peak(self, shape: Shape) -> None:
        return None


def transmittance(cosine: Array, eta: Array) -> Array:
    """``1 - F`` of a smooth dielectric from outside, unpolarised, for ``eta > 1``.

    ``2 c g (1 / (c + g)^2 + eta^2 / (eta^2 c + g)^2)`` with ``g^2 = eta^2 - 1 + c^2``: what
    Fresnel's amplitudes leave over, without the difference that cancels at grazing.
    """
    eta2 = eta * eta
    g = jnp.sqrt((eta - 1.0) * (eta + 1.0) + cosine * cosine)
    across, along = cosine + g, eta2 * cosine + g
    return 2.0 * cosine * g * (1.0 / (across * across) + eta2 / (along * along))


def mean_transmittance(eta: Array) -> Array:
    """``1 - Fbar = 2 int (1 - F) c dc`` over ``c`` in [0, 1]; within 1e-12.

    With ``c = sqrt(eta^2 - 1) sinh(t)`` the integrand is rational in ``exp(t)``, and 16
    Gauss-Legendre nodes in ``t`` reach rounding. Walsh's closed form (1926) cancels
    wherever ``eta`` is near 1.
    """
    root = jnp.sqrt((eta - 1.0) * (eta + 1.0))
    end = jnp.arcsinh(1.0 / root)
    x = jnp.asarray(0.5 * (_NODES + 1.0), root.dtype).reshape(-1, *(1,) * root.ndim)
    w = jnp.asarray(0.5 * _WEIGHTS, root.dtype).reshape(x.shape)
    c, dc = root * jnp.sinh(end * x), root * jnp.cosh(end * x) * end * w
    return jnp.sum(2.0 * transmittance(c, eta) * c * dc, axis=0)
