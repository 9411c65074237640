"""JAX's settings, which belong to the program and not to the library.

Compiled code is kept in the user's cache folder, so that only the first fit of a model
waits for the compiler.
"""

from __future__ import annotations

import os
import sys
from importlib.metadata import version
from pathlib import Path

from fitting.batch.threads import cores, same_sums

OVERRIDE = "BRDF_CACHE_DIR"
_JAX_OWN = "JAX_COMPILATION_CACHE_DIR"


def cache_folder() -> Path | None:
    """Where compiled code is kept, or None if the user wants none.

    ``BRDF_CACHE_DIR``, or ``brdf-fitting/<version of jax>`` in the user's cache folder.
    """
    chosen = os.environ.get(OVERRIDE)
    if chosen is not None:
        return Path(chosen) if chosen else None
    if own := os.environ.get(_JAX_OWN):
        return Path(own)
    return _user_cache() / "brdf-fitting" / version("jax")


def is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def writable_cache() -> Path | None:
    """The cache folder, made if need be, or None if there is to be none or cannot be."""
    folder = cache_folder()
    return folder if folder is not None and is_writable(folder) else None


def set_up() -> None:
    """Settle JAX's platform and cache; before the first computation, once or again."""
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    same_sums(cores())
    import jax

    from fitting import kept_programs

    folder, writable = cache_folder(), writable_cache()
    # One that others have filled is used also where it may only be read.
    usable = folder if writable or (folder is not None and folder.is_dir()) else None
    kept_programs.keep_in(usable)
    if usable is None:
        return
    jax.config.update("jax_compilation_cache_dir", str(usable))
    least = 0.0 if writable else kept_programs.NEVER
    jax.config.update("jax_persistent_cache_min_compile_time_secs", least)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def _user_cache() -> Path:
    if sys.platform == "win32":
        local = os.environ.get("LOCALAPPDATA")
        return Path(local) if local else Path.home() / "AppData" / "Local"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    # The specification says that a relative path is to be ignored.
    stated = os.environ.get("XDG_CACHE_HOME", "")
    return Path(stated) if os.path.isabs(stated) else Path.home() / ".cache"
