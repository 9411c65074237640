"""``brdf choose``: the cheapest model that a scene cannot tell from the data."""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from fitting.cli import failures
from fitting.cli.flags import Flags, Format, Reader

if TYPE_CHECKING:
    from data_formats import Measurement
    from fitting.cli.work import Work
    from fitting.scene.choice import Choice
    from fitting.scene.description import Scene

_WHAT = Group("What is compared", sort_key=1)
_FILES = Group("Files", sort_key=2)

# About seconds on a slow machine that has compiled nothing yet: the picture of the data in
# two steps, a refit per lobe, and the uncertainties.
_PICTURE, _PER_LOBE, _UNCERTAINTIES = (4, 4), 15, 10


def choose(
    *files: Annotated[
        Path,
        Parameter(
            name="FILE",
            negative="",
            help="A file of measured reflectance, or several of one sample. Without: the "
            "bundled sample.",
        ),
    ],
    scene: Annotated[
        str,
        Parameter(
            group=_WHAT,
            help="What the model must be good enough for: a preset (`brdf scene` lists "
            "them), or a scene file of your own.",
        ),
    ] = "studio",
    model: Annotated[
        list[str] | None,
        Parameter(
            name=("--model", "-m"), negative="", group=_WHAT,
            help="A candidate, such as 'lambert + ggx'. Repeatable. Without: a ladder of "
            "models from cheap to dear.",
        ),
    ] = None,
    max_theta: Annotated[
        float,
        Parameter(
            group=_WHAT,
            help="Leave rows beyond this polar angle, in deg, of source or detector out "
            "of the fits.",
        ),
    ] = 85.0,
    fix: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_WHAT,
            help="NAME=VALUE, or one value per channel with commas, where a candidate "
            "has it. Repeatable; `*` in the name stands for anything.",
        ),
    ] = None,
    bounds: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_WHAT,
            help="NAME=LOW:HIGH where a candidate has it, an empty end is infinite. "
            "Repeatable.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"), group=_FILES,
            help="Where the fit of the model that is kept goes. Without: "
            "NAME.SCENE.fit.json in the current folder.",
        ),
    ] = None,
    json: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, group=_FILES,
            help="Print everything as JSON and nothing else; a file only with -o.",
        ),
    ] = False,
    format: Format = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:  # fmt: skip
    """Keep the cheapest model that a scene cannot tell from the measurement.

    Refits every candidate for the scene, compares its picture with that of the data, and
    says what each dearer one would change and cost, what the scene cannot see, and what the
    data cannot support. The fit of the model that is kept is written as by `brdf fit`.
    """
    flags = flags or Flags()
    from fitting.cli import assignments, jax_setup, reading, terminal

    if not 0 < max_theta <= 90:
        raise failures.UsageError(f"--max-theta {max_theta:g}: expected 0 to 90 degrees")
    settings = {
        "max_theta_deg": max_theta,
        "fix": assignments.of_lines("fix", fix or []),
        "bounds": assignments.of_lines("bounds", bounds or []),
    }
    paths = files or (_sample(),)
    target = output if output or json else _target(paths, scene)
    if target is not None:
        from fitting.cli.target import check_target

        check_target(target)
    from fitting.scene import load_scene

    told = load_scene(scene)
    options = assignments.of_lines("reader", reader or [])
    measurement = reading.read_files(paths, format, options)
    quiet = flags.quiet or json
    if not quiet:
        say = terminal.stderr()
        if not files:
            say.print("no FILE given: using the bundled sample, which is synthetic")
        say.print(reading.headline(measurement, *paths), style="dim")
    jax_setup.set_up()
    found = _run(measurement, told, model, settings, quiet)
    if target is not None:
        found.result.save(target)
    _answer(found, told, target, json, flags)
    return failures.GOOD if found.met else failures.NOT_CONVERGED


def _answer(
    found: Choice, scene: Scene, target: Path | None, json: bool, flags: Flags
) -> None:
    if json:
        import json as json_module

        import msgspec

        plain = msgspec.to_builtins(found)
        sys.stdout.write(json_module.dumps(plain, indent=1, allow_nan=False) + "\n")
        return
    from fitting.cli import choose_report, terminal

    out = terminal.stdout()
    choose_report.show(out, found, scene, flags)
    if target is not None and not flags.quiet:
        out.print(f"\nwritten to {target}")


def _run(
    measurement: Measurement,
    scene: Scene,
    models: Sequence[str] | None,
    settings: Mapping[str, Any],
    quiet: bool,
) -> Choice:
    from fitting.by_name import unused, unused_words
    from fitting.cli import terminal
    from fitting.cli.work import Work
    from fitting.model import Model
    from fitting.scene.choose import LADDER, choose_for_scene

    candidates = {(own := Model(m)).expression: own for m in models or LADDER}
    if nobody := unused(candidates.values(), settings):
        raise failures.UsageError(unused_words(candidates.values(), *nobody))
    weights = [*_PICTURE, *(_PER_LOBE * len(m.lobes) for m in candidates.values())]
    total = sum(weights) + _UNCERTAINTIES
    beside = min(len(candidates), os.cpu_count() or 1)
    with Work(terminal.stderr(), total, quiet=quiet) as work:
        return choose_for_scene(
            measurement,
            scene,
            list(candidates),
            progress=_teller(work, weights, beside),
            **settings,
        )


def _teller(work: Work, weights: Sequence[int], beside: int) -> Callable[[str], None]:
    """Says what begins; what was said before is done, but for refits ``beside`` it."""
    left, begun, done = list(weights), deque[int](), 0
    one_at_a_time = threading.Lock()

    def tell(what: str) -> None:
        nonlocal done
        with one_at_a_time:
            most = beside if what.startswith("refitting") and left else 1
            begun.append(left.pop(0) if left else 0)
            while len(begun) > most:
                done += begun.popleft()
            work.at(what, done, 0)

    return tell


def _sample() -> Path:
    from fitting.sample import sample_path

    return sample_path()


def _target(paths: Sequence[Path], scene: str) -> Path:
    """NAME.SCENE.fit.json in the current folder."""
    from fitting.cli.reading import stem

    shown = Path(scene).name.removesuffix(".toml")
    return Path(f"{'+'.join(map(stem, paths))}.{shown}.fit.json")
