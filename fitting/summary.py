"""Parameters, uncertainties, correlations and what they mean, in words."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np

from fitting import identifiability
from fitting.model import Model
from fitting.parameters import is_flat, slope_of_value
from fitting.reduced import Problem
from fitting.result import Correlations, ParameterResult, finite_or_none
from fitting.solve import Solution
from fitting.uncertainty import Covariance


@dataclasses.dataclass(frozen=True)
class Found:
    """The best minimum of one problem (all channels, or one of them), and all ends."""

    problem: Problem
    solution: Solution
    ends: tuple[Solution, ...]

    @property
    def costs(self) -> tuple[float, ...]:
        """Where every start ended, infinite for one that failed."""
        cost = (float(e.cost) for e in self.ends)
        return tuple(c if np.isfinite(c) else np.inf for c in cost)

    def values(self) -> dict[str, np.ndarray]:
        """All parameters by name; coefficients ``(c,)``."""
        return values_at(
            self.problem, np.asarray(self.solution.u), np.asarray(self.solution.x)
        )


def values_at(problem: Problem, u: np.ndarray, x: np.ndarray) -> dict[str, np.ndarray]:
    """All parameters by name, of unknowns ``(k,)`` and ``(c, m)``.

    In numpy: nothing to compile.
    """
    unknowns = jax.device_get(problem.unknowns)
    shape = unknowns.shape(u)
    linear = unknowns.coefficients(np.asarray(x).T, unknowns.coefficient_constant)
    out = {n: np.asarray(v) for n, v in shape.items()}
    for name, constant, (index, _) in zip(
        unknowns.shape_names,
        np.asarray(unknowns.shape_constant),
        unknowns.shape_source,
        strict=True,
    ):
        if index < 0 and np.ptp(constant) > 0:
            out[name] = constant
    return out | {n: np.array(v, dtype=np.float64) for n, v in linear.items()}


def joined_values(found: list[Found]) -> dict[str, np.ndarray]:
    """All parameters by name; with several problems, one value per channel each."""
    parts = [f.values() for f in found]
    if len(parts) == 1:
        return parts[0]
    return {n: np.concatenate([np.atleast_1d(p[n]) for p in parts]) for n in parts[0]}


@dataclasses.dataclass(frozen=True)
class _Errors:
    """Standard uncertainties and bounds of one problem, by free unknown."""

    shape: np.ndarray
    shape_at_bound: np.ndarray
    shape_freedom: np.ndarray
    coefficient: np.ndarray
    coefficient_at_bound: np.ndarray
    coefficient_freedom: np.ndarray
    correlation: np.ndarray
    values: np.ndarray


def _errors(f: Found, cov: Covariance) -> _Errors:
    unknowns = f.problem.unknowns
    c, m = f.solution.x.shape
    k = unknowns.n_shape
    u = np.asarray(f.solution.u)
    lower, upper = np.asarray(unknowns.lower), np.asarray(unknowns.upper)
    slope = np.array(
        [
            slope_of_value(unknowns.scales[j], float(u[j]), lower[j], upper[j])
            for j in range(k)
        ]
    )
    shape_at = is_flat(unknowns.scales, u)
    scale = np.concatenate([np.ones(c * m), slope])
    matrix = np.asarray(cov.matrix) * np.outer(scale, scale)
    rows, active = np.asarray(unknowns.rows), np.asarray(cov.active)
    unit = np.sum(rows != 0, axis=1) == 1
    at = np.array(
        [
            [np.any(active[i] & unit & (rows[:, j] != 0)) for j in range(m)]
            for i in range(c)
        ],
        dtype=bool,
    ).reshape(c, m)
    with np.errstate(invalid="ignore", divide="ignore"):
        sd = np.sqrt(np.clip(np.diag(matrix), 0.0, None))
        correlation = matrix / np.outer(sd, sd)
    sd_x, sd_u = sd[: c * m].reshape(c, m), sd[c * m :]
    per_channel = np.empty((c, k + m, k + m))
    bad = np.zeros((c, k + m), dtype=bool)
    for i in range(c):
        index = np.concatenate([c * m + np.arange(k), i * m + np.arange(m)])
        per_channel[i] = correlation[np.ix_(index, index)]
        bad[i] = np.concatenate([shape_at, at[i]])
    per_channel = np.clip(per_channel, -1.0, 1.0)
    per_channel[bad[:, :, None] | bad[:, None, :]] = np.nan
    freedom = np.asarray(cov.freedom)
    weight = np.asarray(f.problem.weight)
    values = np.broadcast_to(np.count_nonzero(weight, axis=1), c)
    # No variance means no influence on the data, and with fewer values than unknowns
    # nothing is left over to judge errors by: neither is certainty.
    sd_u, sd_x = np.where(sd_u > 0, sd_u, np.nan), np.where(sd_x > 0, sd_x, np.nan)
    sd_x[values <= m] = np.nan
    if values.sum() <= c * m + k:
        sd_u, sd_x = np.full_like(sd_u, np.nan), np.full_like(sd_x, np.nan)
    return _Errors(
        shape=np.where(shape_at, np.nan, sd_u),
        shape_at_bound=shape_at,
        shape_freedom=freedom[c * m :],
        coefficient=np.where(at, np.nan, sd_x),
        coefficient_at_bound=at,
        coefficient_freedom=freedom[: c * m].reshape(c, m),
        correlation=per_channel,
        values=values,
    )


def parameters(
    model: Model, found: list[Found], covariances: list[Covariance], channels: list[str]
) -> tuple[list[ParameterResult], Correlations, list[str]]:
    """The table of parameters, their correlations per channel, and sentences."""
    unknowns = found[0].problem.unknowns
    errors = [_errors(f, c) for f, c in zip(found, covariances, strict=True)]
    values = joined_values(found)
    table: list[ParameterResult] = []
    sources = dict(zip(unknowns.shape_names, unknowns.shape_source, strict=True))
    sources |= dict(
        zip(unknowns.coefficient_names, unknowns.coefficient_source, strict=True)
    )
    free_shape, free_linear = unknowns.free_shape, unknowns.free_coefficients
    for name, declared in model.parameters().items():
        index, factor = sources[name]
        low, high = declared.support
        value = np.atleast_1d(values[name])
        if index < 0:
            sd, freedom = np.full(value.size, np.nan), np.ones(value.size)
            at = np.zeros(value.size, dtype=bool)
        elif declared.coefficient:
            sd = np.concatenate([e.coefficient[:, index] for e in errors])
            at = np.concatenate([e.coefficient_at_bound[:, index] for e in errors])
            freedom = np.concatenate([e.coefficient_freedom[:, index] for e in errors])
        else:
            sd = np.array([e.shape[index] for e in errors])
            at = np.array([e.shape_at_bound[index] for e in errors])
            freedom = np.array([e.shape_freedom[index] for e in errors])
        if declared.scale == "periodic" and not declared.coefficient:
            value = np.mod(value - declared.support[0], np.ptp(declared.support))
        sd = abs(factor) * sd
        free = free_linear if declared.coefficient else free_shape
        table.append(
            ParameterResult(
                name=name,
                kind="coefficient" if declared.coefficient else "shape",
                unit=declared.unit,
                meaning=declared.meaning,
                support=(finite_or_none(low), finite_or_none(high)),
                value=[float(v) for v in value],
                standard_uncertainty=[finite_or_none(s) for s in sd],
                interval_95=_intervals(value, sd, freedom),
                at_bound=[bool(a) for a in at],
                fixed=index < 0,
                tied_to=free[index] if index >= 0 and free[index] != name else None,
            )
        )
    names = [*free_shape, *free_linear]
    blocks = np.concatenate([e.correlation for e in errors])
    correlations = Correlations(
        names, [[[finite_or_none(v) for v in row] for row in block] for block in blocks]
    )
    words = identifiability.of_data(
        [f.problem for f in found],
        [f.solution for f in found],
        [f.values() for f in found],
        [e.values for e in errors],
        [c.penalty for c in covariances],
        channels,
    )
    words += identifiability.of_parameters(table, names, blocks, channels)
    determined = "every free parameter is determined by the data on its own"
    return table, correlations, words or [determined]


def _intervals(
    value: np.ndarray, sd: np.ndarray, freedom: np.ndarray
) -> list[tuple[float, float] | None]:
    from scipy.special import stdtrit

    half = stdtrit(freedom, 0.975) * sd
    return [
        (float(v - h), float(v + h)) if np.isfinite(h) else None
        for v, h in zip(value, half, strict=True)
    ]
