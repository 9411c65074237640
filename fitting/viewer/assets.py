"""The files of the page: styles, shaders, and modules put together as one script."""

from __future__ import annotations

import functools
import re
from importlib import resources

# In the order in which they need each other; the last one starts the page.
MODULES = (
    "numbers", "directions", "palette", "gl", "model", "fit", "view", "plot", "sphere",
    "lobe", "slice", "image", "albedo", "sliders", "controls", "card", "main",
)  # fmt: skip
SHADERS = (
    "functions", "model", "value", "prepare", "points", "screen", "sphere", "lobe_vertex",
    "lobe_fragment",
)  # fmt: skip

_IMPORT = re.compile(r"^import (\{[^}]*\}) from \"\./(\w+)\.js\";", re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:class|const|function) (\w+))", re.MULTILINE)


@functools.cache
def text(name: str) -> str:
    """A file by its name."""
    return (resources.files("fitting.viewer") / "assets" / name).read_text("utf-8")


def script(modules: tuple[str, ...] = MODULES) -> str:
    """ES modules as one: a page that opens from a disk may not import others.

    Each becomes a function that is called once and returns what the module exports.
    """
    return "\n".join(_as_function(name) for name in modules)


def shaders() -> dict[str, str]:
    """The texts in GLSL that all models share, by name."""
    return {name: text(f"{name}.glsl") for name in SHADERS}


def _as_function(name: str) -> str:
    body = text(f"{name}.js")
    exported = ", ".join(found[1] for found in _EXPORT.findall(body))
    body = _EXPORT.sub(r"\1", _IMPORT.sub(r"const \1 = module_\2;", body))
    return f"const module_{name} = (() => {{\n{body}return {{ {exported} }};\n}})();"
