"""Matrices of real numbers in MATLAB files of versions 4 to 7.

`scipy.io.loadmat` reads more, but crashes the process on some damaged files. Source:
"MAT-file format", The MathWorks. Version 7.3 is HDF5, and not read here.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import MeasurementError
from data_formats.source import MAX_BYTES

Variables = dict[str, NDArray[np.float64]]

_V4_TYPES = ("f8", "f4", "i4", "i2", "u2", "u1")
_V5_TYPES = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_MATRIX, _COMPRESSED = 14, 15
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX = 0x0800
# A matrix's flags, dimensions and name lie in its first bytes.
_PEEK = 1024
_V5_HEADER = 128


class _CutShort(MeasurementError):
    pass


def is_mat(head: bytes) -> bool:
    """Whether a file begins as MATLAB files of versions 4 to 7 do."""
    return head.startswith(b"MATLAB 5.0 MAT-file") or _v4_order(head) is not None


def variables(data: bytes, wanted: Callable[[str], object]) -> Variables:
    """The real, full, numeric matrices whose name is wanted, as float64.

    **Raises:** `MeasurementError` if the file is damaged.
    """
    reader = _version_4 if _v4_order(data) is not None else _version_5
    try:
        return dict(reader(data, wanted))
    except (struct.error, zlib.error) as error:
        raise MeasurementError(f"the MATLAB file is damaged: {error}") from error


def _v4_order(head: bytes) -> str | None:
    """The byte order if the file begins like version 4: five int32, then a name."""
    if len(head) < 24:
        return None
    for order in "<>":
        kind, rows, columns, imaginary, length = struct.unpack(f"{order}5i", head[:20])
        name = head[20 : 20 + min(max(length, 0), 64)]
        in_range = 0 <= kind < 5000 and rows > 0 and columns > 0 and imaginary in (0, 1)
        if in_range and re.fullmatch(rb"[A-Za-z]\w*\0", name):
            return order
    return None


def _version_4(
    data: bytes, wanted: Callable[[str], object]
) -> Iterator[tuple[str, NDArray[np.float64]]]:
    order = _v4_order(data) or "<"
    position = 0
    while position < len(data):
        header = _cut(data, position, 20)
        kind, rows, columns, imaginary, length = struct.unpack(f"{order}5I", header)
        name = _cut(data, position + 20, length).rstrip(b"\0").decode("latin-1")
        precision, matrix_type = kind // 10 % 10, kind % 10
        if precision >= len(_V4_TYPES):
            raise MeasurementError(f"the MATLAB file is damaged: number type {precision}")
        dtype = np.dtype(order + _V4_TYPES[precision])
        size = rows * columns * dtype.itemsize
        start = position + 20 + length
        content = _cut(data, start, size)
        position = start + size * (2 if imaginary else 1)
        if wanted(name) and matrix_type == 0 and not imaginary:
            yield name, _matrix(content, dtype, (rows, columns))


def _version_5(
    data: bytes, wanted: Callable[[str], object]
) -> Iterator[tuple[str, NDArray[np.float64]]]:
    order = ">" if data[126:128] == b"MI" else "<"
    position = _V5_HEADER
    while position + 8 <= len(data):
        kind, size = struct.unpack(f"{order}2I", data[position : position + 8])
        content = _cut(data, position + 8, size)
        position += 8 + size
        if kind == _COMPRESSED:
            content = _inflate(content, order, wanted)
        elif kind != _MATRIX or not _is_wanted(content, order, wanted):
            content = b""
        if content:
            yield _matrix_element(content, order)


def _inflate(packed: bytes, order: str, wanted: Callable[[str], object]) -> bytes:
    """The matrix inside a compressed element; empty if it is not wanted."""
    head = zlib.decompressobj().decompress(packed, _PEEK)
    kind, size = struct.unpack(f"{order}2I", _cut(head, 0, 8))
    if kind != _MATRIX or not _is_wanted(head[8:], order, wanted):
        return b""
    if size > MAX_BYTES:
        raise MeasurementError(f"a MATLAB variable unpacks to {size} bytes; 2 GiB at most")
    # Reads on to what the stream holds, not to what the tag says.
    return _cut(zlib.decompressobj().decompress(packed, size + 8), 8, size)


def _is_wanted(content: bytes, order: str, wanted: Callable[[str], object]) -> bool:
    """Whether it is a real, full, numeric matrix with a wanted name."""
    try:
        flags, _, name, _ = _matrix_head(content, order)
    except _CutShort:
        return False
    return (
        (flags & 0xFF) in _NUMERIC_CLASSES and not flags & _COMPLEX and bool(wanted(name))
    )


def _matrix_head(content: bytes, order: str) -> tuple[int, tuple[int, ...], str, int]:
    """Flags, dimensions, name, and where the numbers begin."""
    _, flags, position = _element(content, 0, order)
    _, dimensions, position = _element(content, position, order)
    _, name, position = _element(content, position, order)
    (flag,) = struct.unpack(f"{order}I", _cut(flags, 0, 4))
    shape = struct.unpack(f"{order}{len(dimensions) // 4}I", dimensions)
    return flag, shape, name.decode("latin-1"), position


def _matrix_element(content: bytes, order: str) -> tuple[str, NDArray[np.float64]]:
    _, shape, name, position = _matrix_head(content, order)
    kind, numbers, _ = _element(content, position, order)
    if kind not in _V5_TYPES:
        raise MeasurementError(f"the MATLAB file is damaged: number type {kind} in {name}")
    dtype = np.dtype(order + _V5_TYPES[kind])
    return name, _matrix(numbers, dtype, shape)


def _element(content: bytes, position: int, order: str) -> tuple[int, bytes, int]:
    """Type and bytes of a data element, and where the next one begins."""
    kind, size = struct.unpack(f"{order}2I", _cut(content, position, 8))
    if kind >> 16:  # the short form: type and size in one word, then four bytes
        kind, size = kind & 0xFFFF, kind >> 16
        return kind, _cut(content, position + 4, min(size, 4)), position + 8
    return kind, _cut(content, position + 8, size), position + 8 + (size + 7) // 8 * 8


def _matrix(content: bytes, dtype: np.dtype, shape: tuple[int, ...]) -> NDArray[np.float64]:
    if len(shape) != 2 or shape[0] * shape[1] * dtype.itemsize != len(content):
        raise MeasurementError(
            f"the MATLAB file is damaged: a matrix of the shape {shape} has "
            f"{len(content)} bytes of type {dtype}"
        )
    return np.frombuffer(content, dtype).reshape(shape, order="F").astype(np.float64)


def _cut(data: bytes, start: int, size: int) -> bytes:
    """`size` bytes from `start`, all of them."""
    content = data[start : start + size]
    if len(content) < size:
        raise _CutShort("the MATLAB file is damaged or cut short")
    return content
