"""What a plate reflects and transmits: two smooth faces and what is lost between them."""

from __future__ import annotations

from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array

from fitting.models.fresnel import dielectric_terms
from fitting.parameters import Parameter, coefficient, shape

Polarisation = Literal["kept", "mixed"]


def parameters() -> tuple[Parameter, ...]:
    """Index and absorption of a plate."""
    return (
        shape(
            "eta", 1.5, (1.01, 4.0), "index of the plate relative to its surroundings",
            scale="linear", start=(1.3, 2.0),
        ),
        shape(
            "optical_depth", 0.1, (0.0, 20.0), "-ln of the internal transmittance at 0 deg",
            scale="linear", start=(0.0, 1.0),
        ),
    )  # fmt: skip


def factors() -> tuple[Parameter, ...]:
    """What multiplies the reflected and the transmitted light of a clear interface."""
    return (
        coefficient("reflected", 1.0, "factor of the reflected light, 1 for a clear one"),
        coefficient("transmitted", 1.0, "factor of the transmitted light, likewise"),
    )


def reflected_and_transmitted(
    cos_d: Array, eta: Array, depth: Array, polarisation: Polarisation = "kept"
) -> tuple[Array, Array]:
    """Reflectance and transmittance of a plate, all orders inside, without interference.

    With the reflectance ``F`` of a face and the internal transmittance ``t = exp(-depth /
    cos_t)``, ``cos_t`` being the cosine inside::

        T = (1 - F)^2 t / (1 - F^2 t^2)        R = F + F (1 - F)^2 t^2 / (1 - F^2 t^2)

    which is ``T = (1 - F) / (1 + F)`` and ``R = 2 F / (1 + F)`` without absorption. The
    faces see each polarisation apart, and unpolarised light is the mean of the two; with
    ``mixed`` the mean is taken of ``F``, as renderers do (Mitsuba's ``thindielectric``),
    which is off by some percent of R around 60 degrees.

    Source: Born and Wolf, sec. 1.6.4, summed over intensities; Stokes 1862.
    """
    both = dielectric_terms(cos_d, eta)
    path = depth / both.cos_t
    if polarisation == "mixed":
        return _plate(both.reflected, both.transmitted, path)
    s = _plate(both.reflected_s, both.transmitted_s, path)
    p = _plate(both.reflected_p, both.transmitted_p, path)
    return 0.5 * (s[0] + p[0]), 0.5 * (s[1] + p[1])


def _plate(f: Array, enters: Array, path: Array) -> tuple[Array, Array]:
    """By reflectance and transmittance of one face, ``enters = 1 - f``."""
    inside = jnp.exp(-path)
    # 1 - f t without cancellation; it vanishes with `enters` where nothing is absorbed.
    left = inside * enters - jnp.expm1(-path)
    some = left > 0
    share = jnp.where(some, enters, 1.0) / jnp.where(some, left, 1.0)
    through = enters * inside * share / (1.0 + f * inside)
    return f * (1.0 + through * inside), through
