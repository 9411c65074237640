"""What a lobe costs, the README's table: ``python tests/benchmarks/lobe_costs.py``.

Time per evaluation of the compiled basis functions and of their Jacobian by all shape
parameters, at many pairs of directions at once, in units of Lambert's value in float32
in the same run; the same source run by plain numpy instead; and what the compiler counts,
which does not depend on the machine.
"""

from __future__ import annotations

import contextlib
import importlib
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.special

from fitting.model import Model
from fitting.models import LOBES
from fitting.tradeoff.evaluation_cost import Kernel, Precision, directions
from fitting.tradeoff.timing import timed

COUNT = 1 << 17
# Rounds in which every kernel has its turn: a burst of other load disturbs a few of all.
ROUNDS, FEWEST_ROUNDS, SECONDS = 60, 5, 0.6
HEADER = (
    "| lobe | value, f32 | f64 | Jacobian, f32 | f64 | numpy / compiled, f64 | flops | "
    "transcendentals |\n|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Cost:
    """Seconds per evaluation; operations per evaluation as the compiler counts them."""

    value: dict[str, float]
    jacobian: dict[str, float]
    numpy: float
    flops: float
    transcendentals: float


@contextlib.contextmanager
def plain_numpy() -> Iterator[None]:
    """Lobes computed by numpy: their source is elementwise and numpy has the same names."""
    names = ("erfc", "gammaln", "gammaincc", "expit")
    special = {n: getattr(scipy.special, n) for n in names}
    before: list[tuple[ModuleType, str, object]] = []
    for module in _modules():
        for name, value in vars(module).copy().items():
            other = np if value is jnp else special.get(name)
            if other is not None and (value is jnp or callable(value)):
                before.append((module, name, value))
                setattr(module, name, other)
    try:
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)


def _modules() -> list[ModuleType]:
    for name in LOBES:
        importlib.import_module(f"fitting.models.{name}")
    return [
        m
        for n, m in sys.modules.items()
        if n.startswith("fitting.models.")
        or n in ("fitting.geometry", "fitting.quadrature")
    ]


def cost(expression: str, count: int = COUNT) -> Cost:
    """What one lobe costs."""
    lobe = Model(expression).lobes[0]
    plain = {p.name: p.default for p in lobe.parameters() if not p.coefficient}
    g = directions(count)

    def with_tangents(shape, geometry):
        slopes = jax.jacfwd(lobe.basis)(shape, geometry) if shape else ()
        return lobe.basis(shape, geometry), slopes

    precisions: dict[str, Precision] = {"f32": "float32", "f64": "float64"}
    of_value, of_both = (
        {n: Kernel(f, plain, g, precision=p) for n, p in precisions.items()}
        for f in (lobe.basis, with_tangents)
    )
    seconds = _least([*of_value.values(), *of_both.values()]) / count
    value, jacobian = (
        dict(zip(precisions, map(float, s), strict=True)) for s in np.split(seconds, 2)
    )
    counted = of_value["f64"].counted()
    few = directions(count // 8)
    numbers = {n: np.float64(v) for n, v in plain.items()}
    with plain_numpy(), np.errstate(all="ignore"):
        numpy = timed(lambda: lobe.basis(numbers, few), 3).least / (count // 8)
    return Cost(value, jacobian, numpy, counted[0] / count, counted[1] / count)


def _least(kernels: list[Kernel]) -> np.ndarray:
    """Least seconds of every kernel, in rounds: what other load disturbs least."""
    for kernel in kernels:
        kernel.run()
    least, begin = np.full(len(kernels), np.inf), time.perf_counter()
    for done in range(ROUNDS):
        if done >= FEWEST_ROUNDS and time.perf_counter() - begin > SECONDS:
            break
        for i, kernel in enumerate(kernels):
            start = time.perf_counter()
            kernel.run()
            least[i] = min(least[i], time.perf_counter() - start)
    return least


def row(name: str, own: Cost, unit: float) -> str:
    """One line of the table; ``unit`` is Lambert's time in float32."""
    times = (own.value["f32"], own.value["f64"], own.jacobian["f32"], own.jacobian["f64"])
    cells = [f"{t / unit:.3g}" for t in times]
    cells += [f"{own.numpy / own.value['f64']:.2g}"]
    cells += [f"{own.flops:.0f}", f"{own.transcendentals:.0f}"]
    return f"| `{name}` | " + " | ".join(cells) + " |"


def variants() -> list[str]:
    """Every lobe, and the options that cost something."""
    options = ("aniso", "dielectric", "conductor", "f82", "uncorrelated", "v_cavity",
               "bare", "ms", "retro")  # fmt: skip
    return [
        expression
        for name in LOBES
        for expression in (name, *(f"ggx({o})" for o in options if name == "ggx"))
    ]


def main(names: list[str]) -> None:
    """Print the table, a line at a time."""
    unit = cost("lambert").value["f32"]
    print(HEADER)
    for name in names or variants():
        print(row(name, cost(name), unit), flush=True)
        eqx.clear_caches()


if __name__ == "__main__":
    main(sys.argv[1:])
