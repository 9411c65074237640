"""What a user decides about a fit, with the defaults."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fitting.expression import ModelError
from fitting.objectives import OBJECTIVES, ObjectiveName

Value = float | np.ndarray


@dataclass(frozen=True)
class FitOptions:
    """Options of one fit.

    - ``objective``: a name of `fitting.objectives.OBJECTIVES` or ``auto``, which is
      ``chi2`` where the data carry standard uncertainties and ``log1p`` where not.
    - ``weights``: ``solid-angle`` (each row counts for the part of the hemisphere that it
      stands for), ``rows``, or an array of one number from 0 on per row of the measurement;
      ``chi2`` and ``l2`` are never weighted.
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
    - ``material``: by lobe, what fixes its index in every channel: ``{"ggx": "Au"}``, or a
      file; see `fitting.refractive_index`.
    - ``per_channel_shape``: shape parameters of every channel for itself.
    - ``starts``: number of starting points that are refined to the end.
    """

    objective: ObjectiveName | Literal["auto"] = "auto"
    weights: Literal["solid-angle", "rows"] | np.ndarray = "solid-angle"
    max_theta_deg: float = 85.0
    robust: bool = False
    noise: tuple[float, float] | None = None
    energy: float | Literal["hard"] = 1.0
    reciprocity: float = 1.0
    fix: Mapping[str, Value] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    tie: Mapping[str, str] = field(default_factory=dict)
    material: Mapping[str, str] = field(default_factory=dict)
    per_channel_shape: bool = False
    starts: int = 8

    def __post_init__(self) -> None:
        def refuse(name: str, expected: str) -> None:
            raise ModelError(
                f"option {name} is {getattr(self, name)!r}; expected {expected}"
            )

        if self.objective != "auto" and self.objective not in OBJECTIVES:
            raise ModelError(
                f"no objective {self.objective!r}; choose of {', '.join(OBJECTIVES)}, auto"
            )
        if isinstance(self.weights, np.ndarray):
            w = self.weights
            if w.ndim != 1 or not np.all(np.isfinite(w) & (w >= 0)) or not np.any(w > 0):
                raise ModelError(
                    "option weights: expected one finite number from 0 on per row, some "
                    "above 0"
                )
        elif self.weights not in ("solid-angle", "rows"):
            refuse("weights", "'solid-angle', 'rows', or an array")
        if not _is_number(self.max_theta_deg) or not 0 < self.max_theta_deg <= 90:
            refuse("max_theta_deg", "an angle above 0 and up to 90")
        if self.energy != "hard" and not (_is_number(self.energy) and self.energy >= 0):
            refuse("energy", "a number from 0 on, or 'hard'")
        if not _is_number(self.reciprocity) or self.reciprocity < 0:
            refuse("reciprocity", "a number from 0 on")
        if (
            isinstance(self.starts, bool)
            or not isinstance(self.starts, int)
            or self.starts < 1
        ):
            refuse("starts", "a whole number from 1 on")
        noise = self.noise
        if noise is not None and not (
            len(noise) == 2 and all(_is_number(v) and v >= 0 for v in noise) and any(noise)
        ):
            refuse("noise", "two numbers from 0 on, not both 0")
        for name in ("fix", "bounds", "tie", "material"):
            if not isinstance(getattr(self, name), Mapping):
                refuse(name, "a mapping from parameter names")
        for name, bound in self.bounds.items():
            if not isinstance(bound, tuple | list) or len(bound) != 2:
                raise ModelError(f"bounds of {name} are {bound!r}; expected (low, high)")
            if not all(isinstance(v, int | float) and v == v for v in bound):
                raise ModelError(f"bounds of {name} are {bound!r}; expected two numbers")
        for name, text in self.tie.items():
            if not isinstance(text, str):
                raise ModelError(f"tie of {name} is {text!r}; expected 'factor*other'")


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value)
