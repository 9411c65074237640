"""Spectra of lights in the channels of a measurement, wavelengths or named bands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from data_formats.measurement import Channel
from fitting.colorimetry import colour_science, srgb_to_xyz
from fitting.scene.observer import Observer, brightness, tristimulus_of
from fitting.scene.spectra import Power, channel_means

RGB, XYZ = ("R", "G", "B"), ("X", "Y", "Z")


class Tints:
    """Colours of lights in named bands, relative to a white light, the scene's first.

    That one is grey: a camera is balanced to it, and X, Y and Z of a measurement are of
    light like it.
    """

    def __init__(self, by: Observer, white: Power) -> None:
        self._by = by
        self._white = _of_unit_luminance(tristimulus_of(by, white))

    def brightness(self, spectrum: Power) -> float:
        """As in `fitting.scene.observer.brightness`."""
        return brightness(self._by, spectrum)

    def xyz(self, spectrum: Power) -> np.ndarray:
        """Ratios ``(3,)`` to the white light, 1 in Y."""
        own = _of_unit_luminance(tristimulus_of(self._by, spectrum))
        return own / np.where(self._white > 0, self._white, 1.0)

    def rgb(self, spectrum: Power) -> np.ndarray:
        """Linear sRGB ``(3,)`` with luminance 1, adapted by Bradford's transform.

        What a colour beyond the sRGB gamut has below 0 is cut.
        """
        own = _of_unit_luminance(tristimulus_of(self._by, spectrum))
        to_xyz = srgb_to_xyz() / 100.0
        adapt = colour_science().adaptation.matrix_chromatic_adaptation_VonKries(
            self._white, to_xyz.sum(axis=1), transform="Bradford"
        )
        linear = np.maximum(np.linalg.solve(to_xyz, adapt @ own), 0.0)
        return linear / (to_xyz[1] @ linear)


def band_kind(channels: Sequence[Channel]) -> tuple[str, ...] | None:
    """R, G, B or X, Y, Z if the channels are just these, in any order."""
    if any(c.wavelength_nm is not None for c in channels):
        return None
    names = sorted(c.name.upper() for c in channels)
    return next((kind for kind in (RGB, XYZ) if names == sorted(kind)), None)


def part_rows(
    channels: Sequence[Channel], spectrum: Power, parts: Sequence[Power], tints: Tints
) -> np.ndarray:
    """Spectra ``(k, c)`` of a light's ``k`` parts: all of it, or its R, G and B.

    At wavelengths they are `channel_means`. In the bands R, G, B a part is itself times the
    light's tint; in X, Y, Z it has the tristimulus values of its primary; any other band is
    grey and has its luminance.
    """
    out = np.zeros((len(parts), len(channels)))
    at = [j for j, c in enumerate(channels) if c.wavelength_nm is not None]
    if at:
        w = np.array([channels[j].wavelength_nm for j in at], dtype=np.float64)
        for row, part in zip(out, parts, strict=True):
            row[at] = channel_means(part, w)
    kind = band_kind(channels)
    columns = _columns(kind, len(parts), spectrum, tints)
    for j, channel in enumerate(channels):
        if channel.wavelength_nm is None:
            out[:, j] = columns[kind.index(channel.name.upper()) if kind else 0]
    return out


def _columns(
    kind: tuple[str, ...] | None, parts: int, spectrum: Power, tints: Tints
) -> np.ndarray:
    """``(bands, k)``: what the parts of a light have in each band."""
    to_xyz = srgb_to_xyz() / 100.0
    if kind == RGB:
        tint, primaries = tints.rgb(spectrum), np.eye(3)
    elif kind == XYZ:
        tint, primaries = tints.xyz(spectrum), to_xyz / to_xyz.sum(axis=1, keepdims=True)
    else:
        tint, primaries = np.ones(1), to_xyz[1:2]
    shares = primaries if parts == 3 else primaries.sum(axis=1, keepdims=True)
    return tints.brightness(spectrum) * tint[:, None] * shares


def _of_unit_luminance(xyz: np.ndarray) -> np.ndarray:
    """Of a light that no eye sees, equal energy."""
    return xyz / xyz[1] if xyz[1] > 0 else np.ones(3)
