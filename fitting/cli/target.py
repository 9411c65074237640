"""Where a fit result is written, looked at before the work and not after it."""

from __future__ import annotations

import os
from pathlib import Path

from fitting.cli.failures import UsageError


def check_target(target: Path) -> None:
    """Can a result be written there? Only another result is ever overwritten.

    Raises `UsageError`.
    """
    from fitting.result import ResultError, load_result

    folder = target.parent
    if not folder.is_dir():
        raise UsageError(f"{target}: the folder {folder} does not exist")
    if target.is_dir():
        raise UsageError(f"{target}: is a folder; give the name of a file")
    if not os.access(folder, os.W_OK):
        raise UsageError(
            f"{target}: the folder {folder.resolve()} cannot be written to; choose another "
            "place with -o"
        )
    if not target.exists():
        return
    try:
        load_result(target)
    except ResultError as error:
        raise UsageError(
            f"{target}: exists and is not a fit result, so it is not overwritten; choose "
            "another name with -o"
        ) from error
