"""What can go wrong for a user: one sentence on stderr and an exit code."""

from __future__ import annotations

import sys
import traceback

GOOD = 0
NOT_CONVERGED = 1
USAGE = 2
UNREADABLE = 3
BUG = 70
INTERRUPTED = 130


class UsageError(ValueError):
    """An option or argument that makes no sense, said in one sentence."""


def report(error: Exception, debug: bool) -> int:
    """Print what went wrong, and return the exit code."""
    code = _exit_code(error)
    text = " ".join(str(error).split())
    if isinstance(error, OSError) and error.strerror:
        name = f"{error.filename}: " if error.filename else ""
        text = f"{name}{error.strerror}"
    if code == BUG:
        text = (
            f"internal error ({type(error).__name__}: {text[:200]}); this is a bug, please "
            "report it with the output of the same command with --debug"
        )
    if debug:
        traceback.print_exception(error)
    print(f"brdf: {text}", file=sys.stderr)
    return code


def _exit_code(error: Exception) -> int:
    # Only classes whose module is loaded can have been raised; importing them here would
    # load numpy to report a misspelt option.
    if isinstance(error, UsageError | _loaded("cyclopts", "CycloptsError")):
        return USAGE
    if isinstance(error, _loaded("fitting.expression", "ModelError")):
        return USAGE
    if isinstance(error, _loaded("data_formats.measurement", "MeasurementError")):
        return UNREADABLE
    if isinstance(error, _loaded("fitting.result", "ResultError")):
        return UNREADABLE
    if isinstance(error, _loaded("fitting.scene.description", "SceneError")):
        return UNREADABLE
    if isinstance(error, OSError):
        return UNREADABLE
    return BUG


class _Never(Exception):
    pass


def _loaded(module: str, name: str) -> type[Exception]:
    return getattr(sys.modules.get(module), name, _Never)
