"""A surface by a single lobe of a renderer: that of the fit, or one refitted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fitting.export.parts import Lobes, Values, parts_of, parts_of_lobes, sum_of
from fitting.export.refit import refit
from fitting.export.surface import Surface
from fitting.export.target import Say


@dataclass(frozen=True)
class OneLobe:
    """Values under the lobe's own names, ``base_color (3,)`` and the others numbers."""

    values: Values
    representation: Lobes
    remarks: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        return float(self.values[name])

    @property
    def base_color(self) -> list[float]:
        """Linear reflectance of the base."""
        return [float(v) for v in self.values["base_color"]]


def one_lobe(surface: Surface, name: str, say: Say) -> OneLobe:
    """The values of a lobe of that name, such as ``openpbr``, for a surface.

    Raises `ExportError` if it reflects nothing from the front.
    """
    parts, remarks = parts_of(surface)
    if len(parts) > 1 or not parts[0].named(name):
        parts = parts_of_lobes(refit(surface, name, say))
        remarks = [
            f"{surface.model.expression} was refitted by {name}, which has one highlight"
        ]
        if surface.model.anisotropic:
            remarks.append(
                "the model depends on the azimuth of the sample, the refitted one does not"
            )
    values = {
        n: v if n == "base_color" else np.asarray(np.mean(v))
        for n, v in parts[0].values.items()
    }
    return OneLobe(values, sum_of([(name, values)]), tuple(remarks))
