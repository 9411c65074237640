"""What the targets of this program's own tables share: a fit on a stated grid."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import data_formats
from fitting.export.channels import as_fitted, index_of
from fitting.export.sampled import grid_of, measurement_of, narrowest
from fitting.export.surface import surface_of
from fitting.export.target import Product, Request
from fitting.result import FitResult

OPTIONS = ("channels", "theta_i", "theta_r", "phi_r")


def product_of(result: FitResult, request: Request, path: Path, format: str) -> Product:
    """The fit at the angles of a grid, all channels or some, for one of our formats."""
    mixing = as_fitted(result.channels)
    if request.channels:
        picks = [index_of(result.channels, n) for n in request.channels]
        mixing = type(mixing)(
            tuple(mixing.channels[k] for k in picks), mixing.matrix[:, picks],
            f"of the fit's channels {', '.join(request.channels)}",
        )  # fmt: skip
    surface = surface_of(result, mixing)
    angles = grid_of(surface, request)
    degrees = np.degrees(angles)
    stated = [
        f"{name} {_listed(a)}"
        for name, a in zip(
            ("theta_i", "theta_r", "phi_r - phi_i"),
            (degrees[0], degrees[2], np.round(degrees[3] - degrees[1], 9)),
            strict=True,
        )
    ]
    remarks: list[str] = []
    width = narrowest(surface)
    step = _step(degrees[2])
    if width is not None and step > width:
        remarks.append(
            f"the narrowest peak is about {width:.2g} degrees wide, and the grid's steps "
            f"of theta_r are {step:.3g} degrees: give finer ones with --theta-r"
        )

    def write(target: Path, comment: Sequence[str]) -> None:
        data_formats.write(measurement_of(surface, angles, comment), target, format=format)

    return Product(
        surface=surface,
        representation=None,
        ways=surface.model.ways,
        conventions=(
            f"{angles.shape[1]} rows, in degrees: {'; '.join(stated)}",
            f"BSDF in 1/sr without cosine; {mixing.sentence}",
        ),
        remarks=tuple(remarks),
        write=write,
    )


def _listed(degrees: np.ndarray) -> str:
    """Angles as ``0 to 80 in steps of 10``, or one by one."""
    found = np.unique(np.round(degrees, 6))
    if len(found) > 3 and np.ptp(np.diff(found)) < 1e-6:
        return f"{found[0]:g} to {found[-1]:g} in steps of {found[1] - found[0]:g}"
    return ", ".join(f"{a:g}" for a in found)


def _step(degrees: np.ndarray) -> float:
    found = np.unique(np.round(degrees, 6))
    return float(np.max(np.diff(found[found <= 90.0]), initial=0.0))
