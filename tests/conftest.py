"""Fixtures shared by all tests: where the measured files of others lie, if they do."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


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
