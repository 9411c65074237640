"""RPV: bowl or bell shape, forward or back scatter and a hot spot, for land surfaces."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.geometry import Geometry
from fitting.models.lobe import Lobe, Shape
from fitting.parameters import Parameter, coefficient, shape

HORIZON = 1e-6


class RPV(Lobe):
    """``f = rho0 / pi (cos_i cos_o (cos_i + cos_o))^(k - 1) F (1 + (1 - rho_c)/(1 + D))``.

    Rahman, Pinty and Verstraete 1993, JGR 98: Minnaert's bowl (``k < 1``) or bell
    (``k > 1``), the Henyey-Greenstein function ``F = (1 - g^2) / (1 + g^2 + 2 g cos(xi))^
    (3/2)`` of the phase angle ``xi``, which scatters back for ``g < 0``, and a hot spot of
    ``D^2 = tan_i^2 + tan_o^2 - 2 tan_i tan_o cos(phi)``. Lambert for ``k = 1, g = 0,
    rho_c = 1``. For ``k < 1`` there is a pole at the horizon: cosines below 1e-6 count as
    1e-6 in the power. Nothing keeps the albedo below 1.
    """

    NAME: ClassVar[str] = "rpv"
    REFERENCE: ClassVar[str] = "Rahman, Pinty and Verstraete 1993, JGR 98"
    RECIPROCAL: ClassVar[bool] = True
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            shape(
                "k", 0.8, (0.3, 1.5), "exponent of the bowl (below 1) or bell (above)",
                scale="linear", start=(0.5, 1.1),
            ),
            shape(
                "g", -0.1, (-0.9, 0.9), "asymmetry, below 0 back to the source",
                scale="linear", start=(-0.5, 0.3),
            ),
            shape(
                "rho_c", 0.3, (0.0, 1.0), "1 less the height of the hot spot",
                scale="linear", start=(0.1, 0.9),
            ),
            coefficient("rho0", 0.2, "factor of the lobe"),
        )  # fmt: skip

    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        gm, k, g = geometry, shape["k"], shape["g"]
        up = gm.reflects
        cos_i, cos_o = jnp.where(up, gm.cos_i, 1.0), jnp.where(up, gm.cos_o, 1.0)
        raised_i, raised_o = jnp.maximum(cos_i, HORIZON), jnp.maximum(cos_o, HORIZON)
        minnaert = jnp.power(raised_i * raised_o * (raised_i + raised_o), k - 1.0)

        # Both sums of positive terms: 1 + g^2 + 2 g cos(xi), the one without cancellation.
        x, y, z = gm.wix - gm.wox, gm.wiy - gm.woy, gm.cos_i - gm.cos_o
        sin2_half = 0.25 * (x * x + y * y + z * z)
        back = (1.0 + g) ** 2 - 4.0 * g * sin2_half
        forward = (1.0 - g) ** 2 + 4.0 * g * gm.cos_d * gm.cos_d
        base = jnp.where(g < 0, back, forward)
        henyey = (1.0 - g) * (1.0 + g) / (base * jnp.sqrt(base))

        # 1 / (1 + D) with the tangents multiplied by the smaller cosine: no pole at the
        # horizon. A D below rounding is 0: its slope would overflow at the horizon.
        larger, smaller = jnp.maximum(cos_i, cos_o), jnp.minimum(cos_i, cos_o)
        x = (cos_o * gm.wix - cos_i * gm.wox) / larger
        y = (cos_o * gm.wiy - cos_i * gm.woy) / larger
        square = x * x + y * y
        apart = square > (jnp.finfo(x.dtype).eps * smaller) ** 2
        distance = jnp.where(apart, jnp.sqrt(jnp.where(apart, square, 1.0)), 0.0)
        level = jnp.where(up & (smaller + distance > 0), smaller + distance, 1.0)
        hot = 1.0 + (1.0 - shape["rho_c"]) * smaller / level
        return (jnp.where(up, minnaert * henyey * hot / np.pi, 0.0),)

    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        return coefficients

    def peak(self, shape: Shape) -> None:
        return None
