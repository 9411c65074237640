"""Compiled functions, which need not be traced again in every process.

JAX keeps compiled code across processes, but to find it there a function must be traced
and lowered, which takes longer than the fit. Functions marked `compiled` are found by what
they are given, where the process has a folder for that (`fitting.kept_programs`).
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

from fitting import kept_programs
from fitting.kept_programs import Program

_P = ParamSpec("_P")
_T = TypeVar("_T")
# Linux grants a process 65,530 regions of memory; every compiled function takes three for
# good, small ones included, and where they are used up the compiler aborts.
_MANY = 30_000
_REGIONS = Path("/proc/self/maps")


def compiled(
    options: dict[str, Any] | None = None,
) -> Callable[[Callable[_P, _T]], Compiled[_P, _T]]:
    """Decorate a pure function of arrays; ``options`` are the compiler's.

    As with `equinox.filter_jit`, arrays are traced, and whatever else is among the
    arguments is a part of the program. The function returns arrays in tuples.
    """
    return lambda function: Compiled(function, options)


class Compiled(Generic[_P, _T]):
    """What `compiled` makes of a function."""

    def __init__(self, function: Callable[_P, _T], options: dict[str, Any] | None):
        functools.update_wrapper(self, function)
        self._function: Callable[..., _T] = function
        self._options = options
        self._jitted = eqx.filter_jit(function, compiler_options=options)  # pyright: ignore
        self._ready: dict[Any, Callable[..., Any]] = {}
        _all.add(self)

    def __call__(self, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        leaves, tree = jax.tree.flatten((args, kwargs))
        arrays = [v for v in leaves if eqx.is_array(v)]
        if kept_programs.folder() is None or any(isinstance(v, Tracer) for v in arrays):
            return self._jitted(*args, **kwargs)
        # Precision as it is now, which decides about numbers that have none of their own.
        key = (tree, str(jnp.result_type(float)), *map(_kind, leaves))
        run = self._ready.get(key)
        if run is None:
            run = self._ready[key] = self._made_ready(key, leaves)
        return run(*arrays) if run is not self._jitted else run(*args, **kwargs)

    def lower(self, *args: _P.args, **kwargs: _P.kwargs) -> Any:
        """The program as `jax.jit` lowers it, to look into."""
        return self._jitted.lower(*args, **kwargs)

    def forget(self) -> None:
        """What was read or compiled; what is needed is read again."""
        self._ready.clear()

    def _made_ready(self, key: tuple, leaves: list[Any]) -> Callable[..., Any]:
        """A function of the arrays alone, or of everything where it cannot be kept."""
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        tree, *kinds = key
        described = kept_programs.description(name, self._options, tree, kinds)
        if described is None:
            return self._jitted
        program = kept_programs.read(described)
        if program is None:
            arrays = [v for v in leaves if eqx.is_array(v)]
            function = self._flat(tree, leaves)
            program = kept_programs.made(described, function, arrays, self._options)
        return self._jitted if program is None else _joined(program)

    def _flat(self, tree: Any, leaves: list[Any]) -> Callable[..., _T]:
        """The function of its arrays, in order."""
        is_array = [eqx.is_array(v) for v in leaves]
        fixed = [None if array else v for array, v in zip(is_array, leaves, strict=True)]

        def flat(*arrays: Any) -> _T:
            given = iter(arrays)
            both = zip(is_array, fixed, strict=True)
            args, kwargs = jax.tree.unflatten(
                tree, [next(given) if array else v for array, v in both]
            )
            return self._function(*args, **kwargs)

        return flat


def _joined(program: Program) -> Callable[..., Any]:
    return lambda *arrays: jax.tree.unflatten(program.out_tree, program.run(*arrays))


def _kind(leaf: Any) -> Any:
    """What the program depends on: of an array its shape and type, else the value."""
    if not eqx.is_array(leaf):
        return type(leaf).__name__, leaf
    return jnp.shape(leaf), str(leaf.dtype), bool(getattr(leaf, "weak_type", False))


_all: weakref.WeakSet[Compiled] = weakref.WeakSet()


def make_room() -> None:
    """Forget what was compiled if it has become much; what is needed is compiled again."""
    if _REGIONS.exists() and _REGIONS.read_bytes().count(b"\n") > _MANY:
        jax.clear_caches()
        for function in _all:
            function.forget()
