"""Flags that every command understands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

_GROUP = Group("Output", sort_key=90)


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
