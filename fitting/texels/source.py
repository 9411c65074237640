"""The file of a spatially varying sample: HDF5, read a chunk at a time.

Data sets of the root, named as in the container of one measurement (`data_formats.hdf5`),
with one or two axes more in front:

| name | shape | content |
|---|---|---|
| `theta_i`, `phi_i`, `theta_r`, `phi_r` | (n,) | angles; with `units`: `rad` or `deg` |
| `value` | (t, n, c) or (h, w, n, c) | BSDF without cosine, 1/sr; NaN where unknown |
| `valid` | as `value` | 0 where a value is not to be used; may be absent |
| `sigma` | as `value` | standard uncertainty, 1/sr, for `chi2`; may be absent |
| `channel` | (c,) text | names; may be absent |
| `wavelength` | (c,) | nm; may be absent |

Any number type will do, and any chunking whose chunks hold whole texels reads quickly.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from data_formats import MeasurementError
from data_formats.hdf5 import ERRORS

ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")
_FACTORS = {"rad": 1.0, "deg": np.pi / 180.0}


@dataclass(frozen=True)
class Source:
    """What is in the file but the values: ``shape`` of these, directions in rad, channels.

    ``has_sigma`` and ``has_valid`` tell which of the two data sets there are.
    """

    path: Path
    shape: tuple[int, ...]
    directions: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    channels: tuple[str, ...]
    wavelengths: np.ndarray | None
    has_sigma: bool
    has_valid: bool

    @property
    def texels(self) -> int:
        """How many there are."""
        return int(np.prod(self.shape[:-2]))

    def read(
        self, first: int, last: int
    ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Values, sigma and valid ``(t, n, c)`` of indices of the first axis.

        Raises `MeasurementError` if the file cannot be read there.
        """
        with _opened(self.path) as file:

            def part(name: str, there: bool) -> np.ndarray | None:
                if not there:
                    return None
                return file[name][first:last].reshape(-1, *self.shape[-2:])  # pyright: ignore

            values = part("value", True)
            assert values is not None
            return values, part("sigma", self.has_sigma), part("valid", self.has_valid)


def open_source(path: Path) -> Source:
    """Look at the file. Raises `MeasurementError` for one of another layout."""
    with _opened(path) as file:
        value = _data_set(file, "value", path)
        if value.ndim not in (3, 4) or 0 in value.shape:
            raise MeasurementError(
                f"{path}: data set 'value' has the shape {value.shape}; expected (t, n, c) "
                "or (h, w, n, c): texels, directions, channels"
            )
        n, c = value.shape[-2:]
        for name in ("sigma", "valid"):
            if name in file and _data_set(file, name, path).shape != value.shape:
                raise MeasurementError(
                    f"{path}: data set {name!r} has the shape {file[name].shape}; "  # pyright: ignore
                    f"expected that of 'value', {value.shape}"
                )
        directions = tuple(_angle(file, name, n, path) for name in ANGLES)
        return Source(
            path=path,
            shape=value.shape,
            directions=directions,  # pyright: ignore[reportArgumentType]
            channels=_channels(file, c, path),
            wavelengths=_wavelengths(file, c, path),
            has_sigma="sigma" in file,
            has_valid="valid" in file,
        )


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    """The file; what HDF5 raises becomes a sentence that names it."""
    if not path.is_file():
        raise MeasurementError(f"{path}: there is no such file")
    try:
        with h5py.File(path, "r") as file:
            yield file
    except MeasurementError:
        raise
    except ERRORS as error:
        raise MeasurementError(
            f"{path}: not an HDF5 file, or damaged: {str(error)[:200]}"
        ) from error


def _data_set(file: h5py.File, name: str, path: Path) -> h5py.Dataset:
    item = file.get(name)
    if not isinstance(item, h5py.Dataset):
        there = ", ".join(map(str, file)) or "nothing"
        raise MeasurementError(
            f"{path}: there is no data set {name!r} in the file, which has {there}; "
            "`brdf texels --help` describes the layout"
        )
    if item.dtype.kind not in "fiub":
        raise MeasurementError(
            f"{path}: data set {name!r} is of type {item.dtype}; expected numbers"
        )
    return item


def _angle(file: h5py.File, name: str, n: int, path: Path) -> np.ndarray:
    item = _data_set(file, name, path)
    unit = item.attrs.get("units", "")
    unit = unit.decode(errors="replace") if isinstance(unit, bytes) else str(unit)
    if item.shape != (n,):
        raise MeasurementError(
            f"{path}: data set {name!r} has the shape {item.shape}; expected ({n},), one "
            "angle per direction of 'value'"
        )
    if unit not in _FACTORS:
        raise MeasurementError(
            f"{path}: data set {name!r} has the attribute units = {unit!r}; expected 'rad' "
            "or 'deg'"
        )
    return np.asarray(item[()], dtype=np.float64) * _FACTORS[unit]


def _channels(file: h5py.File, count: int, path: Path) -> tuple[str, ...]:
    if "channel" not in file:
        return tuple(f"channel {k + 1}" for k in range(count))
    names = np.asarray(file["channel"][()])  # pyright: ignore[reportIndexIssue]
    if names.shape != (count,):
        raise MeasurementError(
            f"{path}: data set 'channel' has the shape {names.shape}; expected ({count},)"
        )
    return tuple(
        v.decode(errors="replace") if isinstance(v, bytes) else str(v) for v in names
    )


def _wavelengths(file: h5py.File, count: int, path: Path) -> np.ndarray | None:
    if "wavelength" not in file:
        return None
    item = _data_set(file, "wavelength", path)
    if item.shape != (count,):
        raise MeasurementError(
            f"{path}: data set 'wavelength' has the shape {item.shape}; expected ({count},)"
        )
    return np.asarray(item[()], dtype=np.float64)
