"""A scene in words and numbers: what its lights give, and what they show of a surface."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct

from data_formats.measurement import Channel
from fitting.quantities import degrees, number, percent
from fitting.scene.description import (
    Direction,
    Disk,
    Flat,
    Histogram,
    Light,
    Map,
    Scene,
    Sky,
    Sphere,
)
from fitting.scene.emitters import Emitter, emitter_irradiance
from fitting.scene.histogram import pairs
from fitting.scene.observer import has_eye, observer_name
from fitting.scene.photometry import photometry
from fitting.scene.sky import NAMES, corona_width

# Full width at half maximum, rad, of the lobe of a GGX facet surface of width alpha, in the
# plane of incidence at the normal: 2.57 alpha.
WIDTH_OF_LOBE = 2.57


class LightShare(Struct, frozen=True):
    """What one light gives.

    ``share`` is of the illuminance on the surface that faces the light (flat: that lies
    under it). ``size_deg`` is its angular size, that of a sky's corona, or of a map's
    smallest detail; lobes much narrower than ``smallest_alpha = size / 2.57`` differ only
    at the edges of highlights. 0 is a direction, which shows any width.
    """

    name: str
    kind: str
    what: str
    share: float
    size_deg: float
    smallest_alpha: float


class Explanation(Struct, frozen=True):
    """A scene, explained.

    ``facing_deg``, polar angle and azimuth, is where the diffuser faces that is the white
    of the exposure. ``smallest_alpha`` is the least of all lights. ``scene`` is everything
    that was declared, and the defaults.
    """

    name: str
    description: str
    lights: list[LightShare]
    smallest_alpha: float
    facing_deg: tuple[float, float]
    seen: str
    viewer: str
    exposure: str
    tolerance: str
    scene: dict[str, Any]


def explain(scene: Scene) -> Explanation:
    """What a scene amounts to. Raises `SceneError` if a file of it cannot be used."""
    # One grey channel holds what the observer weighs.
    light = photometry(scene, (Channel("luminance"),))
    given = [float(emitter_irradiance(e, light.facing[None])[0, 0]) for e in light.emitters]
    total = sum(given)
    shares = []
    for i, (emitter, part) in enumerate(zip(light.emitters, given, strict=True)):
        declared = scene.lights[i] if i < len(scene.lights) else None
        shares.append(_share(declared, emitter, part / total, scene))
    x, y, z = light.facing
    return Explanation(
        name=scene.name,
        description=scene.description,
        lights=shares,
        smallest_alpha=min(s.smallest_alpha for s in shares),
        facing_deg=(
            round(math.degrees(math.acos(min(1.0, z))), 2),
            round(math.degrees(math.atan2(y, x)), 2) if z < 1 else 0.0,
        ),
        seen=_seen(scene),
        viewer=_viewer(scene),
        exposure=_exposure(scene),
        tolerance=_tolerance(scene),
        scene=msgspec.to_builtins(scene),
    )


def _share(light: Light | None, emitter: Emitter, share: float, scene: Scene) -> LightShare:
    if light is None:
        what = f"matt, returns {percent(scene.ground_reflectance)} of what falls on it"
        size, kind = math.pi, "ground"
    else:
        what, size = _what(light, emitter, isinstance(scene.seen, Histogram))
        what += f"; {_spectrum(light)}"
        kind = type(light).__name__.lower()
    alpha = size / WIDTH_OF_LOBE
    return LightShare(emitter.name, kind, what, share, math.degrees(size), alpha)


def _what(light: Light, emitter: Emitter, turns: bool) -> tuple[str, float]:
    """A light in words, and the angle, rad, of its smallest detail."""
    if isinstance(light, Direction | Disk):
        at = f"from {_direction(light.theta_deg, light.phi_deg)}"
        if turns:
            at = "from the angles of incidence of the histogram"
        if isinstance(light, Direction):
            return f"one direction, {at}", 0.0
        return f"a disk {light.diameter_deg:g} deg across, {at}", 2 * emitter.half_angle
    if isinstance(light, Sky):
        sun = ""
        if light.sun_theta_deg is not None:
            sun = f", the sun at {_direction(light.sun_theta_deg, light.sun_phi_deg)}"
        return f"type {light.type}, {NAMES[light.type - 1]}{sun}", corona_width(light.type)
    if isinstance(light, Map):
        pixel = math.degrees(emitter.finest)
        return f"the map {light.file}, in pixels of {pixel:.2g} deg", emitter.finest
    if light.below_horizon:
        return "the same from everywhere", 2 * math.pi
    return "the same from the whole sky", math.pi


def _spectrum(light: Light) -> str:
    spectrum = light.spectrum
    if isinstance(spectrum, str):
        return f"illuminant {spectrum}"
    if spectrum.illuminant is not None:
        return f"illuminant {spectrum.illuminant}"
    if spectrum.blackbody_kelvin is not None:
        return f"a black body of {spectrum.blackbody_kelvin:g} K"
    if spectrum.file is not None:
        return f"the spectrum in {spectrum.file}"
    if spectrum.rgb is not None:
        return f"linear sRGB {', '.join(f'{v:g}' for v in spectrum.rgb)}"
    listed = ", ".join(f"{low:g} to {high:g}" for low, high, _ in spectrum.bands or ())
    return f"bands of {listed} nm"


def _seen(scene: Scene) -> str:
    seen = scene.seen
    if isinstance(seen, Sphere):
        return (
            f"a sphere, {seen.pixels} pixels across, by a distant camera "
            f"{degrees(seen.camera_theta_deg)} deg from the zenith, azimuth 0"
        )
    if isinstance(seen, Flat):
        (low, high), (first, last) = seen.theta_deg, seen.phi_deg
        around = "from all sides"
        if last - first < 360:
            around = f"azimuths {degrees(first)} to {degrees(last)} deg"
        return (
            f"a flat sample, {degrees(low)} to {degrees(high)} deg off its normal, {around}"
        )
    rows = pairs(seen)
    spans = (
        f"{degrees(math.degrees(a.min()))} to {degrees(math.degrees(a.max()))} deg"
        for a in (rows.theta_i, rows.theta_r)
    )
    return (
        f"a flat sample, {len(rows.weight)} weighted pairs of directions, incidence "
        f"{' and view '.join(spans)}"
    )


def _viewer(scene: Scene) -> str:
    low, high = scene.viewer.wavelengths_nm
    span = f"wavelengths {low:g} to {high:g} nm"
    if not has_eye(scene.viewer):
        return f"{span}, all of the same weight; no eye"
    name = observer_name(scene.viewer)
    if scene.viewer.observer.strip().lower() == "rgb":
        return f"{span}; a renderer in linear sRGB ({name} for spectra)"
    return f"{span}; {name}"


def _exposure(scene: Scene) -> str:
    value = scene.viewer.exposure
    said = "auto: 1" if value == "auto" else f"{value:g}"
    clip = "is cut there" if scene.viewer.clip else "is kept"
    return (
        f"{said} times the display's white for a perfect diffuser facing the light; what "
        f"is brighter {clip}"
    )


def _tolerance(scene: Scene) -> str:
    t = scene.tolerance
    if t.colour_difference is not None:
        d = t.colour_difference
        return (
            f"colour difference CIEDE2000, at most {number(d.mean)} in the mean and "
            f"{number(d.percentile_95)} at the 95th percentile"
        )
    if t.relative_radiance is not None:
        r = t.relative_radiance
        return (
            f"relative radiance error, at most {percent(r.mean)} in the mean and "
            f"{percent(r.percentile_95)} at the 95th percentile, relative to no less than "
            f"{number(r.floor)} of a perfect diffuser"
        )
    largest = t.albedo.maximum if t.albedo is not None else np.nan
    return f"albedo error, at most {number(largest)}"


def _direction(theta_deg: float, phi_deg: float) -> str:
    if theta_deg == 0:
        return "the zenith"
    return f"{degrees(theta_deg)} deg off the zenith, azimuth {degrees(phi_deg)} deg"
