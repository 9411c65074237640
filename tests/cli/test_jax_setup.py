"""The compiler's cache, and the settings that the program makes."""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path

import jax
import pytest

from fitting import kept_programs
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


@pytest.fixture
def settings(monkeypatch):
    """What is told to JAX and to whom keeps programs, without telling it."""
    told: dict[str, object] = {}
    monkeypatch.setattr(jax.config, "update", told.__setitem__)
    monkeypatch.setattr(kept_programs, "keep_in", lambda f: told.__setitem__("kept", f))
    return told


@pytest.mark.parametrize("writable", [True, False])
def test_a_cache_of_others_is_read(tmp_path, monkeypatch, settings, writable):
    monkeypatch.setenv("BRDF_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(jax_setup, "is_writable", lambda _: writable)
    jax_setup.set_up()
    assert settings["kept"] == tmp_path
    assert settings["jax_compilation_cache_dir"] == str(tmp_path)
    least = settings["jax_persistent_cache_min_compile_time_secs"]
    assert least == 0 if writable else least > 1e6  # type: ignore[operator]


def test_no_cache(tmp_path, monkeypatch, settings):
    for chosen in ("", str(tmp_path / "nowhere")):
        monkeypatch.setenv("BRDF_CACHE_DIR", chosen)
        monkeypatch.setattr(jax_setup, "is_writable", lambda _: False)
        jax_setup.set_up()
        assert settings == {"kept": None}
