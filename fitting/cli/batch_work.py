"""What is done with one file of a batch: what `brdf fit` does, written in one piece."""

from __future__ import annotations

import hashlib
import json
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from fitting.batch.receipt import (
    FOLDER,
    Receipt,
    Status,
    content_key,
    file_sha256,
    is_settled,
    read_receipt,
    write_receipt,
)
from fitting.batch.turns import first_of
from fitting.batch.writing import replace_file
from fitting.cli.batch_recipe import versions
from fitting.cli.failures import UsageError
from fitting.cli.fit_settings import Job
from fitting.cli.flags import Flags

if TYPE_CHECKING:
    from data_formats import Measurement

RESULT_NAME = "{name}.fit.json"


@dataclass(frozen=True)
class FileItem:
    """A file to fit: its result's name, its absolute path, and the path as it was given."""

    name: str
    source: Path
    path: str


@dataclass(frozen=True)
class FitFile:
    """Fits a file and writes ``NAME.fit.json`` into a folder; `recipe` is what it rests on.

    Gives back the `Receipt`. A result that is there already, whole and of the same content,
    is left alone: engines may ask twice.
    """

    job: Job
    folder: Path
    recipe: dict[str, Any]

    def __call__(self, item: FileItem) -> Receipt:
        """Raises ``OSError`` where data or results cannot be reached."""
        self._same_versions()
        sha256 = file_sha256(item.source)
        made_of = content_key(self.recipe, sha256) if sha256 else ""
        there, result = read_receipt(self.folder, item.name), self.result_path(item)
        if there is not None and is_settled(there, made_of, result):
            return there
        receipt = Receipt(item.name, str(item.source), item.path, made_of, sha256, "done")
        if reason := self._wrong_command():
            return msgspec.structs.replace(receipt, status="wrong command", reason=reason)
        begin = time.perf_counter()
        measurement, reason = _tried(lambda: self._read(item, sha256), item)
        if measurement is None:
            return self.give_up(receipt, "failed" if sha256 else "lost", reason)
        read = time.perf_counter()
        text, reason = _tried(lambda: self._fitted(measurement), item)
        fitted = time.perf_counter()
        receipt = msgspec.structs.replace(receipt, read_s=read - begin, fit_s=fitted - read)
        if text is None:
            return self.give_up(receipt, "failed", reason)
        written = self._write(receipt, result, text)
        return msgspec.structs.replace(written, write_s=time.perf_counter() - fitted)

    def result_path(self, item: FileItem) -> Path:
        """Where the result of a file goes."""
        return self.folder / RESULT_NAME.format(name=item.name)

    def give_up(self, receipt: Receipt, status: Status, reason: str | None) -> Receipt:
        """Write down why there is no result; one that an earlier run made goes."""
        path = self.folder / RESULT_NAME.format(name=receipt.name)
        path.unlink(missing_ok=True)
        receipt = msgspec.structs.replace(receipt, status=status, reason=reason)
        write_receipt(self.folder, receipt)
        return receipt

    def _write(self, receipt: Receipt, result: Path, text: str) -> Receipt:
        data = text.encode("utf-8")
        digest = hashlib.sha256(data).hexdigest()
        receipt = msgspec.structs.replace(receipt, result_sha256=digest)
        write_receipt(self.folder, receipt)
        replace_file(result, data, beside=self.folder / FOLDER)
        return receipt

    def _read(self, item: FileItem, sha256: str) -> Measurement:
        from fitting.cli.reading import read_file

        measurement = read_file(item.source, self.job.format, self.job.reader)
        if file_sha256(item.source) != sha256:
            raise OSError(f"{item.path} changes while it is read")
        provenance = measurement.provenance
        if provenance.path != str(item.source):
            return measurement
        return replace(measurement, provenance=replace(provenance, path=item.path))

    def _fitted(self, measurement: Measurement) -> str:
        from fitting.cli import fit_run, jax_setup
        from fitting.padding import bucket

        size = [bucket(measurement.n_rows), measurement.n_channels]
        what = json.dumps([self.recipe, size], sort_keys=True, default=str)
        with first_of(what, jax_setup.writable_cache()):
            done = fit_run.run(measurement, self.job, Flags(quiet=True))
            return done.kept.to_json() + "\n"

    def _wrong_command(self) -> str | None:
        """Why no file at all could be fitted like this."""
        from fitting.cli import jax_setup

        jax_setup.set_up()
        import data_formats
        from fitting.by_name import own_settings, unused, unused_words
        from fitting.expression import ModelError
        from fitting.model import Model
        from fitting.options import FitOptions

        known = [f.name for f in data_formats.formats()]
        if self.job.format not in (None, *known):
            return (
                f"--format {self.job.format}: there is no such format; known: "
                + ", ".join(known)
            )
        try:
            models = [Model(m) for m in self.job.models]
            for model in models:
                FitOptions(**own_settings(model, self.job.options))
        except ModelError as error:
            return str(error)
        nobody = unused(models, self.job.options) if models else None
        return None if nobody is None else unused_words(models, *nobody)

    def _same_versions(self) -> None:
        own, wanted = versions(), self.recipe["versions"]
        for name in wanted:
            if own.get(name) != wanted[name]:
                raise OSError(
                    f"the worker on {socket.gethostname()} has {name} {own.get(name)}, the "
                    f"command {wanted[name]}: results would not be the same"
                )


def _tried(step: Callable[[], Any], item: FileItem) -> tuple[Any, str | None]:
    """What a step gives, or the sentence that it raises; the file has the user's name."""
    from data_formats import MeasurementError
    from fitting.expression import ModelError
    from fitting.result import ResultError

    try:
        return step(), None
    except (MeasurementError, ModelError, ResultError, UsageError) as error:
        text = " ".join(str(error).split()).replace(str(item.source), item.path)
        return None, text.removeprefix(f"{item.path}: ")
