"""The container `tensor_file`: named arrays, of the RGL and the KAIST databases.

`tensor_file\\0`, version (2 bytes), the number of fields (uint32), then for each field the
length of its name (uint16), the name, the number of dimensions (uint16), the type (uint8),
where its numbers begin (uint64) and its shape (uint64 each); little endian, C order.
Source: `powitacq.h` of the RGL BRDF loader.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import MeasurementError
from data_formats.provenance import one_line
from data_formats.source import Source

MAGIC = b"tensor_file\0"

_TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8")
_START = len(MAGIC) + 2
_MOST_FIELDS, _MOST_DIMENSIONS = 1000, 16


@dataclass(frozen=True)
class Field:
    """Where an array lies.

    **Arguments:**

    - `dtype`: of its numbers.
    - `shape`: its shape.
    - `offset`: of its first byte in the file.
    """

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    offset: int


def fields(data: bytes) -> dict[str, Field]:
    """The table of fields; whether their numbers are in the file is not looked at.

    **Raises:** `MeasurementError` if the table is damaged or cut short.
    """
    found: dict[str, Field] = {}
    position = _START
    try:
        (count,) = struct.unpack_from("<I", data, position)
        position += 4
        if not data.startswith(MAGIC) or count > _MOST_FIELDS:
            raise MeasurementError(
                f"the tensor_file declares {count} fields; is it damaged?"
            )
        for _ in range(count):
            (length,) = struct.unpack_from("<H", data, position)
            name = data[position + 2 : position + 2 + length].decode("latin-1")
            position += 2 + length
            dimensions, kind, offset = struct.unpack_from("<HBQ", data, position)
            position += 11
            if not 1 <= kind <= len(_TYPES) or dimensions > _MOST_DIMENSIONS:
                raise MeasurementError(
                    f"field {name[:40]!r} of the tensor_file has type {kind} and "
                    f"{dimensions} dimensions; is the file damaged?"
                )
            shape = struct.unpack_from(f"<{dimensions}Q", data, position)
            position += 8 * dimensions
            found[name] = Field(np.dtype("<" + _TYPES[kind - 1]), shape, offset)
    except struct.error as error:
        raise MeasurementError(
            "the table of fields of the tensor_file is cut short"
        ) from error
    return found


def array(source: Source, table: Mapping[str, Field], name: str) -> NDArray[Any]:
    """The numbers of a field, as a view of the file's bytes.

    **Raises:** `MeasurementError` if the field is absent, or reaches beyond the file.
    """
    if name not in table:
        listed = one_line(", ".join(sorted(table))[:200]) or "none"
        raise MeasurementError(
            f"{source.path}: there is no field {name!r} in the file; found {listed}"
        )
    field = table[name]
    size = math.prod(field.shape)
    end = field.offset + size * field.dtype.itemsize
    if end > len(source.data) or max(field.shape, default=0) > len(source.data):
        raise MeasurementError(
            f"{source.path}: field {name!r} of the shape {field.shape} ends at byte {end}, "
            f"but the file has {len(source.data)}; is it cut short?"
        )
    if not size:
        return np.empty(field.shape, field.dtype)
    numbers = np.frombuffer(source.data, field.dtype, size, field.offset)
    return numbers.reshape(field.shape)


def nodes(source: Source, table: Mapping[str, Field], name: str, size: int) -> NDArray[Any]:
    """(size,) increasing finite float64 numbers: the nodes of an axis.

    **Raises:** `MeasurementError` if the field holds something else.
    """
    numbers = array(source, table, name)
    if numbers.size != size:
        raise MeasurementError(
            f"{source.path}: field {name!r} has the shape {numbers.shape}; expected the "
            f"{size} nodes of an axis, without which the directions are unknown; look for "
            "a complete copy"
        )
    numbers = numbers.ravel().astype(np.float64)
    if not (np.isfinite(numbers).all() and (np.diff(numbers) > 0).all()):
        raise MeasurementError(
            f"{source.path}: the numbers of field {name!r} do not increase; is it damaged?"
        )
    return numbers
