"""How much light a user's radiance distribution sends through a beam."""

from __future__ import annotations

import math

import numpy as np

from fitting.reflectance.adapt import Sampled, integrate
from fitting.reflectance.beams import Beam, Conical
from fitting.reflectance.charts import Polar
from fitting.reflectance.nested import Radiance, radiance_at
from fitting.reflectance.region import cap_of, caps_of

_TOLERANCE = 1e-10
_MOST = 4_000_000


def irradiance(beam: Beam, radiance: Radiance) -> float:
    """``int L cos dw`` over a cone or hemisphere, to 1e-10."""
    axis, scale = np.array([[0.0, 0.0, 1.0]]), 1.0
    if isinstance(beam, Conical):
        axis = cap_of(beam, "cut").axis[None]
        scale = math.tan(0.5 * math.radians(beam.half_angle_deg))

    def integrand(_: np.ndarray, direction: np.ndarray) -> Sampled:
        value = radiance_at(radiance, direction.reshape(-1, 3))
        return Sampled(value.reshape(*direction.shape[:-1], 1, 1))

    found = integrate(
        Polar(axis, np.zeros(1), scale), caps_of(beam), integrand, np.ones((1, 1)),
        tolerance=_TOLERANCE, most=_MOST,
    )  # fmt: skip
    return float(found.value[0, 0, 0])
