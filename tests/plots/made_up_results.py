"""Results with known parameters, as a fit would state them, without the time of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version

import msgspec
import numpy as np

from data_formats import Measurement
from fitting.model import Model
from fitting.result import (
    SCHEMA_VERSION,
    AngleError,
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
from fitting.scoring import score

RELATIVE_UNCERTAINTY = 0.03


def result_of(
    expression: str, values: Mapping[str, object], m: Measurement, **changes: object
) -> FitResult:
    """A result with these parameters and a relative uncertainty of 3 % each."""
    model = Model(expression)
    parameters = [
        _parameter(name, p, values.get(name, p.default), m.n_channels)
        for name, p in model.parameters().items()
    ]
    free = [p.name for p in parameters]
    random = np.random.default_rng(3)
    matrices = []
    for _ in range(m.n_channels):
        loading = random.normal(size=(len(free), 3))
        covariance = loading @ loading.T + 0.5 * np.eye(len(free))
        sd = np.sqrt(np.diag(covariance))
        matrices.append((covariance / np.outer(sd, sd)).tolist())
    polar = np.unique(np.round(np.degrees(m.theta_i), 3))
    result = FitResult(
        schema_version=SCHEMA_VERSION,
        model=model.expression,
        channels=[Channel(c.name, c.wavelength_nm) for c in m.channels],
        parameters=parameters,
        uncertainty_method="assumed",
        correlations=Correlations(free, matrices),
        identifiability=[],
        settings=Settings(
            objective="log1p", weights="solid-angle", max_theta_deg=90.0, robust=False,
            noise=None, per_channel_shape=False, starts=8, energy=1.0, reciprocity=0.0,
            fix={}, bounds={}, tie={},
        ),
        scores=Scores(0.0, 0.0, 0.0, 0.0, 0.0, None),
        by_angle=[AngleError(float(t), 1, 0.0, 0.0) for t in polar],
        by_channel=[],
        cross_validation=None,
        energy=Energy(0.9, 89.5, m.channels[0].name, "penalty", 1.0, False),
        reciprocity=Reciprocity(0.0, True, None),
        colour=None,
        solver=Solver("converged; 6 of 8 starts agree", True, 0.5, 9, 8, 6, 1.25),
        data=Data(
            path=m.provenance.path, sha256=m.provenance.sha256, format=m.provenance.format,
            instrument="", sample="a made-up sample", date="", symmetry=m.symmetry,
            rows=m.n_rows, rows_used=m.n_rows, left_out=[], notes=[], reciprocity=None,
            albedo=[],
        ),
        versions={"brdf-fitting": version("brdf-fitting")},
        references=[],
    )  # fmt: skip
    result = msgspec.structs.replace(result, **changes)
    return msgspec.structs.replace(result, scores=score(m, result).scores)


def _parameter(name: str, p, value: object, channels: int) -> ParameterResult:
    numbers = np.atleast_1d(np.asarray(value, dtype=float))
    if p.coefficient:
        numbers = np.broadcast_to(numbers, (channels,))
    sd = RELATIVE_UNCERTAINTY * np.abs(numbers)
    ends = np.stack([numbers - 2 * sd, numbers + 2 * sd], axis=1)
    return ParameterResult(
        name=name,
        kind="coefficient" if p.coefficient else "shape",
        unit=p.unit,
        meaning=p.meaning,
        support=(None, None),
        value=numbers.tolist(),
        standard_uncertainty=sd.tolist(),
        interval_95=[(low, high) for low, high in ends.tolist()],
        at_bound=[False] * numbers.size,
        fixed=False,
        tied_to=None,
    )
