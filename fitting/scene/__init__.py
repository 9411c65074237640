"""Scenes: what a model must be good enough for.

    from fitting.scene import load_scene
    scene = load_scene("overcast")

`fitting.scene.emitters` has the lights for a renderer, `fitting.scene.photometry` white,
exposure and colours. Names are loaded on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fitting.scene.description import Scene, SceneError
    from fitting.scene.load import load_scene

_HOME = {"Scene": "description", "SceneError": "description", "load_scene": "load"}

__all__ = ["Scene", "SceneError", "load_scene"]


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'fitting.scene' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"fitting.scene.{_HOME[name]}"), name)
    globals()[name] = value
    return value
