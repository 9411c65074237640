"""What all tests share: compiled code, and where the measured files of others lie."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import haste
import pytest

# Where it is the rounding and the speed of the compiled code that is tested.
OPTIMISED = ("test_combined_options.py", "test_precision.py", "benchmarks")


def pytest_configure(config: pytest.Config) -> None:
    """Compiled code is kept for the other workers and later runs: most of the time of these
    tests is the compiler's."""
    import jax

    for name, value in haste.kept_in(config.rootpath).items():
        jax.config.update(name, value)


def pytest_collection_finish() -> None:
    """What is there to stay is not looked through for garbage again and again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)


@pytest.fixture(autouse=True, scope="session")
def compiled_in_haste() -> Iterator[None]:
    """Without optimisations, where the same arithmetic only takes longer."""
    with haste.compiling(in_haste=True):
        yield


@pytest.fixture(autouse=True, scope="module")
def compiled_as_users_do(request: pytest.FixtureRequest) -> Iterator[None]:
    """Some of the tests are compiled as users compile it, and from the beginning."""
    import jax

    if not set(OPTIMISED) & set(request.path.parts):
        yield
        return
    jax.clear_caches()
    with haste.compiling(in_haste=False):
        yield


@pytest.fixture(autouse=True, scope="module")
def room_for_compiled_code() -> Iterator[None]:
    """Tests compile more than a process can hold."""
    from fitting.compiled_code import make_room

    yield
    make_room()


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
