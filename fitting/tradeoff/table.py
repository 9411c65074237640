"""What `brdf tradeoff` finds, as plain data: JSON round trip, and the front among it."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from data_formats.source import replacing
from fitting.comparison import as_good
from fitting.result import ResultError
from fitting.tradeoff.errors import Errors, objective_error
from fitting.tradeoff.evaluation_cost import EvaluationCost
from fitting.tradeoff.fit_cost import FitCost
from fitting.tradeoff.noise_floor import NoiseFloor
from fitting.tradeoff.pareto import domination, standings, step_up
from fitting.tradeoff.trade import Trade

SCHEMA_VERSION = 1

CostAxis = Literal["operations", "float32", "float64", "fit", "parameters"]
ErrorAxis = Literal["held-out", "fitted", "albedo", "image"]

COST_WORDS: dict[CostAxis, str] = {
    "operations": "operations per evaluation of all channels (flops + 30 transcendentals)",
    "float32": "nanoseconds per evaluation of all channels, float32, batched",
    "float64": "nanoseconds per evaluation of all channels, float64, batched",
    "fit": "seconds of a fit, compiled",
    "parameters": "free parameters",
}


class TradeoffError(ResultError):
    """A file of `brdf tradeoff` that cannot be read, in one sentence."""


class Candidate(msgspec.Struct, frozen=True):
    """A model, what it costs to evaluate and to fit, and how far it is from the data.

    ``on_front`` and ``dominated_by`` are those of the table's axes; both say nothing of a
    candidate without the error in question, or on other rows than most.
    """

    model: str
    parameters: int
    rows_used: int
    converged: bool
    evaluation: EvaluationCost
    fit: FitCost
    errors: Errors
    on_front: bool = False
    dominated_by: str | None = None

    def cost(self, axis: CostAxis) -> float:
        """The cost on an axis, in the unit of `COST_WORDS`."""
        if axis == "operations":
            return self.evaluation.operations
        if axis == "fit":
            return self.fit.seconds.median
        if axis == "parameters":
            return float(self.parameters)
        times = self.evaluation.of(axis)
        return float("nan") if times is None else times.batched_ns.median

    def error(self, axis: ErrorAxis, objective: str) -> float | None:
        """The error on an axis, or None if it is not known."""
        e = self.errors
        if axis == "held-out":
            return e.typical
        if axis == "fitted":
            return objective_error(e.fitted, objective)
        if axis == "albedo":
            return None if e.albedo is None else e.albedo.rms
        return None if e.image is None else e.image.mean


class Tradeoff(msgspec.Struct, frozen=True):
    """Candidates with costs and errors, and the trades inside one of them.

    ``findings`` are sentences on the front and what is dominated, ``trade_findings`` on
    what inside the model ``inside`` is enough; ``left_out`` tells what was not measured and
    why. Times are of the ``machine``; operations, steps, parameters are not.
    """

    schema_version: int
    path: str
    sha256: str
    sample: str
    rows: int
    channels: list[str]
    objective: str
    scene: str | None
    cost_axis: CostAxis
    error_axis: ErrorAxis
    candidates: list[Candidate]
    noise_floors: list[NoiseFloor]
    findings: list[str]
    inside: str | None
    trades: list[Trade]
    trade_findings: list[str]
    left_out: list[str]
    interrupted: bool
    machine: dict[str, str]
    versions: dict[str, str]

    def to_json(self) -> str:
        """JSON with full precision."""
        return json.dumps(msgspec.to_builtins(self), indent=1, allow_nan=False)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write JSON beside the target and rename it. Raises `MeasurementError`."""
        with replacing(path) as beside:
            beside.write_text(self.to_json() + "\n", encoding="utf-8")

    @property
    def noise(self) -> float | None:
        """The least relative standard deviation of a value by any account, if known."""
        return min((f.relative for f in self.noise_floors), default=None)


def load_tradeoff(path: str | os.PathLike[str]) -> Tradeoff:
    """Read what `Tradeoff.save` wrote. Raises `TradeoffError` in one sentence."""
    try:
        plain = json.loads(Path(path).read_bytes())
    except OSError as error:
        raise TradeoffError(f"{path}: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise TradeoffError(
            f"{path}: not JSON ({error}); expected what `brdf tradeoff -o` wrote"
        ) from error
    version = plain.get("schema_version") if isinstance(plain, dict) else None
    if version != SCHEMA_VERSION:
        raise TradeoffError(
            f"{path}: schema_version is {version!r}; expected {SCHEMA_VERSION}, of "
            "`brdf tradeoff -o`"
        )
    try:
        return msgspec.convert(plain, Tradeoff)
    except msgspec.ValidationError as error:
        raise TradeoffError(f"{path}: {error}; expected a `brdf tradeoff`") from error


def judged(table: Tradeoff) -> Tradeoff:
    """The table with the front of its axes marked, in words too.

    Only candidates on as many rows as most have a place: errors on different rows do not
    compare.
    """
    usual = max((c.rows_used for c in table.candidates), default=0)
    points = [_point(c, table, usual) for c in table.candidates]
    found = standings(points)
    names = [c.model for c in table.candidates]
    marked = [
        msgspec.structs.replace(
            c,
            on_front=s.on_front,
            dominated_by=None if s.dominated_by is None else names[s.dominated_by],
        )
        for c, s in zip(table.candidates, found, strict=True)
    ]
    return msgspec.structs.replace(
        table, candidates=marked, findings=_findings(points, marked, table.error_axis)
    )


def _point(candidate: Candidate, table: Tradeoff, usual: int) -> tuple[float, float] | None:
    error = candidate.error(table.error_axis, table.objective)
    cost = candidate.cost(table.cost_axis)
    if candidate.rows_used != usual or error is None or not cost > 0:
        return None
    return cost, error


def _findings(
    points: Sequence[tuple[float, float] | None],
    marked: Sequence[Candidate],
    axis: ErrorAxis,
) -> list[str]:
    """What each step along the front costs and gains; then what is dominated, by what."""
    named = {c.model: (p, c) for p, c in zip(points, marked, strict=True)}
    front = sorted((p, c.model) for p, c in named.values() if p and c.on_front)
    out: list[str] = []
    for (cheaper, before), (own, name) in itertools.pairwise(front):
        if own[0] > cheaper[0]:
            words = step_up(name, before, own, cheaper)
            if axis == "held-out" and _by_chance(named[before][1], named[name][1]):
                words += ", which is within one standard error over the angles"
            out.append(words)
    for name, (own, c) in named.items():
        if own is None:
            out.append(f"{name} has no place: its error is not known on the same rows")
        elif c.dominated_by:
            better = named[c.dominated_by][0]
            out.append(domination(name, c.dominated_by, own, better or own))
    return out


def _by_chance(worse: Candidate, better: Candidate) -> bool:
    """Whether the angles of incidence do not tell the one from the other."""
    found = [
        np.log(np.maximum([a.objective for a in c.errors.by_angle], 1e-300))
        for c in (worse, better)
    ]
    return found[0].size == found[1].size and as_good(found[0], found[1])
