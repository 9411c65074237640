"""How much each measured row matters to a picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.objectives import ObjectiveName, slope
from fitting.options import FitOptions
from fitting.problem import residual_terms
from fitting.scene.nodes import Nodes
from fitting.scene.picture import Picture
from fitting.scene.reference import Reference
from fitting.scene.render import Image

if TYPE_CHECKING:
    from fitting.scene.stage import Stage

# Of the mean: what no one looks at still keeps the model physical.
_FLOOR = 0.02
# Of the median: values near zero are not told to the last percent.
_LEAST_CHANGE = 0.2


def row_weights(stage: Stage, objective: ObjectiveName) -> np.ndarray:
    """Weights ``(rows of the measurement,)`` by which an objective sees what a scene does.

    An error of one percent in a row's value shall count for its `importance`, however the
    objective compresses values: a residual ``phi(v)`` changes by ``phi'(v) v`` then, and
    the weight of its square is the importance over the square of that.
    """
    rows = stage.rows
    terms = residual_terms(rows, objective, FitOptions(objective=objective))
    v = terms.value * terms.kappa
    change = np.mean(np.abs(slope(objective, v) * v), axis=0)
    change = np.maximum(change, _LEAST_CHANGE * np.median(change))
    out = np.zeros(stage.measurement.n_rows)
    own = stage.importance / change**2
    out[rows.index] = own / own.mean()
    return out


def importance(
    rows: int,
    lights: Sequence[Nodes],
    picture: Picture,
    whole_of_data: Image,
    reference: Reference,
    luminous: np.ndarray,
) -> np.ndarray:
    """How much each row matters to a picture ``(n,)``, mean 1.

    A row gets what the nodes around it contribute to the lightness of their pixels: the
    share ``f w / L`` of the pixel's luminance, times the cube root of ``L``, as lightness
    has it (CIE 15:2018), since an error of one percent is seen more where it is bright. Two
    hundredths of the mean are spread over all rows.
    """
    of_pixel = np.maximum(whole_of_data.radiance @ luminous, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(of_pixel > 0, picture.weight * of_pixel ** (-2.0 / 3.0), 0.0)
    total = np.zeros(rows)
    for light in lights:
        power = light.weight.T @ (light.emitter.spectrum * luminous)
        value = np.abs(reference.value(light.geometry))
        share = np.sum(value * power, axis=1) * factor[light.sum % picture.size]
        total += np.bincount(reference.nearest(light.geometry), np.abs(share), rows)
    total = total / max(total.mean(), 1e-300) + _FLOOR
    return total / total.mean()
