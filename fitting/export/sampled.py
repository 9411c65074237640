"""A fit at the angles of a grid, as a measurement without noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from data_formats import Measurement, Note, Provenance
from fitting.export.surface import Surface
from fitting.export.target import Request
from fitting.geometry import from_angles
from fitting.models.lobe import FROM_BACK, THROUGH

_THETA_I = tuple(np.arange(0.0, 81.0, 10.0))
_THETA_R = tuple(np.arange(0.0, 81.0, 5.0))
_PHI = 15.0
_PHI_I = 30.0


def grid_of(surface: Surface, request: Request) -> np.ndarray:
    """``theta_i, phi_i, theta_r, phi_r (4, n)`` in radians, and once where azimuths do not
    matter.

    By default 0 to 80 degrees in steps of 10 (source) and of 5 (detector) on every side
    that the model knows, and azimuths in steps of 15, over half a turn for isotropic
    models; for others the source goes around in steps of 30.
    """
    model = surface.model
    front, back = _sides(_THETA_I), _sides(_THETA_R)
    sources = request.theta_i or tuple(
        t for k in (0, 1) if _lit(model.ways, k) for t in front[k]
    )
    detectors = request.theta_r or tuple(
        t for k in (0, 1) if _collected(model.ways, k) for t in back[k]
    )
    turn = 360.0 if model.anisotropic else 180.0
    end = turn - _PHI if model.anisotropic else turn
    azimuths = request.phi_r or tuple(np.arange(0.0, end + 1e-9, _PHI))
    turns = tuple(np.arange(0.0, 359.0, _PHI_I)) if model.anisotropic else (0.0,)
    rows = [
        (i, a, r, a + p)
        for i in sources
        for a in (turns if 0.0 < i < 180.0 or model.anisotropic else turns[:1])
        for r in detectors
        for p in (azimuths if 0.0 < r < 180.0 else azimuths[:1])
    ]
    angles = np.radians(np.array(rows).T)
    known = from_angles(*angles)
    return angles[:, np.asarray(known.on(model.ways))]


def narrowest(surface: Surface) -> float | None:
    """About the half width of the narrowest peak of the lobes, in degrees."""
    from fitting.export.pairs import widths

    found = widths(surface.model, surface.result.values)
    return min(found, default=None)


def measurement_of(
    surface: Surface, angles: np.ndarray, comment: Sequence[str] = ()
) -> Measurement:
    """The fit at angles in radians, with lines of comment as notes."""
    value = surface(from_angles(*angles))
    data = surface.result.data
    return Measurement(
        *angles,
        value=value,
        valid=np.ones(value.shape, dtype=bool),
        channels=surface.channels,
        symmetry="anisotropic" if surface.model.anisotropic else "bilateral",
        provenance=Provenance(
            sample=data.sample,
            instrument="none: values of a fitted model",
            header={"COMMENT": f"values of {surface.model.expression}, not a measurement"},
        ),
        notes=tuple(Note("exported", line) for line in comment),
    )


def _sides(theta: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(theta), tuple(180.0 - t for t in theta)


def _lit(ways: Sequence[str], side: int) -> bool:
    return any((w in FROM_BACK) == bool(side) for w in ways)


def _collected(ways: Sequence[str], side: int) -> bool:
    return any(((w in FROM_BACK) != (w in THROUGH)) == bool(side) for w in ways)
