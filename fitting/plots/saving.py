"""Figures to files: one piece, or the pages of one PDF."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from fitting.plots.style import styled

# Without what changes from run to run, equal figures are equal files.
_METADATA = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}


def write(
    figures: Sequence[Figure],
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    dpi: float | None = None,
) -> None:
    """Write one figure, or several as pages of a PDF, beside the target; then rename.

    Raises ``OSError``, and ``ValueError`` for another format, or several figures in one.
    """
    target = Path(path)
    kind = format or target.suffix.lstrip(".").lower()
    if kind not in _METADATA:
        raise ValueError(f"{target}: expected one of {', '.join(_METADATA)}, not {kind!r}")
    if len(figures) != 1 and kind != "pdf":
        raise ValueError(f"{target}: {len(figures)} figures do not fit in one {kind} file")
    handle, beside = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file, styled():
            if len(figures) == 1:
                figures[0].savefig(file, format=kind, dpi=dpi, metadata=_METADATA[kind])
            else:
                with PdfPages(file, metadata=_METADATA["pdf"]) as pages:
                    for figure in figures:
                        pages.savefig(figure, dpi=dpi)
        os.chmod(beside, 0o666 & ~_umask())
        os.replace(beside, target)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
