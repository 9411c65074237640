"""The export: from a fit to a file of a target, and a report on how close it is."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Any

from data_formats.source import replacing
from fitting.export import registry
from fitting.export.report import Report, report_of
from fitting.export.target import ExportError, Request, Say, Target
from fitting.result import FitResult


def export(
    result: FitResult,
    target: str,
    path: str | os.PathLike[str] | None = None,
    *,
    request: Request | None = None,
    progress: Say | None = None,
    **options: Any,
) -> Report:
    """Write a fit for a target, and say how far what it computes is from the fit.

    ``path`` None writes nothing: the report alone. ``options`` are fields of `Request`,
    for instance ``spectral=True``. A model that the target cannot hold is refitted by the
    target's own, which takes some seconds; ``progress`` is called with what is being done.
    The file is written beside and renamed. Raises `ExportError` for what a target cannot
    hold or an option that it does not have, `ModelError` for an unknown target.
    """
    request = dataclasses.replace(request or Request(), **options)
    module = registry.load(target)
    _check(module, request)
    name = Path(path) if path is not None else Path(f"material{module.SUFFIXES[0]}")
    if path is not None and name.suffix.lower() not in module.SUFFIXES:
        raise ExportError(
            f"{name}: {target} writes {' or '.join(module.SUFFIXES)}; name the file so"
        )
    product = module.make(result, request, name, progress or (lambda _: None))
    report = report_of(target, str(name) if path is not None else None, product)
    if path is not None:
        with replacing(name) as beside:
            product.write(beside, report.lines())
    return report


def _check(module: Target, request: Request) -> None:
    """Refuse options that the target does not heed."""
    empty = Request()
    for field in dataclasses.fields(Request):
        given = getattr(request, field.name) != getattr(empty, field.name)
        if given and field.name not in module.OPTIONS:
            flag = "as" if field.name == "representation" else field.name.replace("_", "-")
            raise ExportError(f"--{flag}: {module.NAME} has no use for it")
    wanted = request.representation
    if wanted is not None and wanted not in module.REPRESENTATIONS:
        known = ", ".join(module.REPRESENTATIONS)
        raise ExportError(f"--as {wanted}: {module.NAME} has {known}")
