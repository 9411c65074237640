"""Every registered lobe with every combination of its options, and points to try it at."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.geometry import Geometry, from_angles
from fitting.models import LOBES, Lobe, lobe_class
from fitting.parameters import Parameter

OPTIONS = {"anisotropic": (False, True), "fresnel": ("schlick", "dielectric")}

WIDTHS = (1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0, 1.5)
THETAS_DEG = (0.0, 1e-6, 1e-3, 45.0, 89.0, 89.9, 90 - 1e-6, 90.0)


@dataclass(frozen=True)
class Case:
    """A lobe class with a choice of options."""

    name: str
    options: tuple[tuple[str, object], ...]

    def __str__(self) -> str:
        words = [
            "aniso" if v is True else "iso" if v is False else v for _, v in self.options
        ]
        return f"{self.name}({','.join(map(str, words))})" if words else self.name

    @property
    def lobe(self) -> Lobe:
        return lobe_class(self.name)(**dict(self.options))

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        return tuple(p for p in self.lobe.parameters() if not p.coefficient)

    @property
    def anisotropic(self) -> bool:
        return ("anisotropic", True) in self.options


def _cases() -> list[Case]:
    cases: list[Case] = []
    for name in LOBES:
        fields = [f for f in OPTIONS if f in lobe_class(name).__dataclass_fields__]
        for values in itertools.product(*(OPTIONS[f] for f in fields)):
            cases.append(Case(name, tuple(zip(fields, values, strict=True))))
    return cases


CASES = _cases()


def extreme_values(p: Parameter) -> tuple[float, ...]:
    """Values over the closed support of a shape parameter, ends included."""
    low, high = p.support
    if p.name.startswith("alpha"):
        return WIDTHS
    if p.scale == "periodic":
        return (low, 0.3 * high)
    if p.scale == "log":
        return tuple(np.geomspace(low, high, 5))
    return tuple(low + (high - low) * np.array([0.0, 0.3, 1.0]))


def extreme_shapes(case: Case) -> dict[str, np.ndarray]:
    """All combinations of the extreme values, one array per parameter."""
    grid = list(itertools.product(*(extreme_values(p) for p in case.shapes)))
    columns = np.array(grid, dtype=np.float64).reshape(len(grid), len(case.shapes)).T
    return {p.name: c for p, c in zip(case.shapes, columns, strict=True)}


def default_shape(case: Case) -> dict[str, jax.Array]:
    return {p.name: jnp.asarray(p.default) for p in case.shapes}


def extreme_geometry() -> Geometry:
    """Normal to grazing for both directions; retro, mirror, oblique and nearly opposite."""
    theta = np.radians(THETAS_DEG)
    ti, tr, dphi = np.meshgrid(theta, theta, np.radians([0.0, 40.0, 90.0, 180.0]))
    return from_angles(ti.ravel(), 0.3, tr.ravel(), 0.3 + dphi.ravel())


def on_device(geometry: Geometry) -> Geometry:
    """The geometry as JAX arrays of the current precision."""
    return jax.tree.map(jnp.asarray, geometry)
