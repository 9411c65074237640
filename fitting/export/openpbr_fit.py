"""The lobe `openpbr` for a surface: that of the fit, or one refitted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fitting.export.parts import Lobes, Values, parts_of, parts_of_lobes, sum_of
from fitting.export.refit import refit
from fitting.export.surface import Surface
from fitting.export.target import Say


@dataclass(frozen=True)
class Found:
    """Values under OpenPBR's own names, ``base_color (3,)`` and the others scalars."""

    values: Values
    lobes: Lobes
    remarks: tuple[str, ...]


def openpbr_of(surface: Surface, say: Say) -> Found:
    """The values of OpenPBR's base for a surface. Raises `ExportError`."""
    parts, remarks = parts_of(surface)
    if len(parts) > 1 or not parts[0].named("openpbr"):
        lobes = refit(surface, "openpbr", say)
        parts = parts_of_lobes(lobes)
        remarks = [f"{surface.model.expression} was refitted by OpenPBR's base"]
        if surface.model.anisotropic:
            remarks.append(
                "the model depends on the azimuth of the sample, the refitted one does not"
            )
    values = {
        n: v if n == "base_color" else np.asarray(np.mean(v))
        for n, v in parts[0].values.items()
    }
    return Found(values, sum_of([("openpbr", values)]), tuple(remarks))
