"""HDF5 container (`.h5`, `.nc`): everything that a `Measurement` holds, without loss.

A NetCDF-4 file as well (xarray, h5netcdf). Dimensions `row` (n) and `channel` (c); data
sets, with their unit in the attribute `units`:

| name | shape | content |
|---|---|---|
| `theta_i`, `phi_i`, `theta_r`, `phi_r` | (n,) float64 | angles, `rad` |
| `value` | (n, c) float64 | BSDF without cosine, `sr-1`; NaN where unknown |
| `valid` | (n, c) int8 | 1 or 0 |
| `sigma` | (n, c) float64 | standard uncertainty, `sr-1`; absent if unknown |
| `row` | (n,) int64 | 0 ... n-1, dimension scale |
| `channel` | (c,) text | names, dimension scale |
| `wavelength` | (c,) float64 | `nm`; NaN for a named band |
| `auxiliary_<name>` | (n,) float64 | further columns; `<name>` percent-encoded |

The attribute `measurement_json` of the file holds symmetry, channels, notes and provenance.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from data_formats import metadata
from data_formats.measurement import Measurement, MeasurementError, Provenance
from data_formats.source import MAX_BYTES, Source, load

if TYPE_CHECKING:
    import h5py

NAME = "hdf5"
SUFFIXES = (".h5", ".hdf5", ".nc")

MAGIC = b"\x89HDF\r\n\x1a\n"
# What HDF5 raises on damaged files, whatever is damaged.
ERRORS = (
    OSError,
    KeyError,
    ValueError,
    TypeError,
    RuntimeError,
    MemoryError,
    AttributeError,
)
# deflate does not compress better than this.
_MOST_COMPRESSED = 1100
_PREFIX = "auxiliary_"
_JSON = "measurement_json"


def sniff(head: bytes) -> bool:
    """Whether the file begins as HDF5 does."""
    return head.startswith(MAGIC)


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a container written by `write`.

    **Raises:** `MeasurementError` if the file is damaged or has another layout.
    """
    source = load(path)
    try:
        with open_image(source) as file:
            return _read(file, source)
    except MeasurementError:
        raise
    except ERRORS as error:
        raise damaged(source, error) from error


def damaged(source: Source, error: BaseException) -> MeasurementError:
    """The error to raise for one of `ERRORS`."""
    return MeasurementError(
        f"{source.path}: the HDF5 file is damaged or cut short: {str(error)[:200]}"
    )


def open_image(source: Source) -> h5py.File:
    """The file, from its bytes in memory."""
    # Only where it is needed: every read of any format looks at this module.
    import h5py

    return h5py.File(h5py.h5f.open_file_image(source.data))


def numbers(file: h5py.File, name: str, source: Source) -> NDArray[np.float64]:
    """A data set of numbers, if the file really holds as much as it declares.

    **Raises:** `MeasurementError` if it is absent, elsewhere, not numeric or too large.
    """
    import h5py

    link = file.get(name, getlink=True)
    item = file.get(name) if isinstance(link, h5py.HardLink) else None
    if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
        raise MeasurementError(f"{source.path}: there is no data set {name!r} in the file")
    if item.dtype.kind not in "fiu" or item.shape is None or item.size is None:
        raise MeasurementError(
            f"{source.path}: data set {name!r} is of type {item.dtype}; expected numbers"
        )
    held = min(item.id.get_storage_size(), len(source.data))
    declared = item.size * item.dtype.itemsize
    if item.size * 8 > MAX_BYTES or declared > _MOST_COMPRESSED * held + 4096:
        raise MeasurementError(
            f"{source.path}: data set {name!r} declares the shape {item.shape}, more than "
            f"the {held} bytes of the file can hold"
        )
    return np.asarray(item[()], dtype=np.float64)


def _read(file: h5py.File, source: Source) -> Measurement:
    # Text of fixed length only: HDF5 keeps other text in a heap without checksums, and a
    # damaged heap can send it round in circles.
    if _JSON not in file.attrs or file.attrs.get_id(_JSON).dtype.kind != "S":
        raise MeasurementError(
            f"{source.path}: the HDF5 file was not written by this program (no attribute "
            f"{_JSON}); convert it to a table with named columns"
        )
    description = np.asarray(file.attrs[_JSON]).item().decode("ascii", errors="replace")
    own = metadata.parse(description, source.path)
    names = [str(name) for name in file]
    column = {n: numbers(file, n, source) for n in ("theta_i", "phi_i", "theta_r", "phi_r")}
    valid = numbers(file, "valid", source) == 1
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    provenance = Provenance(path=source.path, sha256=source.sha256, format=NAME)
    return Measurement(
        **column,
        value=numbers(file, "value", source),
        valid=valid,
        channels=tuple(own.channels.values()),
        sigma=numbers(file, "sigma", source) if "sigma" in names else None,
        symmetry=own.symmetry,
        provenance=metadata.kept(provenance, own.provenance),
        notes=own.notes,
        auxiliary={
            unquote(n.removeprefix(_PREFIX)): numbers(file, n, source)
            for n in names
            if n.startswith(_PREFIX)
        },
    )


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write the container; `read` gives back the same measurement, bit for bit."""
    import h5py

    m = measurement
    if os.fspath(path).lower().endswith(".gz"):
        raise MeasurementError("HDF5 files are compressed inside; drop .gz from the name")
    labels = [f"{k}" for k in range(m.n_channels)]
    try:
        # The 1.10 format has checksums, so that damage is seen.
        with h5py.File(path, "w", libver=("v110", "v110")) as file:
            file.attrs["title"] = "Measured BSDF"
            file.attrs[_JSON] = np.bytes_(metadata.dump(m, labels, {}))
            rows = _put(file, "row", np.arange(m.n_rows), "1", "row of the measured file")
            channels = file.create_dataset(
                "channel", data=[c.name for c in m.channels], dtype=h5py.string_dtype()
            )
            rows.make_scale("row")
            channels.make_scale("channel")
            nm = [
                np.nan if c.wavelength_nm is None else c.wavelength_nm for c in m.channels
            ]
            wavelength = _put(file, "wavelength", np.array(nm), "nm", "wavelength")
            wavelength.dims[0].attach_scale(channels)

            tables = [
                ("theta_i", m.theta_i, "rad", "polar angle of the source"),
                ("phi_i", m.phi_i, "rad", "azimuth of the source"),
                ("theta_r", m.theta_r, "rad", "polar angle of the detector"),
                ("phi_r", m.phi_r, "rad", "azimuth of the detector"),
                ("value", m.value, "sr-1", "BSDF without cosine"),
                ("valid", m.valid.astype(np.int8), "1", "1 where the value is usable"),
            ]
            if m.sigma is not None:
                tables.append(("sigma", m.sigma, "sr-1", "standard uncertainty (k = 1)"))
            for name, content in m.auxiliary.items():
                # A name in HDF5 is a path: "/" and "." have a meaning.
                safe = quote(name, safe=" ").replace(".", "%2E")
                tables.append((_PREFIX + safe, content, "", name))
            for name, content, unit, meaning in tables:
                dataset = _put(file, name, content, unit, meaning)
                dataset.dims[0].attach_scale(rows)
                if content.ndim == 2:
                    dataset.dims[1].attach_scale(channels)
    except (ValueError, RuntimeError) as error:
        raise MeasurementError(f"{os.fspath(path)}: cannot be written: {error}") from error


def _put(
    file: h5py.File, name: str, content: np.ndarray, unit: str, meaning: str
) -> h5py.Dataset:
    packing = (
        {"compression": 4, "shuffle": True, "fletcher32": True} if content.size else {}
    )
    dataset = file.create_dataset(name, data=content, **packing)
    if unit:
        dataset.attrs["units"] = unit
    dataset.attrs["long_name"] = meaning
    return dataset
