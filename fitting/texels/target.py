"""The file of fitted texels: parts, written whole, and one HDF5 file made of them.

| name | shape | content |
|---|---|---|
| `parameters/<name>` | (t,) or (t, c) | shape parameters; coefficients, one per channel |
| `uncertainties/<name>` | the same | standard uncertainty (k = 1); NaN: fixed or bounded |
| `cost` | (t,) | the sum of squares that was made small |
| `converged` | (t,) | 1 or 0 |
| `steps`, `used` | (t,) | steps of the solver; number of values used |
| `runner_up` | (t,) | cost of another minimum over this one's; NaN if none came near |
| `channel`, `wavelength` | (c,) | names; nm, if known |

with (h, w) instead of (t) where the data have it. Attributes: `model`, `objective`,
`settings_json`, `versions_json`, `source`, `unseen_json`: sentences on parameters that are
held because no direction sees them; and `units` of every parameter.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fitting.batch import replace_file
from fitting.model import Model
from fitting.texels.source import Source

TITLE = "Fitted texels"
_PART = "{:08d}.npz"
_BESIDE = ".part"
_CHUNK = 4096


def part_path(folder: Path, first: int) -> Path:
    """Where the part goes that begins with an index of the first axis."""
    return folder / _PART.format(first)


def write_part(folder: Path, first: int, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a part, which is there as a whole or not at all."""
    held = io.BytesIO()
    np.savez(held, **arrays)  # pyright: ignore[reportArgumentType]
    replace_file(part_path(folder, first), held.getvalue())


def flat(
    parameters: Mapping[str, np.ndarray],
    uncertainties: Mapping[str, np.ndarray],
    others: Mapping[str, np.ndarray],
) -> dict[str, np.ndarray]:
    """The arrays of a part under the names of their data sets."""
    out = {f"parameters/{k}": v for k, v in parameters.items()}
    out |= {f"uncertainties/{k}": v for k, v in uncertainties.items()}
    return out | {
        k: v.astype(np.uint8) if v.dtype == bool else v for k, v in others.items()
    }


def merge(
    folder: Path,
    firsts: Iterable[int],
    target: Path,
    source: Source,
    model: Model,
    attributes: Mapping[str, Any],
) -> int:
    """Make the file of the parts, one in memory at a time; gives how many converged."""
    leading = source.shape[:-2]
    beside = target.with_name(target.name + _BESIDE)
    converged = 0
    try:
        with h5py.File(beside, "w", libver=("v110", "v110")) as file:
            file.attrs["title"] = TITLE
            for name, value in attributes.items():
                text = (
                    value if isinstance(value, str) else json.dumps(value, sort_keys=True)
                )
                file.attrs[name] = text
            file.create_dataset(
                "channel", data=list(source.channels), dtype=h5py.string_dtype()
            )
            if source.wavelengths is not None:
                file["wavelength"] = source.wavelengths
                file["wavelength"].attrs["units"] = "nm"
            for first in firsts:
                with np.load(part_path(folder, first)) as part:
                    for name in part.files:
                        _put(file, name, part[name], first, leading, model)
                    converged += int(part["converged"].sum())
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(beside, target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return converged


def _put(
    file: h5py.File,
    name: str,
    values: np.ndarray,
    first: int,
    leading: tuple[int, ...],
    model: Model,
) -> None:
    more = values.shape[1:]
    if name not in file:
        lines = max(1, _CHUNK // max(1, int(np.prod(leading[1:]))))
        chunk = (min(lines, leading[0]), *leading[1:], *more)
        made = file.create_dataset(
            name, (*leading, *more), values.dtype, chunks=chunk,
            compression=4, shuffle=True, fletcher32=True,
        )  # fmt: skip
        _, _, parameter = name.partition("/")
        if parameter:
            made.attrs["units"] = model.parameters()[parameter].unit
            made.attrs["long_name"] = model.parameters()[parameter].meaning
    block = values.reshape(-1, *leading[1:], *more)
    file[name][first : first + block.shape[0]] = block  # pyright: ignore[reportIndexIssue]


def is_target(path: Path) -> bool:
    """Whether this is a file that `merge` made."""
    try:
        with h5py.File(path, "r") as file:
            return file.attrs.get("title") == TITLE
    except (OSError, KeyError, RuntimeError):
        return False
