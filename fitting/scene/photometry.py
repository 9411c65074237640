"""What a scene's light amounts to: white, exposure, and colours from radiances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from data_formats.measurement import Channel
from fitting.colorimetry import FEWEST_WAVELENGTHS, srgb_to_xyz, tristimulus_weights
from fitting.scene.bands import RGB, band_kind
from fitting.scene.description import Scene, SceneError, Sphere
from fitting.scene.directions import brightest_normal, fluxes
from fitting.scene.emitters import Emitter, emitter_irradiance, emitters
from fitting.scene.observer import has_eye, observer

_UP = np.array([0.0, 0.0, 1.0])


class Photometry(NamedTuple):
    """Everything of this module, computed once.

    ``facing (3,)`` is the normal of the perfect diffuser whose radiance is ``white (c,)``;
    the others are what the functions of their names return.
    """

    emitters: tuple[Emitter, ...]
    counts: np.ndarray
    facing: np.ndarray
    white: np.ndarray
    tristimulus: np.ndarray
    display_white: np.ndarray


def photometry(scene: Scene, channels: Sequence[Channel]) -> Photometry:
    """The lights of a scene at the channels of a measurement, and what they amount to.

    Raises `SceneError`, also if no channel that counts has any light.
    """
    counted = counts(scene, channels)
    lights = emitters(scene, channels)
    weights = _weights(scene, channels, counted)
    facing = _UP
    if isinstance(scene.seen, Sphere):
        facing = _brightest(lights, weights[:, 1])
    light = sum(emitter_irradiance(e, facing[None])[0] for e in lights)
    diffuser = np.asarray(light) / np.pi
    xyz = (diffuser * _values_of_diffuser(channels)) @ weights
    if not xyz[1] > 0:
        listed = ", ".join(c.name for c in channels[:4])
        more = ", ..." if len(channels) > 4 else ""
        low, high = scene.viewer.wavelengths_nm
        raise SceneError(
            f"{scene.name or 'scene'}: no channel of the data ({listed}{more}) counts in "
            f"{low:g} to {high:g} nm and has light; expected viewer.wavelengths_nm and "
            "spectra that fit the data"
        )
    exposure = 1.0 if scene.viewer.exposure == "auto" else scene.viewer.exposure
    matrix = weights * (100.0 * exposure / xyz[1])
    return Photometry(lights, counted, facing, diffuser, matrix, xyz * (100.0 / xyz[1]))


def white(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """Radiance ``(c,)`` of a perfect diffuser, f = 1 / pi, that faces the light.

    That is its irradiance / pi, to 1e-4: of ``flat`` lying horizontally, of ``sphere``
    where its luminance is largest, of ``histogram`` at normal incidence.
    """
    return photometry(scene, channels).white


def counts(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """Whether each channel ``(c,)`` counts: named bands, and wavelengths in the range.

    Raises `SceneError` if none does.
    """
    low, high = scene.viewer.wavelengths_nm
    w = [low if c.wavelength_nm is None else c.wavelength_nm for c in channels]
    out = (np.array(w) >= low - 1e-9) & (np.array(w) <= high + 1e-9)
    if not out.any():
        raise SceneError(
            f"{scene.name or 'scene'}: viewer.wavelengths_nm is {low:g} to {high:g}, and "
            f"the data have {min(w):g} to {max(w):g} nm; expected some of them"
        )
    return out


def tristimulus(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """``XYZ = radiances @ matrix (c, 3)`` as displayed: Y = 100 is the display's white.

    The exposure is included: `white` times it has Y = 100 * exposure (auto is 1). R, G, B
    are linear sRGB; X, Y, Z themselves; five wavelengths or more in the visible range go
    through the observer's colour matching functions, within the viewer's wavelengths, as in
    `fitting.colorimetry.tristimulus_weights`. Of anything else, and without an observer,
    there is luminance only, shown grey: the sum over the channels that count, weighed by
    the observer's luminous efficiency where it sees any of them.
    """
    return photometry(scene, channels).tristimulus


def display_white(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """XYZ ``(3,)`` of the display's white, Y = 100: white for L*a*b*, and where to clip.

    Its chromaticity is that of a perfect diffuser in the scene's light, whose X, Y and Z
    are taken to be those of D65 if the channels are X, Y, Z.
    """
    return photometry(scene, channels).display_white


def _weights(scene: Scene, channels: Sequence[Channel], counted: np.ndarray) -> np.ndarray:
    """`tristimulus`, but for a common factor."""
    kind = band_kind(channels)
    if kind is not None:
        to_xyz = srgb_to_xyz().T if kind == RGB else np.eye(3)
        return to_xyz[[kind.index(c.name.upper()) for c in channels]]
    by = observer(scene.viewer)
    efficiency = counted.astype(np.float64)
    if not has_eye(scene.viewer) or not by.wavelengths_nm.size:
        return _grey(efficiency)
    w = np.array([c.wavelength_nm or 0.0 for c in channels])
    used = np.flatnonzero(counted & (w > 0))
    used = used[np.argsort(w[used])]
    first, last = by.wavelengths_nm[[0, -1]]
    visible = np.sum((w[used] >= first) & (w[used] <= last))
    if visible >= FEWEST_WAVELENGTHS and w.all():
        out = np.zeros((len(channels), 3))
        out[used] = tristimulus_weights(
            w[used], illuminant="E", observer=by.name, range_nm=(first, last)
        ).matrix
        return out
    efficiency[used] = np.interp(
        w[used], by.wavelengths_nm, by.table[:, 1], left=0.0, right=0.0
    )
    return _grey(efficiency if efficiency.any() else counted.astype(np.float64))


def _values_of_diffuser(channels: Sequence[Channel]) -> np.ndarray:
    """pi f ``(c,)`` of the perfect diffuser: X, Y and Z have the colour of D65 in them."""
    kind = band_kind(channels)
    if kind is None or kind == RGB:
        return np.ones(len(channels))
    white = srgb_to_xyz().sum(axis=1) / 100.0
    return white[[kind.index(c.name.upper()) for c in channels]]


def _grey(efficiency: np.ndarray) -> np.ndarray:
    return efficiency[:, None] * srgb_to_xyz().sum(axis=1)


def _brightest(lights: Sequence[Emitter], luminous: np.ndarray) -> np.ndarray:
    pieces = []
    for e in lights:
        where = (e.pattern, e.axis, e.half_angle, e.finest)
        pieces += fluxes(*where, e.spectrum @ luminous)
    return brightest_normal(pieces)
