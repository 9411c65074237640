"""Room for compiled code, of which a process cannot hold any amount."""

from __future__ import annotations

from pathlib import Path

import jax

# Linux grants a process 65,530 regions of memory; every compiled function takes three for
# good, small ones included, and where they are used up the compiler aborts.
_MANY = 30_000
_REGIONS = Path("/proc/self/maps")


def make_room() -> None:
    """Forget what was compiled if it has become much; what is needed is compiled again."""
    if _REGIONS.exists() and _REGIONS.read_bytes().count(b"\n") > _MANY:
        jax.clear_caches()
