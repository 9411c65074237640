"""What the BSDF XML of Radiance and WINDOW takes: its channels, its sides, its rows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from data_formats import Channel, Measurement, Provenance
from data_formats.measurement import PROJECTED_SOLID_ANGLE
from data_formats.patches import Group, Patches
from fitting.export.channels import (
    Mixing,
    index_of,
    linear_srgb,
    srgb_to_xyz,
    to_equal_energy,
    tristimulus,
)
from fitting.export.surface import Surface
from fitting.export.target import Request
from fitting.geometry import Geometry, from_angles
from fitting.models import Way
from fitting.models.lobe import FROM_BACK, THROUGH
from fitting.result import FitResult

_XYZ = (Channel("X"), Channel("Visible"), Channel("Z"))


@dataclass(frozen=True)
class Block:
    """Averages ``value (n, c)`` over pairs of patches, along one way of light."""

    way: Way
    patches: Patches
    value: np.ndarray


def visible(result: FitResult, request: Request) -> Mixing:
    """X, Visible (which is Y) and Z, or Visible alone of a single channel.

    Raises `ModelError` where no colour follows from the channels.
    """
    channels = result.channels
    if len(request.channels) == 1 or len(channels) == 1:
        name = request.channels[0] if request.channels else channels[0].name
        matrix = np.zeros((len(channels), 1))
        matrix[index_of(channels, name)] = 1.0
        return Mixing((Channel("Visible"),), matrix, f"Visible is {name} of the fit")
    spectral = all(c.wavelength_nm is not None for c in channels)
    found = None if request.channels else tristimulus(channels, request.illuminant)
    if found is None:
        spectral = False
        rgb = linear_srgb(channels, request.channels, request.illuminant)
        found = Mixing(_XYZ, rgb.matrix @ srgb_to_xyz(), rgb.sentence)
    white = to_equal_energy(request.illuminant if spectral else "D65")
    return Mixing(
        _XYZ, found.matrix @ white,
        f"X, Visible (Y), Z, equal for white as Radiance has it: {found.sentence}",
    )  # fmt: skip


def both_sides(surface: Surface) -> tuple[str, ...]:
    """A sentence on a sample of which the front alone is known; empty for others."""
    if surface.model.ways != ("front",):
        return ()
    return (
        "the model reflects from the front alone; the file has that for both sides, so "
        "that it does not matter which one a program shows",
    )


def measurement_of(surface: Surface, blocks: Sequence[Block]) -> Measurement:
    """The rows of the file; an opaque sample's for both sides (see `both_sides`)."""
    groups = [Group(*_named(b.way), b.patches) for b in blocks]
    values = [b.value for b in blocks]
    if both_sides(surface):
        groups += [Group("reflection", "back", b.patches) for b in blocks]
        values = values * 2
    angles = [np.concatenate(a) for a in zip(*(g.angles() for g in groups), strict=True)]
    value = _rounded(np.maximum(np.concatenate(values), 0.0))
    return Measurement(
        *angles,
        value=value,
        valid=np.ones(value.shape, dtype=bool),
        channels=surface.channels,
        symmetry="anisotropic" if surface.model.anisotropic else "isotropic",
        provenance=Provenance(sample=surface.result.data.sample or "fitted surface"),
        auxiliary={PROJECTED_SOLID_ANGLE: np.concatenate([g.patches.area for g in groups])},
    )


def with_chromaticity(rows: Measurement) -> Measurement:
    """With ``CIE-u`` and ``CIE-v``, by which Radiance colours trees; it ignores X and Z.

    CIE 1976: ``u' = 4 X / (X + 15 Y + 3 Z)``, ``v' = 9 Y / (X + 15 Y + 3 Z)``.
    """
    x, y, z = rows.value.T
    total = x + 15.0 * y + 3.0 * z
    dark = total <= 0
    total = np.where(dark, 1.0, total)
    # Black has no colour; D65 stands for it.
    u = np.where(dark, 0.19784, 4.0 * x / total)
    v = np.where(dark, 0.46832, 9.0 * y / total)
    value = np.column_stack([rows.value, _rounded(np.stack([u, v], axis=1))])
    return dataclasses.replace(
        rows, value=value, valid=np.ones(value.shape, dtype=bool),
        channels=(*rows.channels, Channel("CIE-u"), Channel("CIE-v")),
    )  # fmt: skip


def _rounded(value: np.ndarray) -> np.ndarray:
    """To six digits: averages by points have no more."""
    exponent = np.floor(np.log10(np.where(value > 0, value, 1.0)))
    scale = 10.0 ** (5.0 - exponent)
    return np.round(value * scale) / scale


def _named(way: Way) -> tuple[str, str]:
    return (
        "transmission" if way in THROUGH else "reflection",
        "back" if way in FROM_BACK else "front",
    )


def geometry_of(
    way: Way, sin_i: np.ndarray, phi_i: np.ndarray, sin_r: np.ndarray, phi_r: np.ndarray
) -> Geometry:
    """Pairs along a way of light from sines and azimuths in the frame of the file.

    Azimuths of the fit are 180 degrees minus those of the file.
    """
    theta_i, theta_r = (np.arcsin(np.clip(s, 0.0, 1.0)) for s in (sin_i, sin_r))
    if way in FROM_BACK:
        theta_i = np.pi - theta_i
    if (way in FROM_BACK) != (way in THROUGH):
        theta_r = np.pi - theta_r
    return from_angles(theta_i, np.pi - phi_i, theta_r, np.pi - phi_r)


def in_file(g: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """``sin_i, phi_i, sin_r, phi_r`` of a geometry in the frame of the file."""
    return (
        np.hypot(g.wix, g.wiy), np.pi - np.arctan2(g.wiy, g.wix),
        np.hypot(g.wox, g.woy), np.pi - np.arctan2(g.woy, g.wox),
    )  # fmt: skip


@dataclass(frozen=True)
class Looked:
    """What a program finds in patches: along each way ``value(sin_i, phi_i, sin_r,
    phi_r)``, in the frame of the file."""

    ways: Mapping[Way, Callable[..., np.ndarray]]
    channels: int
    words: str

    def __call__(self, geometry: Geometry) -> np.ndarray:
        out = np.zeros((np.size(geometry.cos_i), self.channels))
        for way, find in self.ways.items():
            on = np.asarray(geometry.on((way,)))
            angles = tuple(a[on] for a in in_file(geometry))
            out[on] = find(*angles)
        return out
