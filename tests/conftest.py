"""What all tests share: compiled code, a browser, and where measured files lie."""

from __future__ import annotations

import gc
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import haste
import pytest

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "chrome")
ARGUMENTS = (
    "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--no-first-run",
)  # fmt: skip
# Where it is the rounding and the speed of the compiled code that is tested.
OPTIMISED = ("test_combined_options.py", "test_precision.py", "benchmarks")


def pytest_configure(config: pytest.Config) -> None:
    """Compiled code is kept for the other workers and later runs: most of the time of these
    tests is the compiler's."""
    import jax

    for name, value in haste.kept_in(config.rootpath).items():
        jax.config.update(name, value)
    # Commands in this process keep nothing: what is compiled in haste is not the user's.
    os.environ["BRDF_CACHE_DIR"] = ""


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


@pytest.fixture
def compiled_to_run_long() -> Iterator[None]:
    """As users compile it, for a test that runs much longer than the compiler."""
    with haste.compiling(in_haste=False):
        yield


@pytest.fixture(autouse=True, scope="module")
def room_for_compiled_code() -> Iterator[None]:
    """Tests compile more than a process can hold."""
    from fitting.compiled import make_room

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


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A headless Chromium: of ``BRDF_CHROMIUM``, or the first that is found.

    For a module, not a session: while it is open no other event loop can run.
    """
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    found = os.environ.get("BRDF_CHROMIUM") or next(
        filter(None, map(shutil.which, CHROMIUM)), None
    )
    if found is None:
        pytest.skip(f"needs Chromium: BRDF_CHROMIUM, or one of {', '.join(CHROMIUM)}")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=found, args=list(ARGUMENTS))
        yield chromium
        chromium.close()
