"""Which files a batch is made of, what is done already, and why the rest is not."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from fitting.batch.names import names
from fitting.batch.receipt import (
    FOLDER,
    Receipt,
    content_key,
    file_sha256,
    is_settled,
    read_receipts,
)
from fitting.batch.writing import remove_parts
from fitting.cli.batch_work import FileItem, FitFile
from fitting.cli.failures import UsageError
from fitting.cli.reading import stem


@dataclass(frozen=True)
class Plan:
    """All files in order, the receipts of those that are settled, why others are redone."""

    items: tuple[FileItem, ...]
    settled: dict[str, Receipt]
    redone: dict[str, str]

    @property
    def todo(self) -> dict[str, FileItem]:
        """What is left, by name."""
        return {i.name: i for i in self.items if i.name not in self.settled}


def expand(patterns: Sequence[str]) -> list[str]:
    """Files by their names or by patterns with ``* ? [] **``, each once, in order.

    Raises `UsageError` for one that matches no file.
    """
    found: dict[str, str] = {}
    for pattern in patterns:
        # A name that exists is meant as it stands, whatever signs are in it.
        exact = os.path.lexists(pattern)
        matches = [pattern] if exact else sorted(glob.glob(pattern, recursive=True))
        files = [m for m in matches if os.path.isfile(m)]
        if not files and os.path.isdir(pattern):
            raise UsageError(
                f"{pattern} is a folder; give files, such as '{pattern}/*.astm'"
            )
        if not files:
            raise UsageError(f"{pattern}: no file matches; expected files of measurements")
        for file in files:
            found.setdefault(os.path.abspath(file), file)
    return list(found.values())


def prepare_folder(folder: Path, *, resume: bool) -> None:
    """Make the folder of the results, or look whether it is there to be resumed.

    Raises `UsageError` where results of an earlier batch would be mixed with others.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: is a file; -o takes a folder")
    try:
        (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"{folder}: cannot be made: {error.strerror}; choose another place with -o"
        ) from error
    if not os.access(folder / FOLDER, os.W_OK | os.X_OK):
        raise UsageError(f"{folder}: cannot be written to; choose another place with -o")
    if not resume and any((folder / FOLDER).iterdir()):
        raise UsageError(
            f"{folder}: holds results of an earlier batch; --resume goes on with it and "
            "redoes what has changed, -o FOLDER begins another"
        )


def plan(paths: Sequence[str], work: FitFile) -> Plan:
    """What is to be done, given what lies in the folder of the results.

    Raises `UsageError` if a result would take the place of a file that is no result.
    """
    remove_parts(work.folder / FOLDER)
    receipts = read_receipts(work.folder)
    sources = [Path(os.path.abspath(p)) for p in paths]
    named = names(sources, stem, receipts)
    items = tuple(map(FileItem, named, sources, paths))
    settled: dict[str, Receipt] = {}
    redone: dict[str, str] = {}
    there = [item for item in items if item.name in receipts]
    with ThreadPoolExecutor() as threads:
        for item, sha256 in zip(
            there, threads.map(lambda i: file_sha256(i.source), there), strict=True
        ):
            receipt, result = receipts[item.name], work.result_path(item)
            if is_settled(receipt, content_key(work.recipe, sha256), result):
                settled[item.name] = receipt
            else:
                redone[item.path] = _why(receipt, sha256, work, result)
    _no_other_file_there(items, receipts, work)
    return Plan(items, settled, redone)


def _why(receipt: Receipt, sha256: str, work: FitFile, result: Path) -> str:
    if receipt.data_sha256 != sha256:
        return "the file has changed"
    if receipt.made_of != content_key(work.recipe, sha256):
        return "options or versions have changed"
    if receipt.status == "done":
        return f"{result.name} is {'not the one written' if result.exists() else 'missing'}"
    return f"it was lost: {receipt.reason}"


def _no_other_file_there(
    items: Sequence[FileItem], receipts: dict[str, Receipt], work: FitFile
) -> None:
    """Results only replace results, and never the file that they are fitted to."""
    from fitting.result import ResultError, load_result

    sources = {item.source for item in items}
    for item in items:
        target = work.result_path(item)
        if item.name in receipts or not target.exists():
            continue
        if target.absolute() in sources:
            raise UsageError(
                f"{target} is one of the files, and its result would be written there; "
                "choose another folder with -o"
            )
        try:
            load_result(target)
        except ResultError as error:
            raise UsageError(
                f"{target}: exists and is not a fit result, so it is not overwritten; "
                "choose another folder with -o"
            ) from error


def forget_empty(folder: Path) -> None:
    """Remove what `prepare_folder` made, if nothing has come into it."""
    for path in (folder / FOLDER, folder):
        try:
            path.rmdir()
        except OSError:
            return
