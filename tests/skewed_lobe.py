"""A lobe that is not reciprocal, for as long as a test lasts."""

from __future__ import annotations

import sys
import types
from typing import ClassVar

import jax.numpy as jnp
import pytest

from fitting.models import LOBES, Lobe
from fitting.parameters import coefficient, shape


class Skewed(Lobe):
    """``albedo/pi (1 + skew (cos_i - cos_o))``: violates reciprocity by its skew."""

    NAME: ClassVar[str] = "skewed"
    REFERENCE: ClassVar[str] = "made for a test"
    RECIPROCAL: ClassVar[bool] = False
    LINEAR: ClassVar[bool] = True
    ALBEDO_BOUND: ClassVar[float | None] = None

    def parameters(self):
        return (
            shape("skew", 0.1, (0.0, 0.9), "asymmetry", scale="linear", start=(0.05, 0.8)),
            coefficient("albedo", 0.5, "albedo"),
        )

    def basis(self, shape, geometry):
        g = geometry
        value = (1.0 + shape["skew"] * (g.cos_i - g.cos_o)) / jnp.pi
        return (jnp.where(g.reflects, value, 0.0),)

    def amplitudes(self, shape, coefficients):
        return coefficients

    def peak(self, shape):
        return None


def install(patch: pytest.MonkeyPatch) -> None:
    """Make it a lobe like any other, ``skewed``."""
    module = types.ModuleType("fitting.models.skewed")
    vars(module)["Skewed"] = Skewed
    patch.setitem(sys.modules, "fitting.models.skewed", module)
    patch.setitem(LOBES, "skewed", "Skewed")
