"""Who looks at a scene: how wavelengths count for the observer or the instrument."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fitting.colorimetry import OBSERVER, ColourError, colour_science, known_name
from fitting.scene.description import SceneError, Viewer
from fitting.scene.spectra import Power, grid

# Steps of the integral over an instrument's wavelengths.
_STEPS = 2000


class Observer(NamedTuple):
    """Colour matching functions ``table (n, 3)`` at ``wavelengths_nm (n,)``.

    They are 0 outside of the viewer's wavelengths. ``luminous (n,)`` is how much
    wavelengths count for brightness: the second of them, or the same for all if there is
    no eye.
    """

    name: str
    wavelengths_nm: np.ndarray
    table: np.ndarray
    luminous_nm: np.ndarray
    luminous: np.ndarray


def has_eye(viewer: Viewer) -> bool:
    """Whether colours are seen, by a standard observer or a renderer in RGB."""
    return viewer.observer.strip().lower() != "none"


def observer_name(viewer: Viewer) -> str:
    """colour-science's name; that of 1931 for RGB and for none. Raises `SceneError`."""
    if viewer.observer.strip().lower() in ("rgb", "none"):
        return OBSERVER
    tables: Any = colour_science().MSDS_CMFS
    with_xyz = [name for name in tables if "x_bar" in tables[name].signals]
    try:
        return known_name("observer", viewer.observer, with_xyz)
    except ColourError as error:
        raise SceneError(f"{error}; or RGB, or none") from error


def observer(viewer: Viewer) -> Observer:
    """The colour matching functions within the viewer's wavelengths, in steps of 1 nm."""
    name = observer_name(viewer)
    cmfs: Any = colour_science().MSDS_CMFS[name]
    low, high = viewer.wavelengths_nm
    w = np.asarray(cmfs.wavelengths, dtype=np.float64)
    x = np.union1d(np.arange(np.ceil(w[0]), w[-1] + 1e-9), np.array([low, high]))
    x = x[(x >= max(low, w[0])) & (x <= min(high, w[-1]))]
    table = np.stack([np.interp(x, w, v) for v in np.asarray(cmfs.values).T], axis=1)
    if has_eye(viewer):
        return Observer(name, x, table, x, table[:, 1])
    everywhere = np.linspace(low, high, _STEPS + 1)
    return Observer(name, x, table, everywhere, np.ones(everywhere.size))


def brightness(by: Observer, spectrum: Power) -> float:
    """Power as the observer weighs it, 1 for an equal-energy spectrum of 1."""
    return _mean(by.luminous_nm, by.luminous, spectrum)


def tristimulus_of(by: Observer, spectrum: Power) -> np.ndarray:
    """XYZ ``(3,)`` of a spectrum, 1 in Y for an equal-energy spectrum of 1."""
    scale = np.trapezoid(by.table[:, 1], by.wavelengths_nm) if by.table.size else 0.0
    if not scale > 0:
        return np.zeros(3)
    each = (_integral(by.wavelengths_nm, column, spectrum) for column in by.table.T)
    return np.array(list(each)) / scale


def _mean(w: np.ndarray, weight: np.ndarray, spectrum: Power) -> float:
    total = float(np.trapezoid(weight, w)) if w.size > 1 else 0.0
    return _integral(w, weight, spectrum) / total if total > 0 else 0.0


def _integral(w: np.ndarray, weight: np.ndarray, spectrum: Power) -> float:
    x = grid(w, spectrum.bends_nm)
    return float(np.trapezoid(np.interp(x, w, weight) * spectrum.of(x), x))
