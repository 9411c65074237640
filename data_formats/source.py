"""The bytes of a file, unpacked and accounted for, and files written in one piece."""

from __future__ import annotations

import gzip
import hashlib
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from data_formats.measurement import MeasurementError

MAX_BYTES = 2 << 30
HEAD_BYTES = 1 << 16
_GZIP = b"\x1f\x8b"


@dataclass(frozen=True)
class Source:
    """A file that was read.

    **Arguments:**

    - `path`: as the user named it.
    - `data`: its content, after decompression.
    - `sha256`: of the bytes on disk, in hexadecimal.
    """

    path: str
    data: bytes
    sha256: str

    @property
    def head(self) -> bytes:
        """The first 64 kB, for `sniff`."""
        return self.data[:HEAD_BYTES]

    def lines(self) -> list[str]:
        """The content as lines of text, whatever the line ends and the encoding.

        UTF-8 and UTF-16 with a byte order mark, UTF-8 without; anything else is latin-1,
        which old instruments write and which cannot fail.

        **Raises:** `MeasurementError` if the content is not text.
        """
        data = self.data
        try:
            if data.startswith((b"\xff\xfe", b"\xfe\xff")):
                text = data.decode("utf-16")
            else:
                text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
        if "\0" in text:
            raise MeasurementError(
                f"{self.path}: the file has NUL bytes, so it is not a text table; "
                f"it begins with {self.data[:24]!r}"
            )
        return split_lines(text)


def split_lines(text: str) -> list[str]:
    """Lines of a text, whatever the line ends: LF, CR LF or CR."""
    # Not splitlines(): it also breaks at characters that occur inside comments.
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def load(path: str | os.PathLike[str]) -> Source:
    """Read a file, unwrapping gzip.

    **Raises:** `MeasurementError` if the file is missing, unreadable, empty, a Git LFS
    pointer, or larger than 2 GiB, packed or unpacked.
    """
    name = os.fspath(path)
    try:
        if not Path(name).is_file():
            what = "is a folder" if Path(name).is_dir() else "does not exist"
            raise MeasurementError(f"{name}: the file {what}; give the path of a file")
        size = Path(name).stat().st_size
        if size > MAX_BYTES:
            raise MeasurementError(f"{name}: {size} bytes is more than the 2 GiB accepted")
        data = Path(name).read_bytes()
    except MeasurementError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MeasurementError(f"{name}: the file cannot be read: {reason}") from error
    digest = hashlib.sha256(data).hexdigest()
    if data.startswith(_GZIP):
        data = _unpack(name, data)
    if not data.strip(b"\0 \t\r\n"):
        raise MeasurementError(f"{name}: the file is empty; expected a table")
    if data.startswith(b"version https://git-lfs"):
        raise MeasurementError(
            f"{name}: this is a Git LFS pointer, not the data; run `git lfs pull` and retry"
        )
    return Source(name, data, digest)


def _unpack(name: str, data: bytes) -> bytes:
    unpacker = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS)
    parts: list[bytes] = []
    left = MAX_BYTES
    try:
        while data:
            parts.append(unpacker.decompress(data, left + 1))
            left -= len(parts[-1])
            if left < 0:
                raise MeasurementError(f"{name}: unpacks to more than the 2 GiB accepted")
            if not unpacker.eof:
                raise MeasurementError(
                    f"{name}: the gzip stream is cut short; copy the file again"
                )
            data = unpacker.unused_data.lstrip(b"\0")
            unpacker = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS)
    except zlib.error as error:
        raise MeasurementError(f"{name}: the gzip stream is damaged: {error}") from error
    return b"".join(parts)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A name beside `path`; the file written there takes its place if nothing went wrong.

    **Raises:** `MeasurementError` if the file cannot be written.
    """
    target = Path(path)
    # The name's end is kept: `.gz` asks for compression.
    beside = target.with_name(f".{os.getpid()}.{target.name}")
    try:
        try:
            yield beside
            os.replace(beside, target)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        reason = error.strerror or error
        raise MeasurementError(f"{target}: the file cannot be written: {reason}") from error


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write UTF-8 text with LF line ends; compressed if the name ends in `.gz`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file; compressed if the name ends in `.gz`."""
    if os.fspath(path).lower().endswith(".gz"):
        data = gzip.compress(data, mtime=0)
    Path(path).write_bytes(data)
