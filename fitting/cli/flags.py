"""Flags that every command understands."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

_GROUP = Group("Output", sort_key=90)

# What every command that reads a file takes.
File = Annotated[Path, Parameter(help="A file of measurements.")]
Format = Annotated[
    str | None, Parameter(help="Format of the file, if it is not recognised.")
]
Reader = Annotated[
    list[str] | None,
    Parameter(negative="", help="OPTION=VALUE for the format's reader. Repeatable."),
]
# What every command that shows a result beside its data takes.
Data = Annotated[
    list[Path] | None,
    Parameter(
        negative="",
        help="The measurement, if it is not where it was for the fit, or another one to "
        "compare with. Repeatable: files of one sample are joined.",
    ),
]
DataFormat = Annotated[
    str | None, Parameter(help="Format of --data, if it is not recognised.")
]
# What every command with work for many processes takes.
WORK = Group("Who works", sort_key=7)
Scheduler = Annotated[
    str | None,
    Parameter(
        group=WORK,
        help="A dask scheduler, tcp://HOST:PORT, whose workers see the same files, or "
        "local for one of its own. Needs brdf-fitting[dask].",
    ),
]
Json = Annotated[
    bool,
    Parameter(negative="", show_default=False, help="Everything as JSON, for programs."),
]


@Parameter(name="*")
@dataclass(frozen=True)
class Flags:
    """How much is said."""

    quiet: Annotated[
        bool,
        Parameter(
            name=("--quiet", "-q"), negative="", show_default=False, group=_GROUP,
            help="Only the essential line, no progress and no warnings.",
        ),
    ] = False  # fmt: skip
    verbose: Annotated[
        bool,
        Parameter(
            name=("--verbose", "-v"), negative="", show_default=False, group=_GROUP,
            help="Everything: all channels, settings, what is being done and when.",
        ),
    ] = False  # fmt: skip
    debug: Annotated[
        bool,
        Parameter(
            negative="",
            show_default=False,
            group=_GROUP,
            help="The traceback, should something go wrong.",
        ),
    ] = False


@Parameter(name="*")
@dataclass(frozen=True)
class DebugFlag:
    """For commands that have nothing to be quiet about."""

    debug: Annotated[
        bool,
        Parameter(
            negative="",
            show_default=False,
            group=_GROUP,
            help="The traceback, should something go wrong.",
        ),
    ] = False
