"""Compiling in haste: code that runs a little longer, in a third of the compiler's time."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
from jax._src import compiler

# No optimisation; elementwise code by the compiler's older, quicker way; in one part.
_WISHES: dict[str, bool | int] = {
    "xla_backend_optimization_level": 0,
    "xla_llvm_disable_expensive_passes": True,
    "xla_cpu_use_fusion_emitters": False,
    "xla_cpu_parallel_codegen_split_count": 1,
}


@functools.cache
def options() -> dict[str, bool | int]:
    """``compiler_options`` of `jax.jit`, those that this version of the compiler knows."""
    return {name: value for name, value in _WISHES.items() if _is_known({name: value})}


def _is_known(option: dict[str, bool | int]) -> bool:
    try:
        jax.jit(lambda: 0, compiler_options=option).lower().compile()
    except jax.errors.JaxRuntimeError:
        return False
    return True


@contextlib.contextmanager
def everywhere() -> Iterator[None]:
    """Every function that is compiled in the meantime."""
    real, ours = compiler.get_compile_options, options()

    def hasty(*args, env_options_overrides: dict[str, Any] | None = None, **kwargs):
        both: Any = ours | (env_options_overrides or {})
        return real(*args, env_options_overrides=both, **kwargs)

    # JAX has no setting for them all.
    compiler.get_compile_options = hasty
    try:
        yield
    finally:
        compiler.get_compile_options = real


def kept_in(root: Path) -> dict[str, Any]:
    """JAX's settings to keep what was compiled, for other processes and later runs."""
    return {
        "jax_compilation_cache_dir": str(root / ".pytest_cache" / "compiled"),
        "jax_persistent_cache_min_compile_time_secs": 0.1,
        "jax_persistent_cache_min_entry_size_bytes": -1,
    }


def environment(root: Path) -> dict[str, str]:
    """The variables that make another process compile as quickly, and keep it."""
    flags = (f"--{name}={str(value).lower()}" for name, value in options().items())
    kept = {name.upper(): str(value) for name, value in kept_in(root).items()}
    return {"XLA_FLAGS": " ".join(flags), **kept}
