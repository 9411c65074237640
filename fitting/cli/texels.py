"""``brdf texels``: a spatially varying sample, every texel fitted for itself."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from fitting.cli import failures
from fitting.cli.flags import WORK, Flags, Scheduler

_MODEL = Group("Model", sort_key=1)
_MADE_SMALL = Group("What is made small", sort_key=2)
_PARAMETERS = Group("Single parameters", sort_key=4)
_FILES = Group("Files", sort_key=6)

Objective = Literal["l2cos", "l2", "chi2"]
Weights = Literal["solid-angle", "rows"]


@Parameter(name="*")
@dataclass(frozen=True)
class TexelChoices:
    """Options of the fits; the meaning of each is that of `brdf fit`."""

    model: Annotated[
        str,
        Parameter(
            name=("--model", "-m"), group=_MODEL,
            help="A sum of lobes, such as 'lambert + ggx'; see `brdf models`.",
        ),
    ] = "lambert + ggx"  # fmt: skip
    objective: Annotated[
        Objective,
        Parameter(
            group=_MADE_SMALL,
            help="Residual, linear in the model's value; chi2 takes the data set sigma.",
        ),
    ] = "l2cos"
    weights: Annotated[
        Weights,
        Parameter(
            group=_MADE_SMALL,
            help="solid-angle: a row counts for its part of the hemisphere; rows: all "
            "alike. For l2cos.",
        ),
    ] = "solid-angle"
    max_theta: Annotated[
        float,
        Parameter(
            group=_MADE_SMALL,
            help="Leave out directions beyond this polar angle, in deg.",
        ),
    ] = 85.0
    fix: Annotated[
        list[str] | None,
        Parameter(negative="", group=_PARAMETERS, help="NAME=VALUE. Repeatable."),
    ] = None
    bounds: Annotated[
        list[str] | None,
        Parameter(negative="", group=_PARAMETERS, help="NAME=LOW:HIGH. Repeatable."),
    ] = None
    tie: Annotated[
        list[str] | None,
        Parameter(negative="", group=_PARAMETERS, help="NAME=FACTOR*OTHER. Repeatable."),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True)
class TexelWork:
    """Who does the work, where it goes, and what about work that was begun."""

    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"), group=_FILES,
            help="Where the parameters go, HDF5. Without: NAME.texels.h5 in the current "
            "folder.",
        ),
    ] = None  # fmt: skip
    workers: Annotated[
        int,
        Parameter(group=WORK, help="Number of processes; 1: this one alone."),
    ] = 1
    scheduler: Scheduler = None
    resume: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, group=WORK,
            help="Go on with the parts that an earlier run wrote before it was ended.",
        ),
    ] = False  # fmt: skip


def texels(
    file: Annotated[
        Path,
        Parameter(help="HDF5 with value (t, n, c) or (h, w, n, c) and n directions."),
    ],
    choices: TexelChoices | None = None,
    work: TexelWork | None = None,
    json: Annotated[
        bool,
        Parameter(negative="", show_default=False, help="Say the outcome as JSON."),
    ] = False,
    flags: Flags | None = None,
) -> int:
    """Fit a model to every texel of a sample, all measured in the same directions.

    FILE has the data sets theta_i, phi_i, theta_r, phi_r (n), with the attribute units =
    'rad' or 'deg', and value (t, n, c) or (h, w, n, c): the BSDF in 1/sr without cosine,
    NaN where unknown. Optional: valid and sigma like value, channel (c), wavelength (c).

    The result has parameters/NAME and uncertainties/NAME, (t) or (t, c), and cost,
    converged, steps, used, runner_up (t). Data are read in chunks, so that memory does not
    grow with the file. Killed at any moment, the same command with --resume goes on.
    """
    flags, who = flags or Flags(), work or TexelWork()
    from fitting.cli import texels_run

    job = texels_run.settle(file, choices or TexelChoices(), who)
    done = texels_run.run(job, who, quiet=flags.quiet or json)
    if json:
        import json as text

        sys.stdout.write(text.dumps(done.as_record(job)) + "\n")
    elif done.stopped is None:
        from fitting.cli import terminal

        terminal.stdout().print(done.sentence(job), soft_wrap=True)
    if done.stopped is not None:
        print(
            f"brdf: {done.stopped}; what is done is kept, and the same command with "
            "--resume goes on",
            file=sys.stderr,
        )
        return done.code
    return failures.GOOD if done.converged else failures.NOT_CONVERGED
