"""Texels a second, against a loop of scipy fits: one texel after the other.

    python tests/benchmarks/texels_speed.py            65,536 texels x 100 x 3
    python tests/benchmarks/texels_speed.py 8192       so many

Both run on the same cores in the same minutes; CPU seconds stand beside those of the clock,
because other programs disturb them less. Measured on two virtual cores of an AMD EPYC,
against finite differences and an exact Jacobian: 14 us of CPU a texel, 870 and 320 times
less than scipy, and 1,100 and 440 times by the clock; on one core alone (`taskset -c 0`)
11 us of either, 630 and 270 times less.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

# Also where a test imports this: before JAX is loaded.
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting import Model, from_angles
from fitting.texels import TexelFits, fit_many

MODEL = "lambert + ggx"
DIRECTIONS, CHANNELS = 100, 3
ALPHA = (0.05, 0.6)
RELATIVE, ABSOLUTE = 0.01, 1e-3
_MADE_AT_ONCE = 4096


@dataclass(frozen=True)
class Sample:
    """A made-up sample: ``values (t, n, c)`` with noise, and the alpha of every texel."""

    directions: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    values: np.ndarray
    alpha: np.ndarray


@dataclass(frozen=True)
class Timed:
    """Seconds by the clock and of the processor, per texel, and what came of it."""

    wall: float
    cpu: float
    answer: object


def made_up(texels: int, n: int = DIRECTIONS, seed: int = 0) -> Sample:
    """Half of the directions near the mirror's, four angles of incidence."""
    rng = np.random.default_rng(seed)
    theta_i = np.radians(rng.choice([0.0, 20.0, 40.0, 60.0], n))
    near = rng.random(n) < 0.5
    theta_r = np.where(
        near, np.abs(theta_i + rng.normal(0, 0.2, n)), rng.uniform(0, 1.35, n)
    ).clip(0, 1.35)
    phi_r = np.where(near, np.pi + rng.normal(0, 0.2, n), rng.uniform(0, 2 * np.pi, n))
    directions = (theta_i, np.zeros(n), theta_r, phi_r)
    truth = {
        "lambert.albedo": rng.uniform(0.05, 0.6, (texels, CHANNELS)),
        "ggx.alpha": np.exp(rng.uniform(*np.log(ALPHA), texels)),
        "ggx.f0": rng.uniform(0.03, 0.6, (texels, CHANNELS)),
        "ggx.f90": np.ones((texels, CHANNELS)),
    }
    model, geometry = Model(MODEL), from_angles(*directions)
    values = np.empty((texels, n, CHANNELS))
    with jax.enable_x64(True):
        evaluate = jax.jit(jax.vmap(lambda p: model(p, geometry)))
        for first in range(0, texels, _MADE_AT_ONCE):
            here = slice(first, first + _MADE_AT_ONCE)
            values[here] = evaluate({k: v[here] for k, v in truth.items()})
    spread = np.sqrt((RELATIVE * values) ** 2 + ABSOLUTE**2)
    return Sample(
        directions, values + spread * rng.normal(size=values.shape), truth["ggx.alpha"]
    )


class OneByOne:
    """scipy's trust-region least squares over all ten parameters of one texel.

    The residual, and the exact Jacobian where there is one, are compiled.
    """

    def __init__(self, sample: Sample, *, exact: bool):
        model = Model(MODEL)
        geometry = jax.tree.map(jnp.asarray, from_angles(*sample.directions))

        def residual(z: jax.Array, y: jax.Array) -> jax.Array:
            kd, f0, f90 = z[1:].reshape(3, CHANNELS)
            p = {"lambert.albedo": kd, "ggx.alpha": z[0], "ggx.f0": f0, "ggx.f90": f90}
            return (model(p, geometry) - y).ravel()

        self._values = sample.values
        self._residual = jax.jit(residual)
        self._jacobian = jax.jit(jax.jacfwd(residual))
        self._exact = exact

    def __call__(self, texel: int, alpha: float = 0.2):
        """The fit of one texel, from a sensible start."""
        y = self._values[texel]
        kd = np.maximum(np.pi * np.median(y, axis=0), 1e-3)
        f0, f90 = np.full(CHANNELS, 0.05), np.ones(CHANNELS)
        start = np.concatenate([[alpha], kd, f0, f90])
        low = np.concatenate([[1e-4], np.zeros(start.size - 1)])
        high = np.concatenate([[1.5], np.full(start.size - 1, np.inf)])
        exact = {"jac": lambda z, y: np.asarray(self._jacobian(z, y))}
        return least_squares(
            lambda z, y: np.asarray(self._residual(z, y)), start, args=(y,),
            bounds=(low, high), x_scale="jac", **(exact if self._exact else {}),
        )  # fmt: skip


def timed(run: Callable[[], object], texels: int) -> Timed:
    """One run of it."""
    wall, cpu = time.perf_counter(), time.process_time()
    answer = run()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return Timed(wall / texels, cpu / texels, answer)


def ours(sample: Sample, repeats: int = 3) -> Timed:
    """The least of some runs of `fit_many`, all compiled before."""
    fit_many(sample.values, sample.directions, MODEL, objective="l2")
    runs = [
        timed(
            lambda: fit_many(sample.values, sample.directions, MODEL, objective="l2"),
            len(sample.alpha),
        )
        for _ in range(repeats)
    ]
    return min(runs, key=lambda r: r.cpu)


def theirs(sample: Sample, texels: int, *, exact: bool) -> Timed:
    """A loop over the first texels, compiled before."""
    with jax.enable_x64(True):
        one = OneByOne(sample, exact=exact)
        one(0)
        return timed(lambda: [one(t) for t in range(texels)], texels)


def wrong_minima(sample: Sample, alpha: np.ndarray) -> int:
    """Texels whose alpha is further than 10 % from the truth."""
    return int(np.sum(~(np.abs(alpha / sample.alpha[: alpha.size] - 1.0) <= 0.1)))


def table(texels: int, of_scipy: int) -> tuple[list[str], dict[str, float]]:
    """Lines for people, and the ratios of CPU time by opponent."""
    sample = made_up(texels)
    mine = ours(sample)
    fits = mine.answer
    assert isinstance(fits, TexelFits)
    wrong = wrong_minima(sample, fits.parameters["ggx.alpha"])
    lines = [
        f"{texels} texels x {DIRECTIONS} x {CHANNELS}, {MODEL}, l2; of scipy the first "
        f"{of_scipy}; {len(os.sched_getaffinity(0))} cores",
        f"  {'':34} {'us, clock':>10} {'us, CPU':>10} "
        f"{'ratio':>7} {'CPU':>7} {'wrong':>12}",
    ]

    def line(name: str, t: Timed, wrong: int, of: int) -> str:
        return (
            f"  {name:34} {1e6 * t.wall:10.1f} {1e6 * t.cpu:10.1f} "
            f"{t.wall / mine.wall:7.0f} {t.cpu / mine.cpu:7.0f} {f'{wrong} of {of}':>12}"
        )

    lines.append(line("fit_many", mine, wrong, texels))
    ratios: dict[str, float] = {"wrong": wrong}
    for name, exact in (("finite differences", False), ("exact Jacobian", True)):
        other = theirs(sample, of_scipy, exact=exact)
        ends = other.answer
        assert isinstance(ends, list)
        alpha = np.array([e.x[0] for e in ends])
        excess = fits.cost[:of_scipy] / (2 * np.array([e.cost for e in ends])) - 1
        lines.append(line(f"scipy, {name}", other, wrong_minima(sample, alpha), of_scipy))
        ratios[name] = other.cpu / mine.cpu
        ratios[f"{name}, clock"] = other.wall / mine.wall
        ratios[f"{name}, excess"] = float(excess.max())
    lines.append(
        "  cost over scipy's, at most: 1 + "
        f"{max(ratios[k] for k in ratios if 'excess' in k):.1e}"
    )
    return lines, ratios


# Of other settings: what is fitted, how often longer than ``l2`` that takes.
OTHERS: dict[str, dict[str, Any]] = {
    "log1p": {"objective": "log1p"},
    "cbrt": {"objective": "cbrt"},
    "l2cos, a shape per channel": {"per_channel_shape": True},
    "log1p, robust": {"objective": "log1p", "robust": True},
    "l2cos, energy penalty": {"energy": 1.0},
}


def others(texels: int) -> list[str]:
    """Lines for people: what other settings than ``l2`` take."""
    sample = made_up(texels)
    unit = ours(sample).cpu
    lines = [f"{texels} texels, times as long as l2 ({1e6 * unit:.1f} us of CPU)"]
    for name, settings in OTHERS.items():

        def run(settings: dict[str, Any] = settings) -> TexelFits:
            return fit_many(sample.values, sample.directions, MODEL, **settings)

        run()
        own = min((timed(run, texels) for _ in range(2)), key=lambda r: r.cpu)
        fits = own.answer
        assert isinstance(fits, TexelFits)
        alpha = fits.parameters["ggx.alpha"].reshape(texels, -1)[:, 0]
        wrong = f"{wrong_minima(sample, alpha)} of {texels} wrong"
        lines.append(f"  {name:34} {own.cpu / unit:10.1f}   {wrong}")
    return lines


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("texels", nargs="?", type=int, default=65536)
    parser.add_argument("--of-scipy", type=int, default=100)
    given = parser.parse_args()
    print("\n".join(table(given.texels, given.of_scipy)[0]))
    print("\n".join(others(min(given.texels, 8192))))
