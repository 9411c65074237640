"""From the channels of a fit to those of a target: a matrix, and what it stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from data_formats import Channel
from fitting import result as results
from fitting.colorimetry import (
    FEWEST_WAVELENGTHS,
    ILLUMINANT,
    VISIBLE_NM,
    colour_science,
    tristimulus_weights,
)
from fitting.expression import ModelError

_RGB = (Channel("R"), Channel("G"), Channel("B"))
_XYZ = (Channel("X"), Channel("Y"), Channel("Z"))


@dataclass(frozen=True)
class Mixing:
    """``f_target (n, c) = f_fit (n, m) @ matrix (m, c)``, and a sentence on it."""

    channels: tuple[Channel, ...]
    matrix: np.ndarray
    sentence: str

    @property
    def selects(self) -> np.ndarray | None:
        """Which fitted channel each of the target's is; None if any is a mixture."""
        picks = np.isin(self.matrix, (0.0, 1.0)).all(axis=0)
        picks &= np.count_nonzero(self.matrix, axis=0) == 1
        return np.argmax(self.matrix, axis=0) if picks.all() else None


def as_fitted(channels: Sequence[results.Channel]) -> Mixing:
    """Every channel as it is."""
    own = tuple(Channel(c.name, c.wavelength_nm) for c in channels)
    return Mixing(own, np.eye(len(own)), "the channels are those of the fit")


def one_channel(channels: Sequence[results.Channel], name: str) -> Mixing:
    """A single channel by its name."""
    k = index_of(channels, name)
    matrix = np.zeros((len(channels), 1))
    matrix[k] = 1.0
    own = Channel(channels[k].name, channels[k].wavelength_nm)
    return Mixing((own,), matrix, f"the channel is {own.name} of the fit")


def linear_srgb(
    channels: Sequence[results.Channel],
    names: Sequence[str] = (),
    illuminant: str = ILLUMINANT,
) -> Mixing:
    """Linear values of the sRGB primaries, 1 for the perfect diffuser.

    Of five wavelengths or more in the visible by CIE's tables (2 degree observer) under an
    illuminant, adapted to D65 by Bradford's transform; R, G, B and X, Y, Z as what they
    say; a single channel for all three; and three channels by ``names``, or three visible
    wavelengths in their order, for R, G and B. Raises `ModelError` for others.
    """
    if names:
        if len(names) != 3:
            raise ModelError(
                f"--channels: found {len(names)} names; expected three, for R, G and B"
            )
        return _picked(channels, [index_of(channels, n) for n in names])
    upper = [c.name.upper() for c in channels]
    if sorted(upper) == ["B", "G", "R"]:
        order = [upper.index(n) for n in "RGB"]
        said = "R, G and B of the fit are taken for linear values of the sRGB primaries"
        return Mixing(_RGB, np.eye(3)[:, order], said)
    if len(channels) == 1:
        said = f"the one channel of the fit, {channels[0].name}, is R, G and B: a grey"
        return Mixing(_RGB, np.ones((1, 3)), said)
    colour = tristimulus(channels, illuminant)
    if colour is not None:
        white = "D65" if sorted(upper) == ["X", "Y", "Z"] else illuminant
        return Mixing(_RGB, colour.matrix @ _xyz_to_srgb(white), colour.sentence)
    visible = [
        k
        for k, c in enumerate(channels)
        if c.wavelength_nm is not None and VISIBLE_NM[0] <= c.wavelength_nm <= VISIBLE_NM[1]
    ]
    if len(visible) == len(channels) == 3:
        visible.sort(key=lambda k: -(channels[k].wavelength_nm or 0.0))
        return _picked(channels, visible)
    listed = ", ".join(c.name for c in channels[:8])
    raise ModelError(
        f"no colour follows from the channels {listed}; expected R, G, B, or "
        f"{FEWEST_WAVELENGTHS} wavelengths in {VISIBLE_NM[0]:g} to {VISIBLE_NM[1]:g} nm; "
        "name three of them with --channels R,G,B"
    )


def tristimulus(
    channels: Sequence[results.Channel], illuminant: str = ILLUMINANT
) -> Mixing | None:
    """X, Y, Z, with Y = 1 for the perfect diffuser; None where no colour follows."""
    upper = [c.name.upper() for c in channels]
    if sorted(upper) == ["X", "Y", "Z"]:
        order = [upper.index(n) for n in "XYZ"]
        said = "X, Y and Z of the fit are taken for D65 and the 2 degree observer"
        return Mixing(_XYZ, np.eye(3)[:, order], said)
    if sorted(upper) == ["B", "G", "R"]:
        order = [upper.index(n) for n in "RGB"]
        said = "R, G and B of the fit are taken for linear values of the sRGB primaries"
        return Mixing(_XYZ, np.eye(3)[:, order] @ srgb_to_xyz(), said)
    w = np.array([c.wavelength_nm or np.nan for c in channels])
    visible = np.isfinite(w) & (w >= VISIBLE_NM[0]) & (w <= VISIBLE_NM[1])
    if np.count_nonzero(visible) < FEWEST_WAVELENGTHS or not np.isfinite(w).all():
        return None
    order = np.flatnonzero(visible)[np.argsort(w[visible])]
    weights = tristimulus_weights(w[order], illuminant=illuminant)
    matrix = np.zeros((len(channels), 3))
    matrix[order] = weights.matrix / 100.0
    said = (
        f"{len(order)} wavelengths ({w[order[0]]:g} to {w[order[-1]]:g} nm) are reduced to "
        f"a colour under {weights.illuminant}, {weights.observer}"
    )
    return Mixing(_XYZ, matrix, said)


def index_of(channels: Sequence[results.Channel], name: str) -> int:
    """Which channel has that name, blanks and case not counting, or that wavelength."""
    plain = name.replace(" ", "").lower().removesuffix("nm")
    for k, c in enumerate(channels):
        if c.name.replace(" ", "").lower().removesuffix("nm") == plain:
            return k
    known = ", ".join(c.name for c in channels)
    raise ModelError(f"--channels {name}: there is no such channel; known: {known}")


def srgb_to_xyz() -> np.ndarray:
    """``xyz = rgb @ matrix`` of linear sRGB, 1 in Y for white."""
    return np.linalg.inv(_xyz_to_srgb("D65"))


def to_equal_energy(illuminant: str = "D65") -> np.ndarray:
    """``xyz_e = xyz @ matrix`` with ``X = Y = Z`` for white; luminance stays as it is."""
    return np.diag(1.0 / _white(illuminant))


def _white(illuminant: str) -> np.ndarray:
    grid = np.arange(380.0, 781.0, 5.0)
    return tristimulus_weights(grid, illuminant=illuminant).white / 100.0


def _picked(channels: Sequence[results.Channel], picks: Sequence[int]) -> Mixing:
    names = ", ".join(channels[k].name for k in picks)
    said = f"{names} of the fit are taken for R, G and B: no colorimetry"
    return Mixing(_RGB, np.eye(len(channels))[:, list(picks)], said)


def _xyz_to_srgb(illuminant: str) -> np.ndarray:
    """``rgb = xyz @ matrix``, adapted from the white of the illuminant to that of sRGB."""
    colour = colour_science()
    space = colour.RGB_COLOURSPACES["sRGB"]
    primaries = colour.normalised_primary_matrix(space.primaries, space.whitepoint)
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        _white(illuminant), primaries.sum(axis=1), transform="Bradford"
    )
    return (np.linalg.inv(primaries) @ adapt).T
