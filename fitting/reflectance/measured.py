"""Reflectances of a measurement itself: sums over its rows, and how much is missing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from data_formats import Measurement, MeasurementError
from fitting.reflectance.beams import (
    Annular,
    Beam,
    Directional,
    Hemispherical,
    describe,
    is_thin,
    nicodemus_name,
    projected_solid_angle,
)
from fitting.reflectance.quantity import Reflectance, way_of
from fitting.reflectance.rows import Missing, Part, between_directions
from fitting.reflectance.sums import at_angle, over_sky

METHOD = (
    "sums of value times projected solid angle over the rows; the uncovered part of the "
    "hemisphere has the mean of the nearest ring, and is uncertain by all of that "
    "(rectangular, 0 to twice); sampling by leaving out every second ring or azimuth, but "
    "for files that state the solid angles"
)
METHOD_OF_DIRECTIONS = (
    "the nearest row within 1 deg, or the mean of rows within 7.5 deg weighted by "
    "distance, linear between angles of incidence"
)


@dataclass(frozen=True)
class _Case:
    """A sum, how it was made, and over which region (None: over none)."""

    part: Part
    method: str
    region: Beam | None


def measured(
    m: Measurement,
    incident: Beam,
    collected: Beam,
    *,
    side: str = "front",
    transmitted: bool = False,
) -> Reflectance:
    """A reflectance or transmittance from the rows of a measurement, per channel.

    Directional-hemispherical ones are sums at the measured angle of incidence, or linear
    between two; hemispherical-directional reflectances are those by reciprocity;
    bihemispherical ones integrate over the measured angles of incidence; bidirectional ones
    are the nearest rows. Cones, but for a gloss trap, are not summed.

    The standard uncertainty has three parts, added in squares: sigma of the rows, taken
    as independent; what is extrapolated, divided by sqrt(3); and the sampling. The last two
    are common to all channels. Raises `MeasurementError` where the sampling forbids it.
    """
    way_of(side, transmitted)
    chosen = m.select((m.from_back == (side == "back")) & (m.transmitted == transmitted))
    name = f"{describe(incident)} -> {describe(collected)}"
    try:
        case = _case(chosen, incident, collected, transmitted)
    except Missing as error:
        where = m.provenance.path or "the measurement"
        raise MeasurementError(
            f"{where}: {name} cannot be taken from the data: {error}; fit a model and use "
            "its result instead"
        ) from error
    return _report(m, case, incident, collected, side, transmitted)


def _case(m: Measurement, incident: Beam, collected: Beam, transmitted: bool) -> _Case:
    if not m.n_rows:
        light = "transmitted" if transmitted else "reflected"
        raise Missing(f"it has no rows of {light} light from that side")
    anisotropic = m.symmetry == "anisotropic"
    if isinstance(incident, Annular | Directional) and is_thin(collected):
        if anisotropic and not (
            isinstance(incident, Directional) and isinstance(collected, Directional)
        ):
            raise Missing("it is anisotropic, and a mean of azimuths needs all of them")
        part = between_directions(m, _one(incident, 0.0), _one(collected, 180.0))
        return _Case(part, METHOD_OF_DIRECTIONS, None)
    if isinstance(incident, Directional) and isinstance(collected, Hemispherical):
        return _Case(at_angle(m, incident, collected), METHOD, collected)
    if isinstance(incident, Hemispherical) and isinstance(collected, Directional):
        if transmitted or anisotropic:
            raise Missing("exchanging light and detector is for isotropic reflection only")
        part = at_angle(m, collected, incident)
        note = "light and detector are exchanged, by reciprocity"
        return _Case(part.noting(note), METHOD, incident)
    if isinstance(incident, Hemispherical) and isinstance(collected, Hemispherical):
        if incident.exclude or collected.exclude:
            raise Missing("a gloss trap needs a direction to have its mirror direction")
        return _Case(over_sky(m, collected), METHOD, collected)
    raise Missing("the rows are too far apart for sums over cones")


def _one(beam: Beam, azimuth: float) -> Directional:
    if isinstance(beam, Annular):
        return Directional(beam.theta_deg, azimuth)
    assert isinstance(beam, Directional)
    return beam


def _report(
    m: Measurement, case: _Case, incident: Beam, collected: Beam, side: str, through: bool
) -> Reflectance:
    part = case.part
    # Of the value of a sum the factor is pi / Omega; of a direction f the factor is pi f.
    to_factor = math.pi
    if case.region is not None:
        to_factor /= projected_solid_angle(case.region)
    factor_of_value = math.pi
    if not is_thin(collected):
        factor_of_value /= projected_solid_angle(collected)
    # With light and detector exchanged the factor is the same and the value is not.
    scale = to_factor / factor_of_value
    common = np.stack([part.extrapolated / math.sqrt(3.0), part.sampling])
    covariance = scale**2 * (common.T @ common)
    if part.sigma is not None:
        covariance = covariance + scale**2 * np.diag(part.sigma**2)
    sd = np.sqrt(np.diag(covariance))
    known = bool(np.any(sd > 0))
    value = scale * part.value
    return Reflectance(
        name=nicodemus_name(incident, collected),
        transmitted=through,
        side=side,
        incident=describe(incident),
        collected=describe(collected),
        channels=[c.name for c in m.channels],
        unit="1/sr" if is_thin(collected) else "1",
        value=value.tolist(),
        factor=(factor_of_value * value).tolist(),
        error_bound=[0.0] * m.n_channels,
        standard_uncertainty=sd.tolist() if known else None,
        factor_uncertainty=(factor_of_value * sd).tolist() if known else None,
        covariance=covariance.tolist() if known else None,
        unit_factor=factor_of_value,
        without_uncertainty=[],
        tolerance=0.0,
        converged=True,
        nodes=part.rows,
        method=case.method,
        notes=list(part.notes),
        extrapolated=(scale * part.extrapolated).tolist(),
        covered=part.covered.tolist(),
    )
