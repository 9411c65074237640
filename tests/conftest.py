"""What all tests share: compiled code, and where the measured files of others lie."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

# Where it is the rounding and the speed of the compiled code that is tested.
OPTIMISED = ("models", "benchmarks", "test_stress.py")


def pytest_configure(config: pytest.Config) -> None:
    """Compiled code is kept for the other workers and later runs: most of the time of these
    tests is the compiler's."""
    import jax

    folder = config.rootpath / ".pytest_cache" / "compiled"
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


@pytest.fixture(autouse=True, scope="module")
def compiled_in_haste(request: pytest.FixtureRequest) -> Iterator[None]:
    """Without most optimisations, where the same arithmetic only takes longer."""
    import jax

    hasty = not set(OPTIMISED) & set(request.path.parts)
    jax.config.update("jax_disable_most_optimizations", hasty)
    yield
    jax.config.update("jax_disable_most_optimizations", False)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real measured files, which the project may use but not ship."""
    folder = os.environ.get("BRDF_TEST_DATA")
    if not folder:
        pytest.skip("real files: set BRDF_TEST_DATA to a folder of measured files")
    path = Path(folder)
    if not path.is_dir():
        pytest.skip(f"real files: BRDF_TEST_DATA={folder} is not a folder")
    return path
