"""Files that are there as a whole or not at all, also after a loss of power."""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from pathlib import Path

_BESIDE = ".part"


def replace_file(target: Path, data: bytes, *, beside: Path | None = None) -> None:
    """Write data to a new file in ``beside`` (the target's folder), then rename it.

    The data are on the disk before the name is: whoever finds the name finds all of it.
    ``beside`` has to be on the same file system. Raises ``OSError``.
    """
    folder = beside or target.parent
    handle, name = tempfile.mkstemp(dir=folder, prefix=f"{target.name}.", suffix=_BESIDE)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o666 & ~_UMASK)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def remove_parts(folder: Path, *, older_than: float = 0.0) -> None:
    """Remove what writers left that were killed, so many seconds ago or more."""
    for path in folder.glob(f"*{_BESIDE}"):
        with contextlib.suppress(FileNotFoundError):
            if time.time() - path.stat().st_mtime >= older_than:
                path.unlink()


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current


# Once, since to ask for it is to change it, for all threads.
_UMASK = _umask()
