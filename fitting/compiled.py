"""Compiled functions, which need not be traced again in every process.

JAX keeps compiled code across processes, but to find it there a function must be traced
and lowered, which takes longer than the fit. Functions marked `compiled` are found by what
they are given, where the process has a folder for that (`fitting.kept_programs`).
"""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar
from uuid import uuid4

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

from fitting import kept_programs
from fitting.batch.threads import allowed
from fitting.kept_programs import Program

_P = ParamSpec("_P")
_T = TypeVar("_T")
# Where arrays are short, the compiler takes longer than what it compiles: without its
# slower ways it takes two thirds of the time, for code that takes a tenth longer.
_FEW = 2000
_QUICK = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1}
# Linux grants a process 65,530 regions of memory; every compiled function takes three for
# good, small ones included, and where they are used up the compiler aborts.
_MANY = 30_000
_REGIONS = Path("/proc/self/maps")
# To trace in the background, one after the other: Python does one thing at a time, and what
# was begun first is needed first, and can be compiled while the next is traced.
_turn = threading.Lock()
_AT_ONCE = nullcontext()


def compiled(
    options: dict[str, Any] | None = None, *, quickly: bool = True
) -> Callable[[Callable[_P, _T]], Compiled[_P, _T]]:
    """Decorate a pure function of arrays; ``options`` are the compiler's.

    For short arrays it is compiled ``quickly``, unless it is called many times. As with
    `equinox.filter_jit`, arrays are traced, and whatever else is among the arguments is a
    part of the program. The function returns arrays in tuples.
    """
    return lambda function: Compiled(function, options, quickly=quickly)


class Compiled(Generic[_P, _T]):
    """What `compiled` makes of a function."""

    def __init__(
        self,
        function: Callable[_P, _T],
        options: dict[str, Any] | None = None,
        *,
        quickly: bool = True,
    ):
        functools.update_wrapper(self, function)
        self._function: Callable[..., _T] = function
        self._options, self._quickly = options or {}, quickly
        self._ready: dict[Any, Callable[..., Any] | Future] = {}
        _all.add(self)

    def __call__(self, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        leaves, tree = jax.tree.flatten((args, kwargs))
        arrays = [v for v in leaves if _is_array(v)]
        if any(isinstance(v, Tracer) for v in arrays):
            return self._function(*args, **kwargs)
        key = _key(tree, leaves)
        run = self._ready.get(key)
        if isinstance(run, Future):
            run = self._ready[key] = self._made(key, run)
        if run is None:
            run = self._ready[key] = self._made_ready(key, leaves)
        return run(*arrays)

    def _made(self, key: tuple, future: Future) -> Callable[..., Any]:
        try:
            return future.result()
        except BaseException:
            # What went wrong is said once, and tried again the next time.
            self._ready.pop(key, None)
            raise

    def begin(self, *args: Any, **kwargs: Any) -> None:
        """Read or compile in the background what a call with such arguments will need.

        Arrays may be `jax.ShapeDtypeStruct`. Nothing where programs are not kept.
        """
        if kept_programs.folder() is None:
            return
        leaves, tree = jax.tree.flatten((args, kwargs))
        key = _key(tree, leaves)
        if key in self._ready:
            return
        x64 = jnp.result_type(float) == jnp.float64

        def made_ready() -> Callable[..., Any]:
            with jax.enable_x64(x64):
                return self._made_ready(key, leaves, turn=_turn)

        self._ready[key] = _background().submit(made_ready)

    def lower(self, *args: _P.args, **kwargs: _P.kwargs) -> jax.stages.Lowered:
        """The program as `jax.jit` lowers it, to look into."""
        leaves, tree = jax.tree.flatten((args, kwargs))
        arrays = [v for v in leaves if _is_array(v)]
        return self._jitted(tree, leaves).lower(*arrays)

    def forget(self) -> None:
        """What was read or compiled; what is needed is read again."""
        self._ready.clear()

    def _made_ready(
        self, key: tuple, leaves: list[Any], turn: AbstractContextManager = _AT_ONCE
    ) -> Callable[..., Any]:
        """The function of its arrays alone, kept if that is possible.

        It is traced when it is its ``turn``.
        """
        tree, keeps, *kinds = key
        if not keeps:
            return self._jitted(tree, leaves)
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        described = kept_programs.description(name, self._wishes(leaves), tree, kinds)
        if described is None:
            return self._jitted(tree, leaves)
        program = kept_programs.read(described)
        if program is not None:
            return self._or_made_again(program, described, key, leaves)
        return self._made_and_kept(described, tree, leaves, turn)

    def _made_and_kept(
        self,
        described: str,
        tree: Any,
        leaves: list[Any],
        turn: AbstractContextManager = _AT_ONCE,
    ) -> Callable[..., Any]:
        # JAX's own cache finds functions by name and code: it is never to find this one,
        # since what was read there cannot be written again.
        jitted = self._jitted(tree, leaves, name=f"{self._function.__name__}_{uuid4().hex}")
        arrays = [v for v in leaves if _is_array(v)]
        with turn:
            lowered = jitted.lower(*arrays)
        program = kept_programs.made(described, lowered, len(arrays))
        return self._jitted(tree, leaves) if program is None else _joined(program)

    def _or_made_again(
        self, program: Program, described: str, key: tuple, leaves: list[Any]
    ) -> Callable[..., Any]:
        """What was read, or made anew if it turns out that it cannot be run."""
        read = _joined(program)
        others = [None if _is_array(v) else [v] for v in leaves]

        def run(*arrays: Any) -> Any:
            try:
                # Waiting for it, once: what cannot be run may say so at the end only.
                out = jax.block_until_ready(read(*arrays))
                self._ready[key] = read
                return out
            except jax.errors.JaxRuntimeError:
                given = iter(arrays)
                all_of_them = [next(given) if v is None else v[0] for v in others]
                made = self._made_and_kept(described, key[0], all_of_them)
                self._ready[key] = made
                return made(*arrays)

        return run

    def _jitted(self, tree: Any, leaves: list[Any], name: str | None = None) -> Any:
        """The function of its arrays, in order; the rest of the arguments is fixed."""
        is_array = [_is_array(v) for v in leaves]
        fixed = [None if array else v for array, v in zip(is_array, leaves, strict=True)]

        def flat(*arrays: Any) -> _T:
            given = iter(arrays)
            both = zip(is_array, fixed, strict=True)
            args, kwargs = jax.tree.unflatten(
                tree, [next(given) if array else v for array, v in both]
            )
            return self._function(*args, **kwargs)

        flat.__name__ = name or self._function.__name__
        return jax.jit(flat, compiler_options=_known(self._wishes(leaves)))

    def _wishes(self, leaves: list[Any]) -> dict[str, Any]:
        quick = self._quickly and _are_few(leaves)
        return self._options | (_QUICK if quick else {})


def _joined(program: Program) -> Callable[..., Any]:
    return lambda *arrays: jax.tree.unflatten(program.out_tree, program.run(*arrays))


@functools.cache
def _background() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(allowed(), "compiling")


def _are_few(leaves: list[Any]) -> bool:
    lengths = (n for v in leaves if _is_array(v) for n in v.shape)
    return max(lengths, default=0) <= _FEW and jax.default_backend() == "cpu"


def _known(options: dict[str, Any]) -> dict[str, Any]:
    """Those that this version of the compiler knows."""
    pairs = tuple(options.items())
    if not pairs or _are_known(*pairs):
        return options
    return dict(p for p in pairs if _are_known(p))


@functools.cache
def _are_known(*options: tuple[str, Any]) -> bool:
    try:
        jax.jit(lambda: 0, compiler_options=dict(options)).lower().compile()
    except jax.errors.JaxRuntimeError:
        return False
    return True


def _is_array(leaf: Any) -> bool:
    return eqx.is_array(leaf) or isinstance(leaf, jax.ShapeDtypeStruct)


def _key(tree: Any, leaves: list[Any]) -> tuple:
    """With the precision as it is now, which numbers have that have none of their own."""
    keeps = kept_programs.folder() is not None
    return (tree, keeps, jnp.result_type(float), *map(_kind, leaves))


def _kind(leaf: Any) -> Any:
    """What the program depends on: of an array its shape and type, else the value."""
    if not _is_array(leaf):
        # Of numbers as it is written, since 0.0 == -0.0.
        return type(leaf).__name__, repr(leaf) if isinstance(leaf, float) else leaf
    return leaf.shape, leaf.dtype, bool(getattr(leaf, "weak_type", False))


_all: weakref.WeakSet[Compiled] = weakref.WeakSet()


def make_room() -> None:
    """Forget what was compiled if it has become much; what is needed is compiled again."""
    if _REGIONS.exists() and _REGIONS.read_bytes().count(b"\n") > _MANY:
        jax.clear_caches()
        for function in _all:
            function.forget()
