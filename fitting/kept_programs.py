"""Compiled programs as files, for other processes and later runs.

A program is found by a description of everything that it depends on: the function, the
kinds of its arguments, this package's sources, versions, the processor. A damaged file, or
one of another description, is not used. As with JAX's own cache, who can write into the
folder can decide what is run.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import itertools
import json
import os
import platform
import threading
import zlib
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from fitting.batch.writing import remove_parts, replace_file

_PACKAGE = Path(__file__).parent
# Where nothing is compiled, and changes most often.
_COMPILES_NOTHING = _PACKAGE / "cli"
_SUFFIX = ".program"
_HOUR = 3600.0
# To JAX's setting of how long a program has to be compiled for it to be kept.
NEVER = 1e9
_PLAIN = (type(None), bool, int, float, str)
_folder: Path | None = None
_looking = threading.Lock()


class Program(NamedTuple):
    """A compiled program of arrays that lists its results, and how these are arranged."""

    run: Callable[..., list[Any]]
    out_tree: Any


def keep_in(folder: Path | None) -> None:
    """From now on programs are kept in a folder, or not at all."""
    global _folder
    _folder = folder


def folder() -> Path | None:
    """Where programs are kept; nowhere while a certain device is to be used."""
    chosen = jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]
    return _folder if chosen is None else None


def description(
    name: str, options: dict[str, Any], tree: Any, kinds: list[Any]
) -> str | None:
    """Everything that a program depends on, or None if that cannot be told: for a lobe of
    somebody else's, whose source may change."""
    try:
        parts = [*_described_tree(tree)]
        arguments = [_described(k) for k in kinds]
        chosen = _described(sorted(options.items()))
    except TypeError:
        return None
    # What it takes long to see is seen by one thread, and the first one goes on first.
    with _looking:
        here = _surroundings()
    return json.dumps([name, chosen, parts, arguments, _device(), *here])


def made(described: str, lowered: jax.stages.Lowered, n_arguments: int) -> Program | None:
    """The program of a lowered function of arrays, from now on kept if that is possible.

    None if it calls others, such as LAPACK's, which would have to be found again.
    """
    from jax.experimental import serialize_executable

    if "custom_call" in lowered.as_text():
        return None
    with _not_in_jax_cache:
        compiled = lowered.compile()

    def run(*arrays: Any) -> list[Any]:
        return jax.tree.leaves(compiled(*arrays))

    program = Program(run, lowered.out_tree)
    with contextlib.suppress(NotImplementedError, TypeError, ValueError):
        payload, *_ = serialize_executable.serialize(compiled)
        head = [described, n_arguments, _outlined(program.out_tree)]
        content = zlib.compress(json.dumps(head).encode() + b"\n" + payload, 1)
        with contextlib.suppress(OSError):
            path = _path(described)
            replace_file(path, content)
            remove_parts(path.parent, older_than=_HOUR)
    return program


def read(described: str) -> Program | None:
    """The program of this description, if there is a sound one."""
    from jax.experimental import serialize_executable

    try:
        head, _, payload = zlib.decompress(_path(described).read_bytes()).partition(b"\n")
        of, n_arguments, outline = json.loads(head)
        if of != described:
            return None
        out_tree = jax.tree.structure(_rebuilt(outline))
        arguments = jax.tree.structure(((0,) * n_arguments, {}))
        results = jax.tree.structure([0] * out_tree.num_leaves)
        run = serialize_executable.deserialize_and_load(payload, arguments, results)
        return Program(run, out_tree)
    except Exception:  # Whatever is wrong with it: it is made again.
        return None


def _path(described: str) -> Path:
    assert _folder is not None
    return _folder / (hashlib.sha256(described.encode()).hexdigest()[:40] + _SUFFIX)


class _NotInJaxCache:
    """What is kept here is not kept by JAX too, where nobody would look for it.

    The setting is one for all threads: the first in makes it, the last out undoes it.
    """

    _NAME = "jax_persistent_cache_min_compile_time_secs"

    def __init__(self) -> None:
        self._lock, self._inside, self._before = threading.Lock(), 0, 0.0

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                self._before = getattr(jax.config, self._NAME)
                jax.config.update(self._NAME, NEVER)
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                jax.config.update(self._NAME, self._before)


_not_in_jax_cache = _NotInJaxCache()


def _device() -> list[str]:
    device = jax.devices()[0]
    return [device.platform, device.device_kind, device.client.platform_version]


@functools.cache
def _surroundings() -> tuple[str, ...]:
    """What made a program, and the processor, whose instructions it may use."""
    sources = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        if _COMPILES_NOTHING not in path.parents:
            sources.update(path.read_bytes())
    packages = ("jax", "jaxlib", "equinox", "lineax", "optimistix")
    return (
        sources.hexdigest(),
        *(f"{p} {version(p)}" for p in packages),
        os.environ.get("XLA_FLAGS", ""),
        _processor(),
    )


def _processor() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            # The first core's; the others are like it.
            first = itertools.takewhile(str.strip, file)
            return "".join(s for s in first if s.startswith(("flags", "Features")))
    except OSError:
        # Then the same machine it is to be.
        return " ".join(platform.uname())


def _described(value: Any) -> Any:
    """Plain values, types of arrays, tuples of them; raises TypeError for others."""
    if isinstance(value, tuple | list):
        return [_described(v) for v in value]
    if isinstance(value, float | int) and type(value) in _PLAIN:
        return [type(value).__name__, repr(value)]
    if type(value) in _PLAIN:
        return value
    if isinstance(value, np.dtype):
        return value.name
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
    if outline is None:
        return None
    if outline == "*":
        return 0
    name, *children = outline
    values = [_rebuilt(v) for v in children]
    if name == "builtins:tuple":
        return tuple(values)
    module, _, kind = name.partition(":")
    if module.partition(".")[0] != __package__:
        raise ValueError(f"not of this package: {name}")
    return getattr(importlib.import_module(module), kind)(*values)
