"""Which targets there are; a target's file is loaded when it is asked for."""

from __future__ import annotations

import ast
import difflib
import importlib
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, cast

from fitting.expression import ModelError

if TYPE_CHECKING:
    from fitting.export.target import Target

TARGETS = (
    "mitsuba",
    "pbrt",
    "materialx",
    "openpbr",
    "gltf",
    "blender",
    "radiance",
    "klems",
    # Tables of databases and of optical design.
    "merl",
    "zemax",
    "abg",
    # Tables of this program.
    "csv",
    "hdf5",
    "astm",
)


@dataclass(frozen=True)
class TargetInfo:
    """A target as listed to people: its name for ``--to``, the suffixes of its files, and
    one sentence."""

    name: str
    suffixes: tuple[str, ...]
    description: str


def targets() -> tuple[TargetInfo, ...]:
    """Every target, read from the heads of their files without loading them."""
    return tuple(map(_info, TARGETS))


def load(name: str) -> Target:
    """The module of a target. Raises `ModelError` for an unknown name."""
    if name not in TARGETS:
        near = difflib.get_close_matches(name, TARGETS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(TARGETS)}"
        raise ModelError(f"there is no target {name!r}; {hint}")
    return cast("Target", importlib.import_module(f"fitting.export.{name}"))


def _info(name: str) -> TargetInfo:
    tree = ast.parse((files("fitting.export") / f"{name}.py").read_text(encoding="utf-8"))
    suffixes = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "SUFFIXES"
    )
    first = (ast.get_docstring(tree) or "").partition("\n")[0]
    return TargetInfo(name, suffixes, first)
