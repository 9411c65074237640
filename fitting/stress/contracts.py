"""What every lobe promises, as functions that say whether one keeps it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from fitting.albedo import LEAVING, albedo_basis
from fitting.models import Way
from fitting.stress import points as at
from fitting.stress.exercise import Everything, Exercise
from fitting.stress.finding import Finding
from fitting.stress.points import Points
from fitting.stress.variants import Variant

RECIPROCITY = 1e-12
ROTATION = 1e-11
COMPILED = 1e-12
ALBEDO_SLACK = 1e-3
_ALBEDO_NODES = 32
# Nearly opposite grazing directions have derivatives by direction beyond this, and products
# on the way to them that exceed float32; fits that turn directions run in float64.
_LARGE_F32 = 1e18
_COSINES = (0.02, 0.1, 0.3, 0.6, 0.9, 1.0)


def declared(variant: Variant) -> Finding:
    """The lobe describes itself without contradictions."""
    lobe, wrong = variant.lobe, []
    parameters = lobe.parameters()
    if not lobe.REFERENCE:
        wrong.append("it has no reference")
    if len({p.name for p in parameters}) != len(parameters):
        wrong.append("two parameters share a name")
    for p in parameters:
        low, high = p.support
        if not low <= p.default <= high:
            wrong.append(f"the default of {p.name} is outside of its support")
        if not (p.meaning and p.unit):
            wrong.append(f"{p.name} has no meaning or no unit")
        if not p.coefficient and not low <= p.start[0] < p.start[1] <= high:
            wrong.append(f"the start of {p.name} is not inside of its support")
        if p.scale == "log" and not low > 0:
            wrong.append(f"{p.name} is on a logarithmic scale that begins at {low:g}")
    ok = not wrong
    said = "name, reference and parameters make sense" if ok else "; ".join(wrong)
    return Finding("declarations", ok, float(len(wrong)), "", said)


def reciprocity(exercise: Exercise, points: Points) -> Finding:
    """``f(wi, wo) / n_o^2 = f(wo, wi) / n_i^2`` to 1e-12 of the value, or what is declared
    instead."""
    there = exercise.value(points)
    back = exercise.value(points, points.geometry.swapped)
    index = _relative_index(exercise, points)
    # What leaves into the other medium, over its squared index.
    down = (points.theta_i < at.HORIZON) & (points.theta_o > at.HORIZON)
    up = (points.theta_i > at.HORIZON) & (points.theta_o < at.HORIZON)
    there = np.where(down, there / index**2, there)
    back = np.where(up, back / index**2, back)
    size = np.maximum(np.abs(there), np.abs(back))
    if not exercise.variant.lobe.NONNEGATIVE:
        # Where a kernel goes through zero nothing is left to be relative to.
        size = np.maximum(size, 1.0)
    difference = np.abs(there - back)
    # Below the normal numbers a difference in the last place is a large share.
    relative = np.where(size > 1e-290, difference / np.maximum(size, 1e-290), 0.0)
    worst, where = _worst(relative, points)
    if exercise.variant.lobe.RECIPROCAL:
        ok = worst <= RECIPROCITY
        said = f"exchanging source and detector changes values by at most {worst:.2g}"
    else:
        ok = worst > 1e-6
        said = (
            f"declared not reciprocal; values change by up to {worst:.2g}"
            if ok
            else f"declared not reciprocal, but values change by no more than {worst:.2g}"
        )
    return Finding("reciprocity", ok, worst, where, said)


def signs_and_finiteness(
    variant: Variant, all_of: Everything, points: Points, precision: str
) -> Iterator[Finding]:
    """Finite and not negative over the closed hemisphere."""
    finite = np.isfinite(all_of.value)
    bad = int(np.count_nonzero(~finite))
    _, where = _worst(~finite, points)
    yield Finding(
        f"finite values {precision}",
        bad == 0,
        float(bad),
        where,
        "all values are finite" if bad == 0 else f"{bad} values are not finite",
    )
    if variant.lobe.NONNEGATIVE:
        negative = np.where(finite, -all_of.value, 0.0)
        worst, where = _worst(negative, points)
        said = "no value is negative" if worst <= 0 else f"there is a value of {-worst:.3g}"
        yield Finding(f"sign {precision}", worst <= 0, max(worst, 0.0), where, said)


def finite_derivatives(
    all_of: Everything, points: Points, exercise: Exercise, double: Exercise
) -> Iterator[Finding]:
    """Forward and reverse, by parameters and by directions.

    In float32 those by a direction next to the horizon may truly be beyond the largest
    number, or pass it on the way; a point is exempt where float64 finds a large one.
    """
    precision = exercise.precision
    parameters = _named(all_of.forward, "forward") | _named(all_of.reverse, "reverse")
    bad = {n: ~np.isfinite(d) for n, d in parameters.items()}
    if bad:
        yield _all_finite(f"derivatives {precision}", bad, points)
    bad = {n: ~np.isfinite(d) for n, d in all_of.by_direction.items()}
    if precision == "f32" and any(np.any(b) for b in bad.values()):
        some = np.nonzero(np.any([np.any(b, axis=0) for b in bad.values()], axis=0))[0]
        truth = double.everything(points.chosen(some)).by_direction
        large = np.any([np.abs(d) > _LARGE_F32 for d in truth.values()], axis=(0, 1))
        for b in bad.values():
            b[:, some] &= ~large
    yield _all_finite(f"derivatives by directions {precision}", bad, points)


def _all_finite(name: str, bad: dict[str, np.ndarray], points: Points) -> Finding:
    counts = {n: int(np.count_nonzero(b)) for n, b in bad.items()}
    total = sum(counts.values())
    if not total:
        return Finding(name, True, 0.0, "", "all are finite")
    most = max(counts, key=lambda n: counts[n])
    _, where = _worst(bad[most], points)
    said = f"{total} are not finite, most of them by {most} ({counts[most]})"
    return Finding(name, False, float(total), where, said)


def below_the_horizon(exercise: Exercise) -> Finding:
    """Exactly zero on ways of light that the lobe does not know, and along the horizon."""
    ti, to = np.radians([[91.0, 30.0, 120.0, 90.0, 180.0], [10.0, 100.0, 170.0, 90.0, 0.0]])
    way = np.array(["up", "down", "back", "", "up"])
    unknown = ~np.isin(way, exercise.variant.lobe.ways)
    count = int(np.count_nonzero(unknown))
    points = Points(
        ti[unknown],
        np.full(count, 0.1),
        to[unknown],
        np.full(count, 2.0),
        at.default_shape(exercise.variant, count),
    )
    worst, where = _worst(np.abs(exercise.value(points)), points)
    said = "zero" if worst == 0 else f"there is a value of {worst:.3g}"
    return Finding("below the horizon", worst == 0, worst, where, said)


def at_the_horizon(exercise: Exercise, count: int = 50) -> Finding:
    """The value at exactly 90 degrees is the limit from above."""
    if "front" not in exercise.variant.lobe.ways:
        return Finding("at the horizon", True, 0.0, "", "the horizon is for reflection")
    rng = np.random.default_rng(5)
    to, po = rng.uniform(0, 1.5, count), rng.uniform(0, 2 * np.pi, count)
    shape = at.default_shape(exercise.variant, count)
    on = Points(np.full(count, at.HORIZON), np.zeros(count), to, po, shape)
    here, near = exercise.value(on), exercise.value(on.below(1e-9))
    excess = np.abs(here - near) - 1e-6 * np.abs(near)
    worst, where = _worst(excess, on)
    ok = worst <= 1e-8
    said = (
        "the values are the limits" if ok else f"they differ from the limits by {worst:.3g}"
    )
    return Finding("at the horizon", ok, max(worst, 0.0), where, said)


def rotation(exercise: Exercise, count: int = 200) -> Finding:
    """Turning both directions changes nothing, the tangent turned along if there is one."""
    variant = exercise.variant
    rng = np.random.default_rng(1)
    ti, to = rng.uniform(0, at.HORIZON, (2, count))
    pi, po, turn = rng.uniform(0, 2 * np.pi, (3, count))
    shape = at.default_shape(variant, count)
    # Of the reflected light next to the horizon the side is not known to rounding.
    ways = np.asarray(variant.lobe.ways)
    ti, to = (np.minimum(t, at.HORIZON - 1e-9) for t in (ti, to))
    here = Points(ti, pi, to, po, shape).along(ways[np.arange(count) % ways.size])
    angles = [p.name for p in variant.shapes if p.scale == "periodic"]
    if angles:
        turn = np.full(count, 0.7)
    turned_shape = {n: v + turn if n in angles else v for n, v in shape.items()}
    there = Points(here.theta_i, pi + turn, here.theta_o, po + turn, turned_shape)
    # Angles beyond one period are as good as any.
    before, after = exercise.value(here), exercise.value(there)
    size = np.maximum(np.abs(before), 1e-30)
    if not variant.lobe.NONNEGATIVE:
        size = np.maximum(size, 1.0)
    worst, where = _worst(np.abs(after - before) / size, here)
    with_it = ", with its tangent," if angles else ""
    said = f"turning the sample{with_it} changes values by at most {worst:.2g}"
    return Finding("rotation", worst <= ROTATION, worst, where, said)


def compiled_is_plain(exercise: Exercise, count: int = 8) -> Finding:
    """``jit``, ``vmap`` and ``grad`` under ``jit`` give what the plain call gives."""
    variant = exercise.variant
    points = at.interior(variant, count, salt=" plain")
    points = dataclasses.replace(points, shape=at.default_shape(variant, count))
    shape, geometry = exercise.on_device(points)
    with jax.enable_x64(True):
        one = {n: v[0] for n, v in shape.items()}
        plain = np.asarray(exercise.plain(one, geometry))
        mapped = np.asarray(exercise.value(points))
    size = np.maximum(np.abs(plain), 1e-30 if variant.lobe.NONNEGATIVE else 1.0)
    worst, where = _worst(np.abs(mapped - plain) / size, points)
    said = f"compiled and mapped values differ by at most {worst:.2g} from the plain call"
    return Finding("compiled", worst <= COMPILED, worst, where, said)


def albedo(exercise: Exercise, count: int) -> Finding:
    """The directional albedo with all coefficients at 1 keeps ``albedo_bound``, reflected
    and transmitted light together, for light from either side."""
    variant = exercise.variant
    bound = variant.lobe.albedo_bound
    if bound is None:
        return Finding("albedo", True, np.nan, "", "no bound is declared")
    lobe = variant.lobe
    some = at.product_of_extremes(variant, count) if variant.shapes else None
    ones = tuple(1.0 for p in lobe.parameters() if p.coefficient)
    with jax.enable_x64(True):
        n = count if some is not None else 1
        shapes = {k: jnp.asarray(v) for k, v in (some.shape if some else {}).items()}

        def total(shape):
            amplitudes = lobe.amplitudes(shape, tuple(jnp.asarray(c) for c in ones))
            sides = []
            for ways in LEAVING.values():
                own: list[Way] = [w for w in ways if w in lobe.ways]
                along = [
                    albedo_basis(
                        lobe, shape, _COSINES, azimuth=0.4, nodes=_ALBEDO_NODES, way=way
                    )
                    for way in own
                ]
                terms = [a * e for of in along for a, e in zip(amplitudes, of, strict=True)]
                if terms:
                    sides.append(sum(terms[1:], terms[0]))
            return jnp.max(jnp.stack(sides), axis=0)

        compiled = jax.jit(total)
        found = np.stack(
            [np.asarray(compiled({k: v[j] for k, v in shapes.items()})) for j in range(n)]
        )
    flat = np.where(np.isfinite(found), found, np.inf)
    j, k = np.unravel_index(int(np.argmax(flat)), flat.shape)
    worst = float(flat[j, k])
    values = [f"{name} {float(v[j]):.4g}" for name, v in shapes.items()]
    where = ", ".join([*values, f"cos(theta) = {_COSINES[k]}"])
    ok = worst <= bound * (1 + ALBEDO_SLACK) and bool(np.all(flat >= 0))
    said = f"at most {worst:.4g}, declared {bound:g}"
    if np.any(flat < 0):
        said = f"an albedo is negative: {np.min(flat):.3g}"
    return Finding("albedo", ok, worst, where, said)


def _relative_index(exercise: Exercise, points: Points) -> np.ndarray:
    """Index behind the surface relative to that in front, at every point."""
    lobe = exercise.variant.lobe
    with jax.enable_x64(True):
        own = {n: jnp.asarray(v) for n, v in points.shape.items()}
        return np.broadcast_to(np.asarray(lobe.relative_index(own)), points.theta_i.shape)


def _named(derivatives: dict[str, np.ndarray], mode: str) -> dict[str, np.ndarray]:
    return {f"{name} ({mode})": d for name, d in derivatives.items()}


def _worst(number: np.ndarray, points: Points) -> tuple[float, str]:
    """The largest of ``(b, n)``, and at which of the points."""
    if number.size == 0:
        return 0.0, ""
    flat = np.where(np.isnan(number), np.inf, number)
    k = int(np.argmax(np.max(flat, axis=0)))
    return float(np.max(flat[:, k])), points.words(k)
