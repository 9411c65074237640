"""The lights of a scene as a renderer sees them: where from, how much, which channels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from data_formats.measurement import Channel
from fitting.scene.bands import Tints, part_rows
from fitting.scene.description import (
    Direction,
    Disk,
    Histogram,
    Light,
    Map,
    Scene,
    SceneError,
    Sky,
)
from fitting.scene.directions import (
    Pattern,
    brightest_normal,
    fluxes,
    irradiance,
)
from fitting.scene.environment import interpolator, load_environment
from fitting.scene.observer import brightness, observer
from fitting.scene.sky import relative_luminance
from fitting.scene.spectra import Power, power, rgb_parts

_UP = np.array([0.0, 0.0, 1.0])
# rad; skies have no smaller detail than their coronas.
_SMOOTH = 0.1


class Emitter(NamedTuple):
    """One light: ``k`` patterns over directions with a spectrum each, in ``c`` channels.

    The radiance of channel ``j`` from a direction is ``sum_k pattern_k spectrum[k, j]``;
    if ``half_angle`` is 0 that is the irradiance at normal incidence instead. World
    coordinates as in `fitting.scene.description`.

    - ``axis (3,)``: unit vector towards the light.
    - ``half_angle``, rad: no light comes from farther off the axis; 0 a direction, pi / 2
      a sky, pi everywhere.
    - ``pattern``: x, y, z ``(n,)`` of unit vectors towards the light to ``(k, n)``.
    - ``spectrum (k, c)``.
    - ``finest``, rad: the smallest detail of the pattern.

    In the ``histogram`` geometry the axis is z, and every row puts it at its incidence.
    """

    name: str
    axis: np.ndarray
    half_angle: float
    pattern: Pattern
    spectrum: np.ndarray
    finest: float


def emitters(scene: Scene, channels: Sequence[Channel]) -> tuple[Emitter, ...]:
    """The lights of a scene at the channels of a measurement; the ground, if any, is last.

    Radiances are relative: a light of brightness 1 gives an illuminance of 1 (see
    `brightness` of the lights), where an equal-energy spectrum of 1 has illuminance 1.

    Raises `SceneError` if a file of the scene cannot be used, or if a light has no power
    that the observer sees.
    """
    by = observer(scene.viewer)
    powers = [power(light.spectrum) for light in scene.lights]
    tints = Tints(by, powers[0])
    out: list[Emitter] = []
    for number, (light, spectrum) in enumerate(zip(scene.lights, powers, strict=True), 1):
        shape = _shape(light, scene)
        parts = _parts(spectrum, shape)
        luminous = np.array([brightness(by, part) for part in parts])
        given = float(luminous @ _reference(light, shape, luminous))
        name = light_name(light, number)
        if not given > 0:
            low, high = scene.viewer.wavelengths_nm
            raise SceneError(
                f"{scene.name or 'scene'}: the light {name!r} has no power that counts in "
                f"{low:g} to {high:g} nm with viewer.observer = {scene.viewer.observer!r}; "
                "expected other wavelengths, another spectrum, or the observer none"
            )
        rows = part_rows(channels, spectrum, parts, tints)
        spectra = rows * (light.brightness / given)
        where = (shape.axis, shape.half_angle, shape.pattern)
        out.append(Emitter(name, *where, spectra, shape.finest))
    if scene.ground_reflectance > 0:
        out.append(_ground(out, scene.ground_reflectance))
    return tuple(out)


def light_name(light: Light, number: int) -> str:
    """What reports call the light of that number, from 1."""
    return light.name or f"{type(light).__name__.lower()} {number}"


def emitter_irradiance(emitter: Emitter, normals: np.ndarray) -> np.ndarray:
    """Irradiance ``(m, c)`` that a light gives to surfaces with ``normals (m, 3)``."""
    e = emitter
    return irradiance(e.pattern, e.axis, e.half_angle, e.finest, normals) @ e.spectrum


def towards(theta_deg: float, phi_deg: float) -> np.ndarray:
    """The unit vector ``(3,)`` at a zenith angle and azimuth."""
    theta, phi = math.radians(theta_deg), math.radians(phi_deg)
    return np.array(
        [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
    )


class _Shape(NamedTuple):
    axis: np.ndarray
    half_angle: float
    pattern: Pattern
    finest: float
    patterns: int = 1


def _shape(light: Light, scene: Scene) -> _Shape:
    if isinstance(light, Direction | Disk):
        lit_by_row = isinstance(scene.seen, Histogram)
        axis = _UP if lit_by_row else towards(light.theta_deg, light.phi_deg)
        if isinstance(light, Direction):
            return _Shape(axis, 0.0, _everywhere, 0.0)
        half = math.radians(0.5 * light.diameter_deg)
        return _Shape(axis, half, _disk(axis, math.cos(half)), half)
    if isinstance(light, Sky):
        sun = tuple(towards(light.sun_theta_deg or 0.0, light.sun_phi_deg))

        def sky(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
            return relative_luminance(light.type, x, y, z, sun=sun)[None]

        return _Shape(_UP, math.pi / 2, sky, _SMOOTH)
    if isinstance(light, Map):
        environment = load_environment(light.file, math.radians(light.smallest_detail_deg))
        pattern = interpolator(environment, math.radians(light.phi_deg))
        count = len(environment.radiance)
        return _Shape(_UP, math.pi, pattern, environment.pixel, count)
    if light.below_horizon:
        return _Shape(_UP, math.pi, _everywhere, _SMOOTH)
    return _Shape(_UP, math.pi / 2, _above, _SMOOTH)


def _parts(spectrum: Power, shape: _Shape) -> list[Power]:
    """The spectrum of each pattern: a map in R, G, B shares it out."""
    if shape.patterns == 1:
        return [spectrum]
    bends = np.union1d(spectrum.bends_nm, np.arange(380.0, 781.0, 5.0))

    def share(k: int) -> Power:
        return Power(lambda w: spectrum.of(w) * rgb_parts(w)[k], bends)

    return [share(k) for k in range(shape.patterns)]


def _reference(light: Light, shape: _Shape, luminous: np.ndarray) -> np.ndarray:
    """Irradiance ``(k,)`` of the patterns on the surface that `brightness` means."""
    where = (shape.pattern, shape.axis, shape.half_angle, shape.finest)
    normal = shape.axis
    if isinstance(light, Map):
        normal = brightest_normal(fluxes(*where, luminous))
    return irradiance(*where, normal[None])[0]


def _ground(lights: Sequence[Emitter], reflectance: float) -> Emitter:
    """A matt ground below the horizon, lit by what is above: L = reflectance E / pi."""
    light = sum(emitter_irradiance(e, _UP[None])[0] for e in lights)
    spectrum = np.atleast_2d(np.asarray(light) * reflectance / math.pi)
    return Emitter("ground", -_UP, math.pi / 2, _below, spectrum, _SMOOTH)


def _disk(axis: np.ndarray, cos_edge: float) -> Pattern:
    # The edge itself belongs to the disk, whatever the rounding.
    least = cos_edge - 4 * np.finfo(float).eps

    def pattern(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return (x * axis[0] + y * axis[1] + z * axis[2] >= least).astype(float)[None]

    return pattern


def _everywhere(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.ones((1, np.size(x)))


def _above(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return (np.asarray(z) >= 0).astype(float)[None]


def _below(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return (np.asarray(z) < 0).astype(float)[None]
