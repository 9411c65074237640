"""Lowered programs as files, for other processes and later runs.

A program is found by a description of everything that it depends on: the function, the
kinds of its arguments, this package's sources, versions, the kind of device. Nothing in a
file is run by reading it; a damaged one, or one of another description, is not used.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import json
import os
import tempfile
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import jax

_PACKAGE = Path(__file__).parent
_SUFFIX = ".program"
_PLAIN = (type(None), bool, int, float, str)
_folder: Path | None = None


class Program(NamedTuple):
    """A lowered program of arrays, and how its results are put together."""

    exported: Any
    out_tree: Any


def keep_in(folder: Path | None) -> None:
    """From now on programs are kept in a folder, or not at all."""
    global _folder
    _folder = folder


def folder() -> Path | None:
    """Where programs are kept."""
    return _folder


def description(
    name: str, options: dict[str, Any] | None, tree: Any, kinds: list[Any]
) -> str | None:
    """Everything that a program depends on, or None if that cannot be told: for a lobe of
    somebody else's, whose source may change."""
    try:
        parts = [*_described_tree(tree)]
        arguments = [_described(k) for k in kinds]
    except TypeError:
        return None
    return json.dumps(
        [name, _described(sorted((options or {}).items())), parts, arguments, *_machine()]
    )


def made(function: Callable[..., Any], arrays: list[Any]) -> Program | None:
    """The program of a function of arrays, or None if it is one that JAX cannot keep."""
    trees: list[Any] = []

    def listed(*arrays: Any) -> list[Any]:
        results, tree = jax.tree.flatten(function(*arrays))
        trees.append(tree)
        return results

    try:
        return Program(jax.export.export(jax.jit(listed))(*arrays), trees[-1])
    except (NotImplementedError, TypeError, ValueError):
        return None


def read(described: str) -> Program | None:
    """The program of this description, if there is a sound one."""
    try:
        with _path(described).open("rb") as file:
            head = json.loads(file.readline())
            if head["program of"] != described:
                return None
            exported = jax.export.deserialize(bytearray(file.read()))
            return Program(exported, jax.tree.structure(_rebuilt(head["results"])))
    except Exception:  # Whatever is wrong with it: it is made again.
        return None


def write(described: str, program: Program) -> None:
    """Keep a program if that is possible; whole or not at all, whoever else does too."""
    try:
        head = {"program of": described, "results": _outlined(program.out_tree)}
        content = json.dumps(head).encode() + b"\n" + program.exported.serialize()
    except (TypeError, ValueError):
        return
    path = _path(described)
    with contextlib.suppress(OSError):
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(content)
        os.replace(file.name, path)


def _path(described: str) -> Path:
    assert _folder is not None
    return _folder / (hashlib.sha256(described.encode()).hexdigest()[:40] + _SUFFIX)


def _machine() -> list[str]:
    """The rest of a description: what runs the program, and what made it."""
    device = jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]
    return [getattr(device, "platform", None) or jax.default_backend(), *_versions()]


@functools.cache
def _versions() -> tuple[str, ...]:
    sources = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        sources.update(path.read_bytes())
    packages = ("jax", "jaxlib", "equinox", "lineax", "optimistix")
    return (sources.hexdigest(), *(f"{p} {version(p)}" for p in packages))


def _described(value: Any) -> Any:
    """Plain values and tuples of them as such; raises TypeError for others."""
    if isinstance(value, tuple | list):
        return [_described(v) for v in value]
    if isinstance(value, float | int) and type(value) in _PLAIN:
        return [type(value).__name__, repr(value)]
    if type(value) in _PLAIN:
        return value
    raise TypeError(f"not a plain value: {value!r}")


def _described_tree(tree: Any) -> Iterator[Any]:
    """Nodes of a tree of arguments from the outside in: kind, plain data, children.

    Raises TypeError for kinds of others than this package.
    """
    node = tree.node_data()
    if node is None:
        yield "*"
        return
    kind, data = node
    builtin = kind in (tuple, list, dict, type(None))
    if not builtin and kind.__module__.partition(".")[0] != __package__:
        raise TypeError(f"not of this package: {kind!r}")
    if ".py" in str(data):
        raise TypeError(f"a lobe of a file: {data!r}")
    children = tree.children()
    own = data if isinstance(data, tuple | list) else () if data is None else (data,)
    plain = [_described(v) for v in own if type(v).__name__ != "_Missing" and v is not kind]
    yield [f"{kind.__module__}.{kind.__qualname__}", plain, len(children)]
    for child in children:
        yield from _described_tree(child)


def _outlined(tree: Any) -> Any:
    """Results in tuples and named tuples as JSON; raises TypeError for others."""
    node = tree.node_data()
    if node is None:
        return "*"
    kind = node[0]
    if kind is type(None):
        return None
    if not issubclass(kind, tuple):
        raise TypeError(f"results in a {kind.__name__}")
    return [f"{kind.__module__}:{kind.__qualname__}", *map(_outlined, tree.children())]


def _rebuilt(outline: Any) -> Any:
    """Numbers in the tuples of an outline; of named ones only those of this package."""
    if outline is None or outline == "*":
        return outline and 0
    name, *children = outline
    values = [_rebuilt(v) for v in children]
    if name == "builtins:tuple":
        return tuple(values)
    module, _, kind = name.partition(":")
    if module.partition(".")[0] != __package__:
        raise ValueError(f"not of this package: {name}")
    return getattr(importlib.import_module(module), kind)(*values)
