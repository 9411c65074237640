"""Inside a model: nodes of the quadrature for its albedo, as in the energy constraint."""

from __future__ import annotations

import numpy as np

from fitting.albedo import model_albedo
from fitting.model import Model
from fitting.reflectance import Directional, Hemispherical, quantity, surface_of_result
from fitting.result import FitResult
from fitting.tradeoff.evaluation_cost import Kernel
from fitting.tradeoff.timing import Spread, spread, timed
from fitting.tradeoff.trade import NotPossible, Setting, Trade, trades

NODES = (32, 16, 8, 4)
THETA_DEG = (0.0, 30.0, 60.0, 80.0)
_TOLERANCE = 1e-8


def quadrature_trades(result: FitResult, *, repeats: int) -> list[Trade]:
    """Fixed nodes against an adaptive quadrature with an error below 1e-8, front side.

    The albedo at 0, 30, 60 and 80 degrees from the normal; the deviation is relative, over
    angles and channels. The default number of nodes is 16. Raises `NotPossible` for a model
    that reflects nothing from the front.
    """
    model = Model(result.model)
    if "front" not in model.ways:
        raise NotPossible(f"{result.model} reflects no light from the front")
    exact, seconds, work = _adaptive(result, repeats)
    settings = [Setting("adaptive", seconds, work, 0.0, 0.0)]
    cosines = np.cos(np.radians(THETA_DEG))
    for nodes in NODES:
        kernel = Kernel(
            lambda values, mu, nodes=nodes: model_albedo(model, values, mu, nodes=nodes),
            result.values,
            cosines,
            precision="float64",
        )
        found = np.asarray(kernel.run())
        off = np.abs(found - exact) / np.maximum(np.abs(exact), 1e-300)
        settings.append(
            Setting(
                f"{nodes} nodes",
                timed(kernel.run, repeats).scaled(1.0 / cosines.size),
                float(nodes * nodes),
                float(np.median(off)),
                float(np.max(off)),
            )
        )
    return trades(
        "nodes of the albedo",
        settings,
        cost_of="albedo at one angle",
        work_unit="evaluations",
        error_of="relative deviation of the albedo",
        deviation=True,
    )


def _adaptive(result: FitResult, repeats: int) -> tuple[np.ndarray, Spread, float]:
    """Albedo ``(k, c)``, seconds and evaluations per angle."""
    surface = surface_of_result(result)

    def one(theta: float):
        return quantity(surface, Directional(theta), Hemispherical(), tolerance=_TOLERANCE)

    found = [one(theta) for theta in THETA_DEG]
    each = [timed(lambda t=t: one(t), min(repeats, 3)) for t in THETA_DEG]
    seconds = spread([float(np.mean([e.median for e in each]))])
    evaluations = float(np.mean([f.nodes for f in found]))
    return np.array([f.value for f in found]), seconds, evaluations
