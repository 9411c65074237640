"""What it costs to evaluate a model: by the clock, and by the compiler's own count."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import jax
import jax.numpy as jnp
import msgspec
import numpy as np
from numpy.typing import ArrayLike

from fitting.geometry import Geometry, from_angles
from fitting.model import Model
from fitting.tradeoff.timing import Spread, timed

Precision = Literal["float32", "float64"]
PRECISIONS: tuple[Precision, ...] = ("float32", "float64")

# How many flops one transcendental counts for; see `operations`.
TRANSCENDENTAL = 30.0
# Values per batch: what stays in the cache of one core, as in a renderer's wavefront.
_BATCH_VALUES = 1 << 17
_MOST_ROWS = 1 << 16
_LEAST_ROWS = 1 << 12
_SINGLE_CALLS = 200
_SEED = 0


class Count(msgspec.Struct, frozen=True):
    """What XLA's cost analysis counts in a compiled kernel, independent of the machine.

    ``flops`` and ``transcendentals`` (exp, log, sin, atan2, pow, sqrt, ...) per evaluation
    of one pair of directions in all channels; ``flops_once`` and ``transcendentals_once``
    per call, whatever the number of pairs, such as tables of multiple scattering.
    """

    flops: float
    transcendentals: float
    flops_once: float = 0.0
    transcendentals_once: float = 0.0

    @property
    def operations(self) -> float:
        """``flops + 30 transcendentals`` per evaluation; see `operations`."""
        return self.flops + TRANSCENDENTAL * self.transcendentals


class PrecisionCost(msgspec.Struct, frozen=True):
    """Nanoseconds per evaluation of all channels on this machine, in one precision.

    ``batched`` is of ``rows`` pairs of directions at once, per pair; ``single`` is of a
    call with one pair, the dispatch of the call included, which is nearly all of it.
    """

    precision: str
    batched_ns: Spread
    single_ns: Spread
    rows: int


class EvaluationCost(msgspec.Struct, frozen=True):
    """What it costs to evaluate a model in all its channels.

    ``count`` is that of the float32 kernel, ``operations`` what models are ranked by.
    """

    model: str
    channels: int
    count: Count
    operations: float
    precisions: list[PrecisionCost]

    def of(self, precision: str) -> PrecisionCost | None:
        """The times in one precision, or None if it was not asked for."""
        for p in self.precisions:
            if p.precision == precision:
                return p
        return None


def evaluation_cost(
    model: str,
    channels: int,
    values: Mapping[str, ArrayLike],
    *,
    precisions: Sequence[Precision] = PRECISIONS,
    repeats: int = 9,
) -> EvaluationCost:
    """Measure what evaluating a model costs, all lobes and channels.

    ``values`` are all parameters by full name as `fitting.Model` takes them, in which the
    time may depend a little and the count does not; a coefficient given as one number
    stands for all ``channels``. Times are medians of ``repeats`` with quartiles, after a
    warm-up. Raises `ModelError` for a senseless model or missing parameters.
    """
    own = Model(model)
    wide = _one_per_channel(own, channels, values)
    rows = batch_rows(channels)
    found: list[PrecisionCost] = []
    for precision in precisions:
        batched = compiled(own, wide, rows, precision)
        single = compiled(own, wide, 1, precision)
        found.append(
            PrecisionCost(
                precision,
                timed(batched.run, repeats, warm=False).scaled(1e9 / rows),
                timed(single.run, repeats, calls=_SINGLE_CALLS, warm=False).scaled(1e9),
                rows,
            )
        )
    count = _count(own, wide, rows)
    return EvaluationCost(own.expression, channels, count, count.operations, found)


def operations(model: str, channels: int, *, per_channel_shape: bool = False) -> float:
    """A deterministic cost of evaluating a model once: ``flops + 30 transcendentals``.

    Per pair of directions, in all channels, of the kernel compiled for float32; what is
    computed once per call does not count. Nothing is timed.

    Of all weights 30 makes the times of the lobes of this package most nearly proportional
    to it in float32 on x86 (least RMS of the logarithm; 50 in float64): half of them are
    within a factor of 1.9. What the compiler does not vectorise there (atan2 in ``eon`` and
    ``rtls``) takes up to ten times longer, as do quadratures whose nodes leave the cache
    (``student_t``, ``gtr``); hardly anything takes less than half. The table is in the
    README; ``tests/benchmarks/lobe_costs.py`` makes it.

    ``per_channel_shape``: shape parameters of every channel for itself. Raises `ModelError`
    for a senseless model.
    """
    return _operations(Model(model).expression, channels, per_channel_shape)


@functools.lru_cache(maxsize=256)
def _operations(model: str, channels: int, per_channel_shape: bool) -> float:
    own = Model(model)
    values = {
        name: np.full(channels, p.default) if per_channel_shape else p.default
        for name, p in own.parameters().items()
    }
    wide = _one_per_channel(own, channels, values)
    return _count(own, wide, batch_rows(channels)).operations


def batch_rows(channels: int) -> int:
    """How many pairs of directions are evaluated at once."""
    rows = _BATCH_VALUES // max(channels, 1)
    return int(np.clip(1 << max(rows.bit_length() - 1, 0), _LEAST_ROWS, _MOST_ROWS))


def directions(count: int) -> Geometry:
    """Pairs of directions all over the hemisphere, half of them near the mirror."""
    rng = np.random.default_rng(_SEED)
    theta_i, theta_r = np.arccos(rng.uniform(0.05, 1.0, (2, count)))
    phi = rng.uniform(0, 2 * np.pi, count)
    near = rng.random(count) < 0.5
    theta_r = np.where(near, np.clip(theta_i + rng.normal(0, 0.1, count), 0, 1.5), theta_r)
    return from_angles(theta_i, 0.0, theta_r, np.where(near, np.pi + 0.2 * phi, phi))


class Kernel:
    """A function compiled for some arguments: `run` it, or ask what the compiler counts.

    Arguments are converted to the precision, with JAX's configuration scoped to it.
    """

    def __init__(self, function: Callable[..., Any], *arguments: Any, precision: Precision):
        with jax.enable_x64(precision == "float64"):
            dtype = jnp.float64 if precision == "float64" else jnp.float32
            self._arguments = jax.tree.map(
                lambda a: jnp.asarray(np.asarray(a), dtype), arguments
            )
            self._compiled = jax.jit(function).lower(*self._arguments).compile()

    def run(self) -> Any:
        """The value, once it is there."""
        return jax.block_until_ready(self._compiled(*self._arguments))

    def counted(self) -> tuple[float, float]:
        """Flops and transcendentals of a call, 0 where the compiler does not say."""
        said = self._compiled.cost_analysis() or {}
        return said.get("flops", 0.0), said.get("transcendentals", 0.0)


def compiled(
    model: Model, values: Mapping[str, ArrayLike], rows: int, precision: Precision
) -> Kernel:
    """A model's value at ``rows`` pairs of directions, its parameters being arguments."""
    return Kernel(model, dict(values), directions(rows), precision=precision)


def count_of(batch: Kernel, rows: int, single: Kernel) -> Count:
    """Per evaluation and once per call, from a batch and from one evaluation."""
    each = [
        max(round((many - one) / (rows - 1), 1), 0.0)
        for many, one in zip(batch.counted(), single.counted(), strict=True)
    ]
    once = [max(one - e, 0.0) for one, e in zip(single.counted(), each, strict=True)]
    return Count(each[0], each[1], once[0], once[1])


def _count(model: Model, values: Mapping[str, ArrayLike], rows: int) -> Count:
    batch = compiled(model, values, rows, "float32")
    return count_of(batch, rows, compiled(model, values, 1, "float32"))


def _one_per_channel(
    model: Model, channels: int, values: Mapping[str, ArrayLike]
) -> dict[str, np.ndarray]:
    declared = model.parameters()
    return {
        name: np.broadcast_to(np.asarray(v, float), (channels,))
        if name in declared and declared[name].coefficient
        else np.asarray(v, float)
        for name, v in values.items()
    }
