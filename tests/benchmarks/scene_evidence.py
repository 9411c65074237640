"""Is the choice for a scene right? ``python tests/benchmarks/scene_evidence.py DATA``.

1. Data made from known models: what `choose` keeps against what they were made from.
2. Published materials, measured with noise: the error that is predicted against the true.
3. The same materials: objectives judged by the picture against the best single one.

DATA is a folder with ``published_fits/sgd.csv``, which the project may use but not ship.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from sgd_materials import MATERIALS, Function, material, measured

from fitting.model import Model
from fitting.options import FitOptions
from fitting.predict import predict_geometry
from fitting.scene.choose import LADDER, choose_for_scene
from fitting.scene.description import (
    ColourDifference,
    Direction,
    Flat,
    RelativeRadiance,
    Scene,
    Sphere,
    Tolerance,
    Viewer,
)
from fitting.scene.load import PRESETS, load_scene
from fitting.scene.refit import fitted, refit
from fitting.scene.render import render, render_values
from fitting.scene.stage import Stage, set_stage
from fitting.tradeoff.evaluation_cost import operations

PIXELS = 24
SINGLE = ("log1p", "asinh", "cbrt", "l2cos", "chi2", "l2")


@dataclass(frozen=True)
class Truth:
    """A model with parameters in R, G, B; ``like`` tells what it stands for."""

    like: str
    model: str
    values: dict[str, tuple[float, float, float] | float]

    def function(self) -> Function:
        model = Model(self.model)
        own = {n: np.asarray(v, dtype=np.float64) for n, v in self.values.items()}
        return lambda g: predict_geometry(model, own, g)


def _gloss(name: str, alpha: float, f0: float, f90: float = 0.8) -> dict:
    return {
        f"{name}.alpha": alpha, f"{name}.f0": (f0, f0, f0), f"{name}.f90": (f90, f90, f90),
    }  # fmt: skip


_RED, _GREY = {"lambert.albedo": (0.45, 0.12, 0.08)}, {"lambert.albedo": (0.3, 0.3, 0.3)}
TRUTHS = (
    Truth("chalk", "lambert", {"lambert.albedo": (0.85, 0.83, 0.78)}),
    Truth("red clay", "lambert", _RED),
    Truth("matte paint", "lambert + ggx", {**_GREY, **_gloss("ggx", 0.6, 0.01, 0.2)}),
    Truth("satin paint", "lambert + ggx", {**_RED, **_gloss("ggx", 0.3, 0.04)}),
    Truth("plastic", "lambert + ward", {**_RED, **_gloss("ward", 0.15, 0.04)}),
    Truth("glossy lacquer", "lambert + ggx", {**_RED, **_gloss("ggx", 0.08, 0.04)}),
    Truth("fine lacquer", "lambert + beckmann", {**_GREY, **_gloss("beckmann", 0.1, 0.05)}),
    Truth("brass", "lambert + ggx", {"lambert.albedo": (0.02, 0.02, 0.01),
          "ggx.alpha": 0.2, "ggx.f0": (0.7, 0.55, 0.3), "ggx.f90": (1.0, 1.0, 1.0)}),
    Truth("flake paint", "lambert + ggx(bare)", {**_GREY, **_gloss("ggx", 0.2, 0.3)}),
    Truth("clear coat", "lambert + 2*ggx", {**_RED, **_gloss("ggx1", 0.07, 0.04),
          **_gloss("ggx2", 0.4, 0.05)}),
    Truth("coated flakes", "lambert + ggx + blinn_phong", {**_GREY,
          **_gloss("ggx", 0.1, 0.04), "blinn_phong.exponent": 30.0,
          "blinn_phong.f0": (0.2, 0.2, 0.2), "blinn_phong.f90": (0.3, 0.3, 0.3)}),
    Truth("rough plaster", "eon + ggx", {"eon.albedo": (0.7, 0.66, 0.6),
          "eon.roughness": 0.9, **_gloss("ggx", 0.5, 0.01, 0.1)}),
)  # fmt: skip


def scenes(pixels: int = PIXELS) -> Iterator[Scene]:
    """The presets, with fewer pixels, and two scenes that see little or much of a lobe."""
    for name in PRESETS:
        scene = load_scene(name)
        if isinstance(scene.seen, Sphere):
            seen = msgspec.structs.replace(scene.seen, pixels=pixels)
            scene = msgspec.structs.replace(scene, seen=seen)
        yield scene
    lamp = Direction(theta_deg=30.0, phi_deg=60.0)
    yield Scene(
        name="lamp", lights=(lamp,), seen=Sphere(pixels=pixels), viewer=Viewer(),
        tolerance=Tolerance(colour_difference=ColourDifference(mean=0.5)),
    )  # fmt: skip
    yield Scene(
        name="off gloss", lights=(Direction(theta_deg=45.0, phi_deg=180.0),),
        seen=Flat(theta_deg=(0.0, 20.0)), viewer=Viewer(),
        tolerance=Tolerance(relative_radiance=RelativeRadiance()),
    )  # fmt: skip


def true_error(stage: Stage, function: Function, model: Model, values: dict):
    """Mean and 95th percentile of a model's difference from the truth itself."""
    truth = render_values(function, stage.judged).radiance
    image = render(model, values, stage.judged)
    return stage.statistics(image.radiance, truth)


@dataclass(frozen=True)
class Verdict:
    """What became of one truth in one scene."""

    truth: Truth
    scene: str
    kept: str
    cost_ratio: float
    met: bool
    true_mean: float
    limits: tuple[float, ...]
    right: bool


def confusion(
    truths: Sequence[Truth] = TRUTHS,
    models: Sequence[str] = LADDER,
    of: Sequence[Scene] | None = None,
    *,
    relative: float = 0.01,
    absolute: float = 3e-4,
) -> Iterator[Verdict]:
    """`choose` on data made from each truth, in every scene.

    Right: it keeps the truth or something cheaper, and what it keeps is within the scene's
    tolerance of the truth itself, without noise. Models that cost more than the truth are
    left out: they could only be kept where the truth is not within the tolerance, which
    counts as wrong here.
    """
    for truth in truths:
        most = operations(truth.model, 3)
        tried = [m for m in models if operations(m, 3) <= most]
        function = truth.function()
        data = measured(function, relative=relative, absolute=absolute)
        reference = None
        for scene in of or tuple(scenes()):
            stage = set_stage(data, scene, reference=reference)
            reference = stage.reference
            choice = choose_for_scene(data, scene, tried, stage=stage)
            kept = choice.candidates[choice.chosen]
            found = true_error(stage, function, Model(kept.model), choice.result.values)
            cost = operations(kept.model, 3, per_channel_shape=kept.per_channel_shape)
            ratio = cost / most
            within = all(
                e <= limit for e, limit in zip(found, stage.measure.limits, strict=False)
            )
            yield Verdict(
                truth, scene.name, kept.model, ratio, choice.met, found[0],
                stage.measure.limits, choice.met and within and ratio <= 1.0,
            )  # fmt: skip


@dataclass(frozen=True)
class Prediction:
    """Predicted and true mean colour difference of a fit to a published material."""

    material: str
    model: str
    objective: str
    predicted: float
    true: float


def predictions(
    folder: Path,
    materials: Sequence[str] = MATERIALS,
    models: Sequence[str] = ("lambert + ggx", "lambert + 2*ggx"),
    scene: Scene | None = None,
    objectives: Sequence[str] = SINGLE,
) -> Iterator[Prediction]:
    """Of each single objective with its usual weights, and of ``auto``: judged by image."""
    told = scene or next(s for s in scenes() if s.name == "studio")
    for name in materials:
        function = material(folder, name)
        data = measured(function)
        stage = set_stage(data, told)
        whole = render_values(function, stage.lights).radiance
        for model in models:
            found = {
                o: fitted(stage, model, FitOptions(objective=o, starts=4, noise=_noise(o)))
                for o in objectives
            }
            found["auto"] = refit(stage, model, FitOptions(starts=4))
            for objective, one in found.items():
                image = stage.image(one.model, one.values).radiance
                difference = stage.measure.between(image, whole)
                true = stage.measure.statistics(difference, stage.picture.weight)[0]
                yield Prediction(name, model, objective, one.error.mean, true)


def _noise(objective: str) -> tuple[float, float] | None:
    return (0.05, 2e-3) if objective == "chi2" else None


def summary_of_predictions(found: Sequence[Prediction]) -> str:
    """Relative error of the prediction, and the worst case, of the fits that are kept."""
    kept = [p for p in found if p.objective == "auto"]
    ratio = np.array([p.predicted / p.true for p in kept])
    every = np.array([p.predicted / p.true for p in found])
    return (
        f"{len(kept)} fits that are kept: predicted colour difference off by "
        f"{100 * np.median(np.abs(ratio - 1)):.0f} % (median), {ratio.min():.2f} to "
        f"{ratio.max():.2f} of the true one; all {len(found)} fits: "
        f"{100 * np.median(np.abs(every - 1)):.0f} %, {every.min():.2f} to "
        f"{every.max():.2f}"
    )


def summary_of_objectives(found: Sequence[Prediction]) -> str:
    """Mean true colour difference per objective, per model."""
    out: list[str] = []
    for model in dict.fromkeys(p.model for p in found):
        means = means_of(found, model)
        cells = ", ".join(f"{o} {m:.2f}" for o, m in means.items())
        best = min(m for o, m in means.items() if o != "auto")
        out.append(f"{model}: {cells}; auto / best single = {means['auto'] / best:.2f}")
    return "\n".join(out)


def means_of(found: Sequence[Prediction], model: str) -> dict[str, float]:
    """Mean over the materials of the true colour difference, by objective."""
    own = [p for p in found if p.model == model]
    return {
        o: float(np.mean([p.true for p in own if p.objective == o]))
        for o in dict.fromkeys(p.objective for p in own)
    }


def table_of(found: Sequence[Verdict]) -> str:
    """What is kept, by truth and scene; what is wrong is marked."""
    names = list(dict.fromkeys(v.scene for v in found))
    lines = ["| made from | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for truth in dict.fromkeys(v.truth.like for v in found):
        own = {v.scene: v for v in found if v.truth.like == truth}
        cells = [_cell(own[n]) for n in names]
        model = next(v.truth.model for v in found if v.truth.like == truth)
        lines.append(f"| {truth}: `{model}` | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(v: Verdict) -> str:
    mark = "" if v.right else (" (wrong)" if v.met else " (none within)")
    return f"`{v.kept}`{mark}"


def main(folder: Path) -> None:
    """Print everything, as it comes."""
    verdicts: list[Verdict] = []
    for v in confusion():
        verdicts.append(v)
        mark = "" if v.right else " WRONG"
        print(
            f"# {v.truth.like} in {v.scene}: {v.kept}, {v.cost_ratio:.2f} of the cost, "
            f"{v.true_mean:.3g} of {v.limits[0]:g}{mark}",
            flush=True,
        )
    print(table_of(verdicts))
    print(f"{sum(v.right for v in verdicts)} of {len(verdicts)} right")
    found = list(predictions(folder))
    print(summary_of_predictions(found))
    print(summary_of_objectives(found))


if __name__ == "__main__":
    from fitting.cli import jax_setup

    jax_setup.set_up()
    main(Path(sys.argv[1]))
