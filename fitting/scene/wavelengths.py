"""How many wavelengths a scene requires of a fitted model."""

from __future__ import annotations

import numpy as np

from fitting.scene.choice import FewerWavelengths
from fitting.scene.refit import Refit
from fitting.scene.stage import Stage

_STEPS = (2, 3, 5, 6, 10, 15)
_FEWEST = 3


def fewer_wavelengths(stage: Stage, found: Refit) -> list[FewerWavelengths]:
    """The model with coefficients at every second, third ... wavelength, linear between.

    From many to few, as far as the scene's tolerance allows and the first that it does not.
    Empty for named bands.
    """
    w = stage.measurement.wavelengths
    if w is None or w.size < 2 * _FEWEST:
        return []
    order = np.argsort(w)
    out: list[FewerWavelengths] = []
    for step in _STEPS:
        count = (w.size - 1) // step + 1
        if count < _FEWEST:
            break
        at = np.unique(np.linspace(0, w.size - 1, count).round().astype(int))
        kept = w[order][at]
        values = {
            n: v if np.ndim(v) == 0 or np.size(v) == 1 else np.interp(w, kept, v[order][at])
            for n, v in found.values.items()
        }
        error = stage.error(found.model, values)
        within = stage.within(error)
        out.append(FewerWavelengths([float(x) for x in kept], error, within))
        if not within:
            break
    return out
