"""``brdf texels``: a spatially varying sample, every texel fitted for itself."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from fitting.cli import failures
from fitting.cli.fit_choices import ObjectiveChoice, WeightsChoice
from fitting.cli.flags import WORK, Flags, Scheduler

_MODEL = Group("Model", sort_key=1)
_MADE_SMALL = Group("What is made small", sort_key=2)
_PHYSICS = Group("Physics", sort_key=3)
_PARAMETERS = Group("Single parameters", sort_key=4)
_FILES = Group("Files", sort_key=6)


@Parameter(name="*")
@dataclass(frozen=True)
class TexelChoices:
    """Options of the fits; the meaning of each is that of `brdf fit`.

    The defaults are the quickest, which those of `brdf fit` are not.
    """

    model: Annotated[
        str,
        Parameter(
            name=("--model", "-m"), group=_MODEL,
            help="A sum of lobes, such as 'lambert + ggx'; see `brdf models`.",
        ),
    ] = "lambert + ggx"  # fmt: skip
    per_channel_shape: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, group=_MODEL,
            help="Shape parameters of every channel for itself.",
        ),
    ] = False  # fmt: skip
    objective: Annotated[
        ObjectiveChoice,
        Parameter(
            group=_MADE_SMALL,
            help="Residual. chi2 takes the data set sigma, or --noise; auto: chi2 where "
            "the file has sigma, else log1p. Quickest: l2cos, l2, chi2.",
        ),
    ] = "l2cos"
    weights: Annotated[
        WeightsChoice,
        Parameter(
            group=_MADE_SMALL,
            help="solid-angle: a row counts for its part of the hemisphere; rows: all "
            "alike. Not for l2 and chi2.",
        ),
    ] = "solid-angle"
    robust: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, group=_MADE_SMALL,
            help="Let outliers count less: about ten times as long.",
        ),
    ] = False  # fmt: skip
    noise: Annotated[
        str | None,
        Parameter(
            group=_MADE_SMALL,
            help="A,B: relative and absolute (1/sr) standard uncertainty for chi2, instead "
            "of the data set sigma.",
        ),
    ] = None
    max_theta: Annotated[
        float,
        Parameter(
            group=_MADE_SMALL,
            help="Leave out directions beyond this polar angle, in deg.",
        ),
    ] = 85.0
    energy: Annotated[
        float,
        Parameter(
            group=_PHYSICS,
            help="Weight of the penalty on an albedo above 1, which takes ten times as "
            "long, and a hundred where it has to hold a fit. 0 for none.",
        ),
    ] = 0.0
    reciprocity: Annotated[
        float,
        Parameter(
            group=_PHYSICS,
            help="Weight of the penalty on f(wi,wo) - f(wo,wi), for models that are not "
            "reciprocal. 0 for none.",
        ),
    ] = 0.0
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
