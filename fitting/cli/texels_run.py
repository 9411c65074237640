"""Running the chunks of a file of texels to their end, and making the file of them."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting.cli import assignments, failures, terminal
from fitting.cli.batch_recipe import versions
from fitting.cli.failures import UsageError
from fitting.cli.fit_settings import noise_of
from fitting.cli.texels_work import RECIPE, Chunk, FitTexels
from fitting.cli.work import Work

if TYPE_CHECKING:
    from fitting.batch import Engine
    from fitting.cli.texels import TexelChoices, TexelWork
    from fitting.model import Model
    from fitting.texels.source import Source

_RETRIES = 2
_MOST_WORKERS = 4096
_SAY_EVERY_S = 10.0


@dataclass(frozen=True)
class TexelJob:
    """What is to be done: the file, the model, where parts and result go, and the rest."""

    source: Source
    model: Model
    target: Path
    work: FitTexels
    chunks: tuple[Chunk, ...]
    attributes: Mapping[str, Any]


@dataclass(frozen=True)
class Fitted:
    """How it ended. ``stopped`` says what ended it before its time."""

    converged: int
    new: int
    seconds: float
    stopped: str | None = None
    code: int = failures.GOOD

    def sentence(self, job: TexelJob) -> str:
        """For people."""
        total = job.source.texels
        rate = f", {self.new / self.seconds:,.0f} a second" if self.new else ""
        return (
            f"{total:,} texels, {self.converged:,} converged ({self.seconds:.1f} s{rate}); "
            f"written to {job.target}"
        )

    def as_record(self, job: TexelJob) -> dict[str, Any]:
        """For programs."""
        return {
            "texels": job.source.texels,
            "converged": self.converged,
            "fitted_now": self.new,
            "seconds": self.seconds,
            "output": None if self.stopped else str(job.target),
            "stopped": self.stopped,
        }


def settle(file: Path, choices: TexelChoices, who: TexelWork) -> TexelJob:
    """Look at file, options and places before any work.

    Raises `UsageError`, `ModelError` or `MeasurementError`.
    """
    if not 1 <= who.workers <= _MOST_WORKERS:
        raise UsageError(f"--workers {who.workers}: expected a number from 1 on")
    if not 0 < choices.max_theta <= 90:
        raise UsageError(f"--max-theta {choices.max_theta:g}: expected 0 to 90 degrees")
    if not (math.isfinite(choices.energy) and choices.energy >= 0):
        raise UsageError(f"--energy {choices.energy:g}: expected a number from 0 on")
    from fitting.texels.source import open_source

    source = open_source(file)
    target = who.output or Path(f"{file.stem}.texels.h5")
    _check_target(target, file)
    settings: dict[str, Any] = {
        "objective": choices.objective,
        "weights": choices.weights,
        "max_theta_deg": choices.max_theta,
        "robust": choices.robust,
        "noise": None if choices.noise is None else noise_of(choices.noise),
        "energy": choices.energy,
        "reciprocity": choices.reciprocity,
        "per_channel_shape": choices.per_channel_shape,
    }
    for key in ("fix", "bounds", "tie"):
        found = assignments.of_lines(key, getattr(choices, key) or [])
        settings[key] = {k: getattr(v, "tolist", lambda v=v: v)() for k, v in found.items()}
    if choices.objective == "chi2" and not source.has_sigma and choices.noise is None:
        raise UsageError(
            f"--objective chi2: {file} has no data set 'sigma'; give --noise A,B"
        )

    from fitting.cli import jax_setup

    jax_setup.set_up()
    import jax

    from fitting.model import Model
    from fitting.texels.fits import lines_per_chunk, plan_of

    model = Model(choices.model)
    with jax.enable_x64(True):
        plan = plan_of(source, model, settings)
    lines = lines_per_chunk(source.shape)
    state = file.stat()
    recipe = {
        "file": str(file.resolve()),
        "size": state.st_size,
        "changed": state.st_mtime_ns,
        "model": choices.model,
        "settings": settings,
        "lines": lines,
        "versions": versions(),
    }
    folder = target.with_name(target.name + ".parts").absolute()
    return TexelJob(
        source=source,
        model=model,
        target=target,
        work=FitTexels(file.absolute(), folder, json.dumps(recipe, sort_keys=True)),
        chunks=tuple(
            Chunk(first, min(first + lines, source.shape[0]))
            for first in range(0, source.shape[0], lines)
        ),
        attributes={
            "model": model.expression,
            "objective": plan.options.objective,
            "unseen_json": plan.unseen,
            "settings_json": settings,
            "versions_json": versions(),
            "source": str(file),
        },
    )


def run(job: TexelJob, who: TexelWork, *, quiet: bool) -> Fitted:
    """Fit what is left and make the file; interrupted, keep what was done.

    Raises `UsageError` if parts of another run are there and may not be used.
    """
    from fitting.batch import ClusterError
    from fitting.texels.target import merge, part_path

    _prepare(job, resume=who.resume)
    folder, begin = job.work.folder, time.perf_counter()
    todo = {str(c.first): c for c in job.chunks if not part_path(folder, c.first).exists()}
    new, reason, code = 0, None, failures.NOT_CONVERGED
    progress = _Progress(job, todo, quiet=quiet)
    for sentence in job.attributes["unseen_json"]:
        if not quiet:
            terminal.stderr().print(sentence, style="dim", soft_wrap=True)
    engine = _engine(who, len(todo), progress)
    try:
        with progress, closing(engine.run(job.work, todo, retries=_RETRIES)) as answers:
            for done in answers:
                if done.reason is not None:
                    reason = reason or f"texels from {done.key} on: {done.reason}"
                    continue
                new += done.value[0]
                progress.more(done.value[0])
    except KeyboardInterrupt:
        reason, code = "interrupted", failures.INTERRUPTED
    except ClusterError as error:
        if not new:
            raise UsageError(str(error)) from error
        reason = str(error)
    seconds = time.perf_counter() - begin
    if reason is not None:
        return Fitted(0, new, seconds, reason, code)
    firsts = [c.first for c in job.chunks]
    converged = merge(folder, firsts, job.target, job.source, job.model, job.attributes)
    _remove(folder)
    return Fitted(converged, new, time.perf_counter() - begin)


class _Progress(Work):
    """Texels done, with the time that remains."""

    def __init__(self, job: TexelJob, todo: Mapping[str, Chunk], *, quiet: bool):
        each = job.source.texels // job.source.shape[0]
        self._todo = sum(c.last - c.first for c in todo.values()) * each
        super().__init__(terminal.stderr(), self._todo, quiet=quiet)
        self._fitted = 0
        self._begin = self._said = time.monotonic()
        self.at(f"{self._todo:,} texels to fit", 0, 0)

    def more(self, count: int) -> None:
        """So many are done."""
        self._fitted += count
        now = time.monotonic()
        what = self._subject
        if self._progress is not None:
            what = f"{self._fitted:,} of {self._todo:,} texels"
        elif now - self._said >= _SAY_EVERY_S:
            self._said = now
            left = (now - self._begin) / self._fitted * (self._todo - self._fitted)
            what = f"{self._fitted:,} of {self._todo:,} texels, about {left:.0f} s left"
        self.at(what, 0, count)

    def say(self, text: str) -> None:
        """A line for the user."""
        self.at(text, 0, 0)


def _engine(who: TexelWork, todo: int, progress: _Progress) -> Engine:
    from fitting.batch import Cluster, Processes, Serial

    if who.scheduler is not None:
        return Cluster(who.scheduler, who.workers, progress.say)
    workers = min(who.workers, max(todo, 1))
    return Processes(workers) if workers > 1 else Serial()


def _check_target(target: Path, file: Path) -> None:
    from fitting.texels.target import is_target

    folder = target.parent
    if not folder.is_dir():
        raise UsageError(f"{target}: the folder {folder} does not exist")
    if target.is_dir():
        raise UsageError(f"{target}: is a folder; give the name of a file")
    if not os.access(folder, os.W_OK):
        raise UsageError(f"{target}: the folder {folder.resolve()} cannot be written to")
    if target.exists() and target.samefile(file):
        raise UsageError(f"{target}: is the file of the data; choose another name with -o")
    if target.exists() and not is_target(target):
        raise UsageError(
            f"{target}: exists and is no file of fitted texels, so it is not overwritten; "
            "choose another name with -o"
        )


def _prepare(job: TexelJob, *, resume: bool) -> None:
    """Make the folder of the parts, or look whether those in it may be gone on with."""
    from fitting.batch import replace_file

    folder = job.work.folder
    recipe = folder / RECIPE
    folder.mkdir(exist_ok=True)
    before = recipe.read_text() if recipe.exists() else None
    if before is not None and not resume:
        raise UsageError(
            f"{folder}: holds parts of an earlier run; --resume goes on with it, -o FILE "
            "begins another, or remove the folder"
        )
    if before is not None and before != job.work.recipe:
        raise UsageError(
            f"{folder}: holds parts that were made of another file, other options or "
            "versions; remove the folder, or choose another name with -o"
        )
    replace_file(recipe, job.work.recipe.encode())


def _remove(folder: Path) -> None:
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()
