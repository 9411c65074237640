"""The compiler's cache, and the settings that the program makes."""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from fitting.cli import jax_setup


@pytest.fixture(autouse=True)
def _nothing_chosen(monkeypatch):
    for name in ("BRDF_CACHE_DIR", "JAX_COMPILATION_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)


def test_cache_folder(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert jax_setup.cache_folder() == tmp_path / "brdf-fitting" / version("jax")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert jax_setup.cache_folder() == (
        Path.home() / ".cache" / "brdf-fitting" / version("jax")
    )
    monkeypatch.setattr(sys, "platform", "darwin")
    assert "Library" in jax_setup.cache_folder().parts  # type: ignore[union-attr]
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    assert jax_setup.cache_folder() == tmp_path / "brdf-fitting" / version("jax")
    monkeypatch.setenv("BRDF_CACHE_DIR", str(tmp_path / "x"))
    assert jax_setup.cache_folder() == tmp_path / "x"
    monkeypatch.setenv("BRDF_CACHE_DIR", "")
    assert jax_setup.cache_folder() is None


def test_unwritable(tmp_path):
    (tmp_path / "file").write_text("")
    assert jax_setup.is_writable(tmp_path / "new" / "folder")
    assert not jax_setup.is_writable(tmp_path / "file" / "folder")
