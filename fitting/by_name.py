"""What is said of parameters by name, of which each of several models takes its own."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping
from typing import Any

from fitting.model import Model

BY_NAME = ("fix", "bounds", "tie")


def own_settings(model: Model, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The settings (fields of `FitOptions`) without what only other models have."""
    own = dict(settings)
    for key in BY_NAME:
        if key in own:
            own[key] = {p: v for p, v in own[key].items() if _matches(model, p)}
    return own


def unused(models: Iterable[Model], settings: Mapping[str, Any]) -> tuple[str, str] | None:
    """The first setting, with its pattern, that no model has a parameter for."""
    models = list(models)
    for key in BY_NAME:
        for pattern in settings.get(key, {}):
            if not any(_matches(m, pattern) for m in models):
                return key, pattern
    return None


def unused_words(models: Iterable[Model], key: str, pattern: str) -> str:
    """A sentence on it, with the names that there are."""
    has = "; ".join(f"{m.expression}: {', '.join(m.parameters())}" for m in models)
    return f"--{key} {pattern}: there is no such parameter; {has}"


def _matches(model: Model, pattern: str) -> bool:
    return any(fnmatch.fnmatch(name, pattern) for name in model.parameters())
