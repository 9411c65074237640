"""What the results of a batch are made of, besides the data: options, files, versions."""

from __future__ import annotations

import functools
import platform
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fitting.batch.receipt import file_sha256
from fitting.cli.fit_settings import Job

_LOBE_FILE = re.compile(r"[^()+*]*\.py")
_PACKAGES = ("brdf-fitting", "jax", "jaxlib", "optimistix", "equinox", "numpy", "scipy")


def recipe(job: Job) -> dict[str, Any]:
    """All that a result depends on but the data, as JSON can hold it."""
    return {
        "models": list(job.models),
        "options": job.options,
        "cross_validate": job.cross_validate,
        "colour": job.colour,
        "format": job.format,
        "reader": job.reader,
        "files": {str(path): file_sha256(path.expanduser()) for path in own_files(job)},
        "versions": versions(),
    }


@functools.cache
def versions() -> dict[str, str]:
    """Of this package and of those that compute."""
    return {"python": platform.python_version()} | {p: version(p) for p in _PACKAGES}


def own_files(job: Job) -> list[Path]:
    """Files that options name: lobes of the user's own, and tables of materials."""
    lobes = [part.strip() for m in job.models for part in _LOBE_FILE.findall(m)]
    media = [
        part.strip()
        for material in job.options.get("material", {}).values()
        for part in material.split(" in ")
    ]
    tables = [part for part in media if Path(part).expanduser().is_file()]
    return [Path(name) for name in dict.fromkeys((*lobes, *tables))]
