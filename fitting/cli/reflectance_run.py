"""What ``brdf reflectance`` computes: its report as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from data_formats import Measurement, MeasurementError
from fitting.cli.failures import UsageError
from fitting.cli.flags import Flags
from fitting.cli.terminal import stderr
from fitting.cli.work import Work
from fitting.colorimetry import ObjectColour, tristimulus_weights
from fitting.reflectance import Geometry, named, quantity, surface_of_result
from fitting.reflectance.beams import Beam, Conical, Directional, Hemispherical
from fitting.reflectance.luminous import colour_difference, colour_of_factors
from fitting.reflectance.measured import measured
from fitting.reflectance.quantity import Reflectance, way_of
from fitting.reflectance.surface import Surface
from fitting.result import load_result

DEFAULT = ("45/0", "8/d", "8/d SCE", "white-sky")
DEFAULT_THROUGH = ("T 0/d", "T white-sky")


@dataclass(frozen=True)
class Asked:
    """The options of the command line."""

    geometry: tuple[str, ...]
    cone: tuple[str, ...]
    illuminant: str
    observer: str
    transmitted: bool
    side: str
    theta: float | None
    trap: float
    tolerance: float


class Line(msgspec.Struct, frozen=True):
    """One quantity: geometry, numbers, colour, and colour difference from a reference."""

    geometry: str
    says: str
    reflectance: Reflectance
    colour: ObjectColour | None
    delta_e_2000: float | None = None


class Report(msgspec.Struct, frozen=True):
    """Everything that the command says."""

    source: str
    kind: str
    model: str | None
    wavelengths_nm: list[float | None]
    illuminant: str
    observer: str
    quantities: list[Line]
    reference: str | None = None
    left_out: list[str] = []


def of_result(path: Path, asked: Asked, reference: Path | None, flags: Flags) -> Report:
    """The quantities of a fitted model."""
    result = load_result(path)
    _check_colour(asked)
    surface = surface_of_result(result)
    other = surface_of_result(load_result(reference)) if reference else None
    lines: list[Line] = []
    chosen = _geometries(asked, surface)
    with Work(stderr(), len(chosen), quiet=flags.quiet or not stderr().is_terminal) as work:
        for k, geometry in enumerate(chosen):
            work.at(geometry.name, k, 0)
            line = _line(surface, geometry, asked)
            if other is not None:
                compared = _line(other, geometry, asked).colour
                if compared is None or line.colour is None:
                    which, own = (reference, other) if line.colour else (path, surface)
                    raise UsageError(
                        f"--reference {reference}: no colour can be made of the "
                        f"{len(own.names)} channels of {which}"
                    )
                line = msgspec.structs.replace(
                    line, delta_e_2000=colour_difference(line.colour, compared)
                )
            lines.append(line)
    at = list(surface.wavelengths_nm)
    return _report(path, "model", result.model, at, asked, lines, reference)


def of_file(path: Path, measurement: Measurement, asked: Asked) -> Report:
    """The quantities of measured values, without a model."""
    _check_colour(asked)
    if asked.cone:
        raise UsageError("--cone: rows are too far apart for cones; fit a model first")
    usual = DEFAULT_THROUGH if measurement.transmitted.any() else ()
    usual += () if asked.transmitted else DEFAULT
    if not (asked.geometry or usual):
        raise UsageError(f"--transmitted: {path} has no transmitted light")
    chosen = _named(asked.geometry or usual, asked)
    at = [c.wavelength_nm for c in measurement.channels]
    names = [c.name for c in measurement.channels]
    lines, refused = [], []
    for geometry in chosen:
        try:
            found = measured(
                measurement, geometry.incident, geometry.collected, side=asked.side,
                transmitted=geometry.transmitted,
            )  # fmt: skip
        except MeasurementError as error:
            # What was asked for has to be answered; what is usual is left out.
            if asked.geometry or (not lines and geometry is chosen[-1]):
                raise
            refused.append(f"{geometry.name} is left out: {error}")
            continue
        colour = _colour(found, names, at, asked)
        lines.append(Line(geometry.name, geometry.says, found, colour))
    report = _report(path, "measurement", None, at, asked, lines, None)
    return msgspec.structs.replace(report, left_out=refused)


def _check_colour(asked: Asked) -> None:
    """Raises for an unknown illuminant or observer, whether or not a colour follows."""
    some = np.linspace(400.0, 700.0, 5)
    tristimulus_weights(some, illuminant=asked.illuminant, observer=asked.observer)


def _line(surface: Surface, geometry: Geometry, asked: Asked) -> Line:
    found = quantity(
        surface, geometry.incident, geometry.collected, side=asked.side,
        transmitted=geometry.transmitted, tolerance=asked.tolerance,
    )  # fmt: skip
    colour = _colour(found, surface.names, surface.wavelengths_nm, asked)
    return Line(geometry.name, geometry.says, found, colour)


def _colour(
    found: Reflectance, names: Sequence[str], wavelengths: Sequence[float | None],
    asked: Asked,
) -> ObjectColour | None:  # fmt: skip
    covariance = None
    if found.covariance is not None:
        covariance = np.asarray(found.covariance) * found.unit_factor**2
    return colour_of_factors(
        names, wavelengths, found.factor, covariance,
        illuminant=asked.illuminant, observer=asked.observer,
    )  # fmt: skip


def _report(
    path: Path, kind: str, model: str | None, at: list[float | None], asked: Asked,
    lines: list[Line], reference: Path | None,
) -> Report:  # fmt: skip
    colours = [line.colour for line in lines if line.colour is not None]
    illuminant = colours[0].illuminant if colours else asked.illuminant
    observer = colours[0].observer if colours else asked.observer
    other = str(reference) if reference else None
    return Report(str(path), kind, model, at, illuminant, observer, lines, other)


def _geometries(asked: Asked, surface: Surface) -> list[Geometry]:
    chosen = asked.geometry
    if not chosen and not asked.cone:
        ways = surface.model.ways
        if way_of(asked.side, False) in ways and not asked.transmitted:
            chosen += DEFAULT
        if way_of(asked.side, True) in ways:
            chosen += DEFAULT_THROUGH
        if not chosen:
            raise UsageError(
                f"--from {asked.side}: {surface.model.expression!r} does nothing with "
                "such light" + (" behind the sample" if asked.transmitted else "")
            )
    return _named(chosen, asked) + [_of_cones(text, asked) for text in asked.cone]


def _named(names: tuple[str, ...], asked: Asked) -> list[Geometry]:
    return [
        named(g, theta_deg=asked.theta, trap_deg=asked.trap, transmitted=asked.transmitted)
        for g in names
    ]


def _of_cones(text: str, asked: Asked) -> Geometry:
    first, comma, second = text.partition(",")
    if not comma:
        raise UsageError(f"--cone {text}: expected two beams, INCIDENT,COLLECTED")
    beams = _beam(text, first), _beam(text, second)
    mark = "T " if asked.transmitted else ""
    return Geometry(f"{mark}{text}", *beams, asked.transmitted, "beams as given")


def _beam(text: str, part: str) -> Beam:
    if part.strip() == "d":
        return Hemispherical()
    try:
        numbers = [float(v) for v in part.split(":")]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 3 or not all(map(math.isfinite, numbers)):
        raise UsageError(
            f"--cone {text}: {part!r} is no beam; expected THETA, THETA:PHI, "
            "THETA:PHI:HALF_ANGLE in degrees, or d"
        )
    if len(numbers) == 3:
        return Conical(*numbers)
    return Directional(*numbers)
