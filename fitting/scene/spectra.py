"""Spectral powers of lights, and what they are in the channels of a measurement."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.colorimetry import ColourError, colour_science, known_name
from fitting.scene.description import SceneError, Spectrum
from fitting.scene.table import read_table

# m K, the second radiation constant (CODATA 2018, exact).
_C2 = 1.438776877e-2
_EDGE = 1e-6


class Power(NamedTuple):
    """A spectral power: ``of(wavelengths_nm)``, and where it bends or jumps."""

    of: Callable[[np.ndarray], np.ndarray]
    bends_nm: np.ndarray


def power(spectrum: str | Spectrum) -> Power:
    """The spectral power, in arbitrary units, that a scene declares. Raises `SceneError`.

    Of an illuminant it is colour-science's table, linear in between and 0 outside of it
    (E has no end). A black body is Planck's law.
    """
    if isinstance(spectrum, str):
        return _illuminant(spectrum)
    if spectrum.illuminant is not None:
        return _illuminant(spectrum.illuminant)
    if spectrum.blackbody_kelvin is not None:
        kelvin = spectrum.blackbody_kelvin
        return Power(lambda w: _planck(w, kelvin), np.empty(0))
    if spectrum.file is not None:
        table = read_table(Path(spectrum.file), ("wavelength in nm", "power"))
        return _tabulated(*_checked(table, spectrum.file))
    if spectrum.bands is not None:
        return _steps(spectrum.bands)
    d65, rgb = _illuminant("D65"), np.array(spectrum.rgb)
    bends = np.union1d(d65.bends_nm, _mallett()[0])
    return Power(lambda w: d65.of(w) * (rgb @ rgb_parts(w)), bends)


def rgb_parts(wavelengths_nm: np.ndarray) -> np.ndarray:
    """Shares ``(3, n)`` of a white's spectrum that linear sRGB (1, 0, 0), ... have.

    They are positive and add up to 1 everywhere; in the light of D65 their colours are the
    sRGB primaries (Mallett and Yuksel 2019, colour-science's table, kept constant outside
    of 380 to 780 nm).
    """
    w, table = _mallett()
    parts = np.stack([np.interp(wavelengths_nm, w, row) for row in table])
    # The published table adds up to 1 within 1e-5.
    return parts / parts.sum(axis=0)


def channel_means(spectrum: Power, wavelengths_nm: np.ndarray) -> np.ndarray:
    """Power ``(c,)`` in channels at different wavelengths, in any order.

    The mean over the wavelengths up to both neighbours, with a weight that falls linearly
    from 1 to 0, so that the lines of a lamp count wherever they fall (with channels of 10
    nm the chromaticity of FL11 is off by 0.0014). The first and last channel reach as far
    out as in; a single one has the power at its wavelength.
    """
    order = np.argsort(wavelengths_nm)
    w = np.asarray(wavelengths_nm, dtype=np.float64)[order]
    if w.size == 1:
        return spectrum.of(w)
    nodes = np.concatenate([[2 * w[0] - w[1]], w, [2 * w[-1] - w[-2]]])
    out = np.empty(w.size)
    for k in range(w.size):
        left, centre, right = nodes[k : k + 3]
        x = np.linspace(left, right, 2 * max(8, round(right - left)) + 1)
        x = grid(np.append(x, centre), spectrum.bends_nm)
        weight = np.interp(x, [left, centre, right], [0.0, 1.0, 0.0])
        out[order[k]] = np.trapezoid(weight * spectrum.of(x), x) / (0.5 * (right - left))
    return out


def grid(wavelengths_nm: np.ndarray, bends_nm: np.ndarray) -> np.ndarray:
    """Wavelengths with those at which a spectrum bends, within the same range."""
    low, high = wavelengths_nm.min(), wavelengths_nm.max()
    inside = bends_nm[(bends_nm > low) & (bends_nm < high)]
    return np.union1d(wavelengths_nm, inside)


def _illuminant(name: str) -> Power:
    try:
        known = known_name("illuminant", name, colour_science().SDS_ILLUMINANTS)
    except ColourError as error:
        raise SceneError(str(error)) from error
    if known == "E":
        return Power(lambda w: np.ones(np.shape(w)), np.empty(0))
    table: Any = colour_science().SDS_ILLUMINANTS[known]
    return _tabulated(np.asarray(table.wavelengths), np.asarray(table.values))


def _tabulated(w: np.ndarray, values: np.ndarray) -> Power:
    ends = (w[0] - _EDGE, w[-1] + _EDGE)
    return Power(
        lambda x: np.interp(x, w, values, left=0.0, right=0.0),
        np.concatenate([[ends[0]], w, [ends[1]]]),
    )


def _checked(table: np.ndarray, path: str) -> tuple[np.ndarray, np.ndarray]:
    w, values = table.T
    if w.size < 2 or np.any(np.diff(w) <= 0):
        raise SceneError(f"{path}: expected at least two wavelengths in nm, ascending")
    if w[0] < 100 or w[-1] > 100_000:
        raise SceneError(
            f"{path}: wavelengths from {w[0]:g} to {w[-1]:g}; expected nm, 100 to 100000"
        )
    if np.any(values < 0) or not np.any(values > 0):
        raise SceneError(
            f"{path}: powers go from {values.min():g} to {values.max():g}; expected none "
            "below 0 and some above"
        )
    return w, values


def _steps(bands: tuple[tuple[float, float, float], ...]) -> Power:
    def of(w: np.ndarray) -> np.ndarray:
        x = np.asarray(w, dtype=np.float64)
        inside = [np.where((x >= low) & (x <= high), p, 0.0) for low, high, p in bands]
        return np.sum(inside, axis=0)

    edges = np.array([edge for low, high, _ in bands for edge in (low, high)])
    return Power(of, np.unique(np.concatenate([edges - _EDGE, edges, edges + _EDGE])))


def _planck(wavelengths_nm: np.ndarray, kelvin: float) -> np.ndarray:
    """Spectral radiance per wavelength, 1 at 560 nm (CIE 15's reference wavelength)."""
    w = np.asarray(wavelengths_nm, dtype=np.float64)
    with np.errstate(over="ignore"):
        exponent = _C2 / (kelvin * 1e-9)
        return (560.0 / w) ** 5 * np.expm1(exponent / 560.0) / np.expm1(exponent / w)


def _mallett() -> tuple[np.ndarray, np.ndarray]:
    table: Any = colour_science().recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019
    return np.asarray(table.wavelengths), np.asarray(table.values).T
