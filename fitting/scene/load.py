"""Scenes from presets and files."""

from __future__ import annotations

import difflib
import os
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from fitting.scene.check import checked
from fitting.scene.description import Histogram, Scene, SceneError

PRESETS = ("overcast", "studio", "sun", "daylighting", "stray-light")

_MOST_BYTES = 10_000_000
_HELP = "expected a scene (what may stand in one: brdf scene --fields)"


def load_scene(name_or_path: str | os.PathLike) -> Scene:
    """The preset of that name, or else the scene file at that path.

    Paths in a file are relative to it. Illuminants, observer and tables are looked up, so
    that what is wrong with them is found now; maps are read by those who need them.

    Raises `SceneError` in one sentence: the file, the key, what was found and expected.
    """
    if str(name_or_path) in PRESETS:
        name = str(name_or_path)
        return _scene(preset_text(name), f"preset {name}", name)
    path = Path(name_or_path)
    if not path.is_file():
        raise SceneError(_no_file(name_or_path, path))
    return _scene(_text(path), str(path), path.name.removesuffix(".toml"), path.parent)


def preset_text(name: str) -> str:
    """The file of a preset, with its comments."""
    file = resources.files("fitting.scene") / "presets" / f"{name.replace('-', '_')}.toml"
    return file.read_text(encoding="utf-8")


def _scene(text: str, called: str, name: str, folder: Path | None = None) -> Scene:
    try:
        plain = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SceneError(f"{called}: not TOML, {error}; {_HELP}") from error
    try:
        scene = checked(plain if folder is None else _with_folder(plain, folder))
        if folder is not None:
            _look_up(scene)
    except SceneError as error:
        raise SceneError(f"{called}: {error}") from error
    return scene if scene.name else replace(scene, name=name)


def _look_up(scene: Scene) -> None:
    """What only numbers and colour-science can tell; loaded when there is a scene."""
    from fitting.scene.histogram import pairs
    from fitting.scene.observer import observer_name
    from fitting.scene.spectra import power

    for i, light in enumerate(scene.lights):
        try:
            power(light.spectrum)
        except SceneError as error:
            raise SceneError(f"lights[{i}].spectrum: {error}") from error
    try:
        observer_name(scene.viewer)
    except SceneError as error:
        raise SceneError(f"viewer.observer: {error}") from error
    if isinstance(scene.seen, Histogram):
        pairs(scene.seen)


def _with_folder(plain: Any, folder: Path) -> Any:
    """The same, with each text under a key ``file`` relative to the scene's folder."""
    if isinstance(plain, list):
        return [_with_folder(item, folder) for item in plain]
    if not isinstance(plain, dict):
        return plain
    return {
        key: str(folder / value)
        if key == "file" and isinstance(value, str)
        else _with_folder(value, folder)
        for key, value in plain.items()
    }


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise SceneError(f"{path}: more than {_MOST_BYTES // 10**6} MB; {_HELP}")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not a text file in UTF-8; {_HELP}") from error
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror or error}; {_HELP}") from error


def _no_file(name: str | os.PathLike, path: Path) -> str:
    if path.is_dir():
        return f"{path}: is a folder; {_HELP}"
    near = difflib.get_close_matches(str(name).lower(), PRESETS, n=1)
    hint = f"did you mean {near[0]}?" if near else f"presets: {', '.join(PRESETS)}"
    return f"{name}: neither a file nor a preset; {hint}"
