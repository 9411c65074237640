"""Results with given parameters, as if fitted: an export does not ask how they came."""

from __future__ import annotations

import numpy as np

from fitting.model import Model
from fitting.result import (
    SCHEMA_VERSION,
    Channel,
    Correlations,
    Data,
    Energy,
    FitResult,
    ParameterResult,
    Reciprocity,
    Scores,
    Settings,
    Solver,
)

RGB = tuple(Channel(n, None) for n in "RGB")
WAVELENGTHS = (400.0, 450.0, 500.0, 550.0, 600.0, 700.0)
SPECTRAL = tuple(Channel(f"{w:g} nm", w) for w in WAVELENGTHS)


def result_of(expression: str, channels=RGB, **values) -> FitResult:
    """A result of a model; values by name with ``__`` for the dot, others by default."""
    model = Model(expression)
    given = {n.replace("__", "."): v for n, v in values.items()}
    assert set(given) <= set(model.parameters())
    parameters = [
        _parameter(name, p, given.get(name, p.default), len(channels))
        for name, p in model.parameters().items()
    ]
    return FitResult(
        schema_version=SCHEMA_VERSION, model=model.expression, channels=list(channels),
        parameters=parameters, uncertainty_method="none",
        correlations=Correlations([], []), identifiability=[],
        settings=Settings(
            "log1p", "rows", 85.0, False, None, False, 1, 0.0, 0.0, {}, {}, {}
        ),
        scores=Scores(0.0, 0.0, 0.0, 0.0, 0.0, None), by_angle=[], by_channel=[],
        cross_validation=None, energy=Energy(0.5, 0.0, "R", "none", None, False),
        reciprocity=Reciprocity(0.0, True, None), colour=None,
        solver=Solver("made up", True, 0.0, 0, 1, 1, None),
        data=Data("", "", "", "", "test", "", "isotropic", 0, 0, [], [], None, []),
        versions={}, references=[],
    )  # fmt: skip


def _parameter(name: str, p, value, channels: int) -> ParameterResult:
    wide = np.atleast_1d(np.asarray(value, dtype=float))
    if p.coefficient:
        wide = np.broadcast_to(wide, channels)
    n = wide.size
    return ParameterResult(
        name=name, kind="coefficient" if p.coefficient else "shape", unit=p.unit,
        meaning=p.meaning, support=(None, None), value=wide.tolist(),
        standard_uncertainty=[None] * n, interval_95=[None] * n, at_bound=[False] * n,
        fixed=False, tied_to=None,
    )  # fmt: skip


def directions(seed: int, count: int = 2000, alpha: float = 0.1, lowest: float = 0.09):
    """Pairs ``(count, 3)`` of unit vectors in float32, half of them in the highlight."""
    rng = np.random.default_rng(seed)

    def anywhere():
        z, phi = rng.uniform(lowest, 1.0, count), rng.uniform(0, 7, count)
        sine = np.sqrt(1 - z * z)
        return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=-1)

    wi, elsewhere = anywhere(), anywhere()
    share, phi = rng.uniform(0, 0.9, count), rng.uniform(0, 7, count)
    slope = alpha * np.sqrt(share / (1 - share))
    h = np.stack([slope * np.cos(phi), slope * np.sin(phi), np.ones(count)], axis=-1)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    wo = 2 * np.sum(wi * h, axis=-1, keepdims=True) * h - wi
    near = (rng.random(count) < 0.5) & (wo[..., 2] > lowest)
    wo = np.where(near[..., None], wo, elsewhere)
    return wi.astype(np.float32), wo.astype(np.float32)


def geometry_of(wi, wo):
    """The geometry of vectors ``(n, 3)``, in float64."""
    from fitting.geometry import from_components

    a, b = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
    return from_components(*(v[:, k] for v in (a, b) for k in range(3)))
