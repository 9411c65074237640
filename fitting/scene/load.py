"""Scenes from presets and files."""

from __future__ import annotations

import os

from fitting.scene.description import Scene


def load_scene(name_or_path: str | os.PathLike) -> Scene:
    """The preset of that name, or else the scene file at that path.

    Raises `SceneError` in one sentence: the file, the key, what was found and expected.
    """
    raise NotImplementedError
