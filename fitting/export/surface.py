"""A fitted model in the channels of a target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_formats import Channel
from fitting.export.channels import Mixing
from fitting.geometry import Geometry
from fitting.model import Model
from fitting.predict import predict_geometry
from fitting.result import FitResult


@dataclass(frozen=True)
class Surface:
    """The BSDF of a fit, its channels mixed to those of a target.

    ``surface(geometry)`` is ``f (n, fitted channels) @ mixing.matrix``, 1/sr.
    """

    result: FitResult
    model: Model
    mixing: Mixing

    def __call__(self, geometry: Geometry) -> np.ndarray:
        f = predict_geometry(self.model, self.result.values, geometry)
        f = f.reshape(f.shape[0], -1)
        return np.broadcast_to(f, (f.shape[0], len(self.result.channels))) @ (
            self.mixing.matrix
        )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Of the target."""
        return self.mixing.channels


def surface_of(result: FitResult, mixing: Mixing) -> Surface:
    """The surface of a result. Raises `ModelError` if its model is not known here."""
    return Surface(result, Model(result.model), mixing)
