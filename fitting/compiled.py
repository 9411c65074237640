"""Compiled functions, which need not be traced again in every process.

JAX keeps compiled code across processes, but to find it there a function must be traced
and lowered, which takes longer than the fit. Functions marked `compiled` keep the lowered
program too, where the process has a folder for it (`fitting.kept_programs`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Generic, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp

from fitting import kept_programs
from fitting.kept_programs import Program

_P = ParamSpec("_P")
_T = TypeVar("_T")


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
        self._function, self._options = function, options
        self._jitted = eqx.filter_jit(function, compiler_options=options)  # pyright: ignore
        self._ready: dict[Any, Callable[..., Any]] = {}

    def __call__(self, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        folder = kept_programs.folder()
        leaves, tree = jax.tree.flatten((args, kwargs))
        arrays = [v for v in leaves if eqx.is_array(v)]
        if folder is None or any(isinstance(v, jax.core.Tracer) for v in arrays):
            return self._jitted(*args, **kwargs)
        # Precision as it is now, which decides about numbers that have none of their own.
        key = (tree, str(jnp.result_type(float)), *map(_kind, leaves))
        run = self._ready.get(key)
        if run is None:
            run = self._ready[key] = self._made_ready(key, leaves)
        return run(*arrays) if run is not self._jitted else run(*args, **kwargs)

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
            program = kept_programs.made(self._flat(tree, leaves), arrays)
            if program is None:
                return self._jitted
            kept_programs.write(described, program)
        return self._runner(program)

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

    def _runner(self, program: Program) -> Callable[..., Any]:
        run = jax.jit(program.exported.call, compiler_options=self._options)
        return lambda *arrays: jax.tree.unflatten(program.out_tree, run(*arrays))


def _kind(leaf: Any) -> Any:
    """What the program depends on: of an array its shape and type, else the value."""
    if not eqx.is_array(leaf):
        return type(leaf).__name__, leaf
    return jnp.shape(leaf), str(leaf.dtype), bool(getattr(leaf, "weak_type", False))
