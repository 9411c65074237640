"""Inside a model: exact formulas against cheaper ones, and against a table."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fitting.geometry import Geometry
from fitting.model import Model
from fitting.models import fresnel
from fitting.predict import predict_geometry
from fitting.result import FitResult
from fitting.tradeoff import approximations
from fitting.tradeoff.evaluation_cost import (
    EvaluationCost,
    Kernel,
    count_of,
    directions,
)
from fitting.tradeoff.precision_trades import relative_deviation
from fitting.tradeoff.tabulated import table_of
from fitting.tradeoff.timing import timed
from fitting.tradeoff.trade import Setting, Trade, trades

_POINTS = 1 << 16
_ETA, _ROUGHNESS, _ALBEDO = 1.5, 0.5, 0.5
_FARTHEST_X = 3.0
TABLE_SIZES = ((90, 45, 45), (45, 23, 23), (23, 12, 12))

Case = tuple[str, str, Callable[..., Any], str, Callable[..., Any], tuple[Any, ...]]


def formula_trades(result: FitResult, *, repeats: int) -> list[list[Trade]]:
    """Exact sub-formulas against approximations, at the fitted parameters if there are any.

    Deviations are those of float64 values over the whole domain of a formula, so that
    rounding does not count; costs those of float32.
    """
    return [_compare(case, repeats) for case in _cases(result)]


def _cases(result: FitResult) -> list[Case]:
    eta = _fitted(result, "eta", _ETA)
    roughness = _fitted(result, "roughness", _ROUGHNESS)
    share = (np.arange(_POINTS) + 0.5) / _POINTS

    def eon(exact: bool) -> Callable[..., Any]:
        return lambda r, a, g: approximations.eon_value({"roughness": r}, g, a, exact=exact)

    return [
        (
            f"Fresnel of a dielectric, eta = {eta:.3g}",
            "exact", fresnel.dielectric, "Schlick", approximations.schlick,
            (share, eta),
        ),
        (
            "G1 of Beckmann",
            "erfc", approximations.beckmann_g1,
            "rational", approximations.beckmann_g1_rational,
            (_FARTHEST_X * share,),
        ),
        (
            f"albedo of EON, roughness {roughness:.3g}",
            "exact", approximations.eon_albedo,
            "polynomial", approximations.eon_albedo_polynomial,
            (share, roughness),
        ),
        (
            f"EON, roughness {roughness:.3g}, albedo {_ALBEDO:g}",
            "exact", eon(True), "polynomial", eon(False),
            (roughness, _ALBEDO, directions(_POINTS)),
        ),
    ]  # fmt: skip


def _compare(case: Case, repeats: int) -> list[Trade]:
    varied, exact_name, exact, cheap_name, cheap, arguments = case
    values = [
        np.asarray(Kernel(f, *arguments, precision="float64").run()) for f in (exact, cheap)
    ]
    off = relative_deviation(values[1], values[0])
    deviations = ((0.0, 0.0), (float(np.median(off)), float(np.max(off))))
    settings: list[Setting] = []
    for name, function, (typical, worst) in zip(
        (exact_name, cheap_name), (exact, cheap), deviations, strict=True
    ):
        kernel = Kernel(function, *arguments, precision="float32")
        one = Kernel(function, *_first(arguments), precision="float32")
        count = count_of(kernel, _POINTS, one)
        seconds = timed(kernel.run, repeats, calls=10, warm=False).scaled(1.0 / _POINTS)
        settings.append(Setting(name, seconds, count.operations, typical, worst))
    return trades(
        varied,
        settings,
        cost_of="evaluation",
        work_unit="operations",
        error_of="relative deviation over the domain",
        deviation=True,
    )


def table_trades(result: FitResult, cost: EvaluationCost, *, repeats: int) -> list[Trade]:
    """The fitted model against its table, interpolated linearly, both in float32.

    Deviations are at random direction pairs, half of them near the mirror direction.
    Raises `NotPossible` for a model that such a table cannot hold.
    """
    model = Model(result.model)
    g = directions(_POINTS)
    exact = predict_geometry(model, result.values, g).reshape(_POINTS, -1)
    own = cost.of("float32")
    analytic = None if own is None else own.batched_ns.scaled(1e-9)
    settings = [Setting("analytic", analytic, cost.operations, 0.0, 0.0)]
    for sizes in TABLE_SIZES:
        table = table_of(result, sizes)
        kernel = Kernel(lambda t, g: t(g), table, g, precision="float32")
        one = Kernel(lambda t, g: t(g), table, directions(1), precision="float32")
        off = relative_deviation(np.asarray(kernel.run(), np.float64), exact)
        name = f"{' x '.join(map(str, sizes))} ({table.bytes / 2**20:.3g} MiB)"
        settings.append(
            Setting(
                name,
                timed(kernel.run, repeats).scaled(1.0 / _POINTS),
                count_of(kernel, _POINTS, one).operations,
                float(np.median(off)),
                float(np.max(off)),
            )
        )
    return trades(
        "model as a table",
        settings,
        cost_of="evaluation",
        work_unit="operations",
        error_of="relative deviation over the hemisphere",
        deviation=True,
    )


def _first(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """The same for one point instead of many."""
    return tuple(
        directions(1) if isinstance(a, Geometry) else a[:1] if np.ndim(a) else a
        for a in arguments
    )


def _fitted(result: FitResult, parameter: str, default: float) -> float:
    """The first fitted value of that name (the mean of its channels), or the default."""
    for name, value in result.values.items():
        if name.rpartition(".")[2] == parameter:
            return float(np.mean(value))
    return default
