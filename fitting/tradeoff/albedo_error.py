"""How far the directional albedo of a fit is from that of the data."""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np

from data_formats import Measurement, MeasurementError
from fitting.reflectance.beams import Directional, Hemispherical
from fitting.reflectance.measured import measured
from fitting.reflectance.rows import Missing, incidences
from fitting.result import FitResult

_LARGEST_THETA_DEG = 89.0


class AlbedoError(msgspec.Struct, frozen=True):
    """Albedo of the fit less that of the data, both by the same sums over the rows.

    ``rms`` and ``worst`` are over the angles of incidence, channels and ways of light,
    absolute (an albedo is a share of the light); ``theta_i_deg`` is where the worst is.
    """

    rms: float
    worst: float
    theta_i_deg: float
    angles: int


def albedo_error(measurement: Measurement, result: FitResult) -> AlbedoError | None:
    """The error at every angle of incidence whose rows can be summed; None without any.

    The fit is evaluated at the rows and summed as they are, so that neither the sampling
    nor what lies between the rows counts as an error of the fit; rows that are not valid
    in a channel count in neither sum.
    """
    m = measurement
    fitted = result.evaluate(m.theta_i, m.phi_i, m.theta_r, m.phi_r)
    fitted = np.broadcast_to(fitted, m.value.shape)
    known = np.isfinite(fitted).all(axis=1)
    data = m.select(known)
    model = dataclasses.replace(data, value=fitted[known])
    errors: list[np.ndarray] = []
    angles: list[float] = []
    for back in (False, True):
        for through in (False, True):
            rows = (data.from_back == back) & (data.transmitted == through)
            if not rows.any():
                continue
            light = {"side": "back" if back else "front", "transmitted": through}
            for theta in _angles(data.select(rows)):
                try:
                    sums = [
                        measured(m, Directional(theta), Hemispherical(), **light).value
                        for m in (data, model)
                    ]
                except MeasurementError:
                    continue
                errors.append(np.subtract(sums[1], sums[0]))
                angles.append(theta)
    if not errors:
        return None
    table = np.abs(np.stack(errors))
    worst = int(np.argmax(table.max(axis=1)))
    return AlbedoError(
        rms=float(np.sqrt(np.mean(table**2))),
        worst=float(table[worst].max()),
        theta_i_deg=angles[worst],
        angles=len(angles),
    )


def _angles(m: Measurement) -> list[float]:
    try:
        found, _ = incidences(m, Directional(0.0) if m.symmetry == "anisotropic" else None)
    except Missing:
        return []
    return [float(t) for t in found if t < _LARGEST_THETA_DEG]
