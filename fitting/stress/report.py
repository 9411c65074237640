"""All contracts of one variant, and what came of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.models import Lobe
from fitting.stress import contracts, derivatives, precision
from fitting.stress import points as at
from fitting.stress.exercise import Exercise
from fitting.stress.finding import Finding
from fitting.stress.precision import Precision
from fitting.stress.reference import has_reference, n_values
from fitting.stress.self_fit import self_fit
from fitting.stress.variants import Variant, of_lobe

PRECISIONS = ("f32", "f64")
CONTRACT_POINTS = 2048

Progress = Callable[[str, int], None]


@dataclass(frozen=True)
class Report:
    """What a variant keeps of what is promised; prints as a list."""

    variant: str
    findings: tuple[Finding, ...]
    precisions: tuple[Precision, ...]

    @property
    def passed(self) -> bool:
        """Whether every contract holds."""
        return all(f.passed for f in self.findings)

    @property
    def failed(self) -> tuple[Finding, ...]:
        """The contracts that do not hold."""
        return tuple(f for f in self.findings if not f.passed)

    def precision(self, name: str) -> Precision | None:
        """Rounding errors in ``f32`` or ``f64``, if they were measured."""
        return next((p for p in self.precisions if p.precision == name), None)

    def __str__(self) -> str:
        word = "passed" if self.passed else f"{len(self.failed)} FAILED"
        lines = [f"{self.variant}: {word}, {len(self.findings)} contracts"]
        return "\n".join([*lines, *(f"  {f}" for f in self.findings)])


def check_lobe(lobe: Lobe, *, points: int = 2000, fit: bool = True) -> Report:
    """Every contract of one lobe, also of one that no registry knows.

    For tests of an own lobe: ``assert check_lobe(MyLobe()).passed``; the report prints
    what fails and where. Rounding errors are measured at ``points`` points if the lobe's
    file has its formula in many digits as a function ``oracle(s, t, o)``. ``fit`` leaves
    out the fit to the lobe's own values, which takes the longest.
    """
    return examine(of_lobe(lobe), points, fit=fit)


def examine(
    variant: Variant,
    count: int,
    *,
    precisions: Sequence[str] = PRECISIONS,
    fit: bool = True,
    workers: int = 1,
    progress: Progress | None = None,
) -> Report:
    """The contracts of a variant, with rounding errors at ``count`` points.

    ``progress`` is told what is done and how many of the points were finished with it.
    """
    tell = progress or (lambda _what, _points: None)
    exercises = {p: Exercise(variant, p) for p in PRECISIONS}
    tell("contracts", 0)
    findings = list(kept(exercises, min(count, CONTRACT_POINTS), precisions))
    measured = []
    if comparable(exercises["f64"]):
        for name in precisions:
            tell(f"rounding in {name}", 0)
            found = precision.measure(
                exercises[name],
                count,
                workers=workers,
                progress=lambda n, name=name: tell(f"rounding in {name}", n),
            )
            measured.append(found)
            findings.append(rounding(found))
    if fit:
        tell("self-fit", 0)
        findings += self_fit(variant)
    return Report(variant.name, tuple(findings), tuple(measured))


def kept(
    exercises: dict[str, Exercise],
    count: int,
    precisions: Sequence[str] = PRECISIONS,
    enough: Callable[[], bool] | None = None,
) -> Iterator[Finding]:
    """The contracts but for rounding and fitting; ``count`` tells how thoroughly.

    Once ``enough`` says so, points of the costly contracts are left out.
    """
    double = exercises["f64"]
    variant = double.variant
    yield contracts.declared(variant)
    yield contracts.reciprocity(double, at.stratified(variant, count))
    formula = comparable(double)
    if has_reference(variant):
        said = "has as many basis functions as the lobe"
        if not formula:
            said = "has another number of basis functions than the lobe"
        yield Finding("formula in many digits", formula, 0.0, "", said)
    # The first of the points are for derivatives that are right, all for finite ones.
    inside = at.interior(variant, max(count // 32, 16), salt=" derivatives")
    first = slice(np.size(inside.theta_i))
    points = at.joined(
        inside,
        at.shuffled(
            at.joined(at.stratified(variant, count), at.product_of_extremes(variant, count))
        ),
    )
    for name in precisions:
        found = exercises[name].everything(points, enough)
        done = points.chosen(slice(found.value.shape[-1]))
        yield from contracts.signs_and_finiteness(variant, found, done, name)
        yield from contracts.finite_derivatives(found, done, exercises[name], double)
        correct = derivatives.correct(
            exercises[name], inside, found.chosen(first), formula=formula
        )
        if correct is not None:
            yield correct
    yield contracts.below_the_horizon(double)
    yield contracts.at_the_horizon(double)
    yield contracts.rotation(double)
    yield contracts.albedo(double, max(count // 64, 8))
    if "f64" in precisions:
        yield contracts.compiled_is_plain(double)


def comparable(exercise: Exercise) -> bool:
    """Whether there is a formula with as many basis functions as the lobe has."""
    if not has_reference(exercise.variant):
        return False
    one = at.interior(exercise.variant, 1)
    return exercise.value(one).shape[0] == n_values(exercise.variant)


def rounding(found: Precision) -> Finding:
    """The rounding errors as one of the contracts."""
    worst = max(found.maximum, found.ill_maximum)
    return Finding(
        f"rounding {found.precision}", found.passed, worst, found.worst, str(found)
    )
