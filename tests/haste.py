"""Compiling in haste: code that runs a little longer, in a third of the compiler's time."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
from jax._src import compiler

_AS_USERS = compiler.get_compile_options
# No optimisation; elementwise code by the compiler's older, quicker way; in one part.
_WISHES: dict[str, bool | int] = {
    "xla_backend_optimization_level": 0,
    "xla_llvm_disable_expensive_passes": True,
    "xla_cpu_use_fusion_emitters": False,
    "xla_cpu_parallel_codegen_split_count": 1,
}


@functools.cache
def options() -> dict[str, bool | int]:
    """What this version of the compiler knows of what is wished."""
    return {name: value for name, value in _WISHES.items() if _is_known({name: value})}


def _is_known(option: dict[str, bool | int]) -> bool:
    try:
        jax.jit(lambda: 0, compiler_options=option).lower().compile()
    except jax.errors.JaxRuntimeError:
        return False
    return True


@contextlib.contextmanager
def compiling(*, in_haste: bool) -> Iterator[None]:
    """Everything that is compiled in the meantime: in haste, or as users compile it."""
    before = compiler.get_compile_options
    # JAX has no setting for all of these.
    compiler.get_compile_options = (
        functools.partial(_hasty, options()) if in_haste else _AS_USERS
    )
    try:
        yield
    finally:
        compiler.get_compile_options = before


def _hasty(
    ours: dict[str, Any],
    *args: Any,
    env_options_overrides: dict[str, Any] | None = None,
    **kwargs: Any,
) -> Any:
    both = ours | (env_options_overrides or {})
    return _AS_USERS(*args, env_options_overrides=both, **kwargs)


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
    ours = {"BRDF_CACHE_DIR": kept["JAX_COMPILATION_CACHE_DIR"]}
    return {"XLA_FLAGS": " ".join(flags), **kept, **ours}
