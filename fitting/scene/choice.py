"""What `fitting.scene.choose` answers: plain data, for JSON."""

from __future__ import annotations

import msgspec

from fitting.result import FitResult
from fitting.scene.stage import ImageError

CHOICE_VERSION = 1


class Candidate(msgspec.Struct, frozen=True):
    """A model, refitted for the scene.

    ``operations`` is the deterministic cost of evaluating it in all channels (see
    `fitting.tradeoff.evaluation_cost.operations`), twice as much in float64; ``parameters``
    the number of free ones. ``error`` is that of the picture in ``precision``. ``change``
    is the mean difference of its picture from that of the model that is kept, ``sentence``
    what both mean.
    """

    model: str
    per_channel_shape: bool
    precision: str
    objective: str
    operations: float
    parameters: int
    error: ImageError
    within_tolerance: bool
    change: float = 0.0
    sentence: str = ""


class FewerWavelengths(msgspec.Struct, frozen=True):
    """The kept model with coefficients at some wavelengths only, linear between them."""

    wavelengths_nm: list[float]
    error: ImageError
    within_tolerance: bool


class Choice(msgspec.Struct, frozen=True):
    """The cheapest model that a scene cannot tell from the data, or the nearest one.

    ``limits`` are the tolerance: mean and 95th percentile, or one number for an albedo.
    ``verdict`` says it in one sentence; ``unseen`` what the scene cannot see and is left
    out, ``unsupported`` what the data cannot support. ``error`` is that of ``result``, the
    kept model fitted in full; it differs from its candidate's where penalties act.
    """

    version: int
    scene: str
    measure: str
    limits: list[float]
    met: bool
    candidates: list[Candidate]
    chosen: int
    error: ImageError
    verdict: str
    wavelengths: list[FewerWavelengths]
    unseen: list[str]
    unsupported: list[str]
    extrapolated_share: float
    result: FitResult
