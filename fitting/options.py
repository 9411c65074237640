"""What a user decides about a fit, with the defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fitting.objectives import ObjectiveName

Value = float | np.ndarray


@dataclass(frozen=True)
class FitOptions:
    """Options of one fit.

    - ``objective``: a name of `fitting.objectives.OBJECTIVES` or ``auto``, which is
      ``chi2`` where the data carry standard uncertainties and ``log1p`` where not.
    - ``weights``: ``solid-angle`` (each row counts for the part of the hemisphere that it
      stands for) or ``rows``; ``chi2`` and ``l2`` are never weighted by solid angle.
    - ``max_theta_deg``: rows beyond this polar angle, of source or detector, are left out.
    - ``robust``: pseudo-Huber residuals, with the width taken from a first plain fit.
    - ``noise``: relative and absolute standard uncertainty for ``chi2`` where the data
      carry none.
    - ``energy``: weight of the penalty on a directional albedo above 1, ``0`` for none,
      or ``"hard"`` for coefficients that cannot exceed it.
    - ``reciprocity``: weight of the penalty on ``f(wi, wo) - f(wo, wi)``; models that are
      reciprocal by construction need none.
    - ``fix``, ``bounds``, ``tie``: by parameter name, with ``*`` for any part:
      ``{"ggx.f90": 1.0}``, ``{"ggx.alpha": (0.01, 0.3)}``, ``{"ggx.f0": "0.04*ggx.f90"}``.
    - ``per_channel_shape``: shape parameters of every channel for itself.
    - ``starts``: number of starting points that are refined to the end.
    """

    objective: ObjectiveName | Literal["auto"] = "auto"
    weights: Literal["solid-angle", "rows"] = "solid-angle"
    max_theta_deg: float = 85.0
    robust: bool = False
    noise: tuple[float, float] | None = None
    energy: float | Literal["hard"] = 1.0
    reciprocity: float = 1.0
    fix: Mapping[str, Value] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    tie: Mapping[str, str] = field(default_factory=dict)
    per_channel_shape: bool = False
    starts: int = 8
