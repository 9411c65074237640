"""A lobe from a file of the user's own."""

from __future__ import annotations

import importlib.util
import inspect
import sys
import zlib
from pathlib import Path
from types import ModuleType

from fitting.expression import ModelError
from fitting.models.lobe import Lobe

# What running a user's file may raise, short of faults of this program.
_FAULTS = (SyntaxError, ImportError, NameError, AttributeError, TypeError, ValueError)

_loaded: dict[tuple[Path, int], type[Lobe]] = {}


def lobe_of_file(name: str) -> type[Lobe]:
    """The one class of a Python file that is a `Lobe`.

    The same file gives the same class, until it is changed. Raises `ModelError` that says
    what is wrong with the file.
    """
    path = Path(name).expanduser()
    try:
        key = path.resolve(), path.stat().st_mtime_ns
    except OSError as error:
        raise ModelError(f"no file {name!r} with a lobe: {error.strerror}") from error
    if key not in _loaded:
        _loaded[key] = _only_lobe(_module(path.resolve(), name), name)
    return _loaded[key]


def _module(path: Path, name: str) -> ModuleType:
    # Files of one name in several folders are several modules.
    own = f"lobe_file_{path.stem}_{zlib.crc32(str(path).encode()):08x}"
    spec = importlib.util.spec_from_file_location(own, path)
    if spec is None or spec.loader is None:
        raise ModelError(f"{name!r} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    # equinox looks a class's annotations up in its module.
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except _FAULTS as error:
        del sys.modules[spec.name]
        what = f"{type(error).__name__}: {error}"
        raise ModelError(f"{name}: cannot be loaded: {what}") from error
    return module


def _only_lobe(module: ModuleType, name: str) -> type[Lobe]:
    found = [
        c
        for _, c in inspect.getmembers(module, inspect.isclass)
        if issubclass(c, Lobe) and c is not Lobe and c.__module__ == module.__name__
    ]
    if len(found) != 1:
        names = ", ".join(c.__name__ for c in found) or "none"
        raise ModelError(f"{name}: expected one class that is a Lobe, found {names}")
    (lobe,) = found
    missing = [
        n
        for n in ("NAME", "REFERENCE", "RECIPROCAL", "LINEAR", "ALBEDO_BOUND")
        if not hasattr(lobe, n)
    ]
    missing += sorted(getattr(lobe, "__abstractmethods__", ()))
    if missing:
        raise ModelError(f"{name}: {lobe.__name__} does not say {', '.join(missing)}")
    return lobe
