"""What was done with one file: written before its result, and the proof that it is whole.

The receipt states what the result was made of (the `content_key`) and the hash of the
result to come; then the result is renamed to its name. A result is done if a receipt fits
it. Killed before that renaming the file is undone, killed after it the file is done: there
is nothing in between, and no journal that could disagree.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec

from fitting.batch.writing import replace_file

FOLDER = ".batch"
_VERSION = 1
_SUFFIX = ".json"

Status = Literal["done", "failed", "lost", "wrong command"]


class Receipt(msgspec.Struct, frozen=True):
    """How a file ended.

    - ``source``: the absolute path; ``path``: as the user named it.
    - ``made_of``: the content key; ``data_sha256``: of the file (``""``: unreadable).
    - ``status``: ``done``; ``failed``: the file is to blame, and would fail again;
      ``lost``: worker or storage, another time it may work; ``wrong command``: no file
      would work.
    - ``result_sha256``: of the result's bytes, where there is one.
    - ``read_s``, ``fit_s``, ``write_s``: seconds; writing does not count the receipt.
    """

    name: str
    source: str
    path: str
    made_of: str
    data_sha256: str
    status: Status
    reason: str | None = None
    result_sha256: str = ""
    read_s: float = 0.0
    fit_s: float = 0.0
    write_s: float = 0.0
    version: int = _VERSION


def content_key(recipe: Mapping[str, Any], data_sha256: str) -> str:
    """Names everything that a result depends on: data, options, versions."""
    text = json.dumps({"recipe": recipe, "data": data_sha256}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def file_sha256(path: Path) -> str:
    """The hash of a file's bytes, or ``""`` if they cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def write_receipt(folder: Path, receipt: Receipt) -> None:
    """Write it in one piece into the folder of the results."""
    own = folder / FOLDER
    replace_file(own / f"{receipt.name}{_SUFFIX}", msgspec.json.encode(receipt))


def read_receipt(folder: Path, name: str) -> Receipt | None:
    """The receipt of that name, or None if there is none that can be read."""
    try:
        raw = (folder / FOLDER / f"{name}{_SUFFIX}").read_bytes()
        receipt = msgspec.json.decode(raw, type=Receipt)
    except (OSError, msgspec.MsgspecError):
        return None
    return receipt if receipt.version == _VERSION and receipt.name == name else None


def read_receipts(folder: Path) -> dict[str, Receipt]:
    """All receipts of a folder of results, by name."""
    paths = sorted((folder / FOLDER).glob(f"*{_SUFFIX}"))
    found = (read_receipt(folder, path.name.removesuffix(_SUFFIX)) for path in paths)
    return {receipt.name: receipt for receipt in found if receipt is not None}


def is_settled(receipt: Receipt | None, made_of: str, result: Path) -> bool:
    """Whether nothing is left to do: the result is there and whole, or cannot be had."""
    if receipt is None or receipt.made_of != made_of:
        return False
    if receipt.status == "failed":
        return True
    return receipt.status == "done" and file_sha256(result) == receipt.result_sha256
