"""``brdf batch``: many files, each fitted as `brdf fit` does, by many processes."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from fitting.cli import failures
from fitting.cli.fit_choices import Choices
from fitting.cli.flags import WORK, Flags, Scheduler

if TYPE_CHECKING:
    from fitting.batch import Engine
    from fitting.cli.batch_progress import BatchProgress
    from fitting.cli.batch_run import Ran
    from fitting.cli.fit_settings import Job

_FILES = Group("Files", sort_key=6)
_TERMINATED = 143
_MOST_WORKERS = 4096


@Parameter(name="*")
@dataclass(frozen=True)
class BatchChoices(Choices):
    """The choices of `brdf fit`, of which two mean something else for many files."""

    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"), group=_FILES,
            help="The folder of the results (results).",
        ),
    ] = None  # fmt: skip
    json: Annotated[
        bool | None,
        Parameter(negative="", group=_FILES, help="Print the summary as JSON, no table."),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True)
class Workers:
    """Who does the work, and what about work that was begun."""

    workers: Annotated[
        int | None,
        Parameter(
            group=WORK,
            help="Number of processes; 0: no process but this one. Without: one per core.",
        ),
    ] = None
    scheduler: Scheduler = None
    retries: Annotated[
        int,
        Parameter(
            group=WORK,
            help="How often a file is tried again whose worker died or met a storage "
            "error.",
        ),
    ] = 2
    resume: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, group=WORK,
            help="Go on with what the folder holds: keep whole results of unchanged "
            "files, options and versions, redo others.",
        ),
    ] = False  # fmt: skip


def batch(
    *files: Annotated[
        str,
        Parameter(
            name="FILE",
            negative="",
            help="Files of measured reflectance or transmittance, or patterns in quotes: "
            "'data/*.astm', 'data/**/*.csv'.",
        ),
    ],
    choices: BatchChoices | None = None,
    workers: Workers | None = None,
    flags: Flags | None = None,
) -> int:
    """Fit every file for itself, as `brdf fit` does, by many processes or machines.

    Writes NAME.fit.json for each, and summary.csv, parameters.csv and summary.h5 over all.
    A file that fails is listed with its reason and stops no other. Killed at any moment,
    the same command with --resume goes on.
    """
    flags, who = flags or Flags(), workers or Workers()
    from fitting.cli.fit_settings import settle

    job = settle(choices or BatchChoices())
    if not files:
        raise failures.UsageError("batch: expected files, such as 'data/*.astm'")
    _check(who, job)
    from fitting.cli import batch_plan, batch_report, batch_run, terminal
    from fitting.cli.batch_progress import BatchProgress
    from fitting.cli.batch_recipe import recipe
    from fitting.cli.batch_work import FitFile

    paths = batch_plan.expand(files)
    folder = job.output or Path("results")
    batch_plan.prepare_folder(folder, resume=who.resume)
    work = FitFile(job, folder.absolute(), recipe(job))
    plan = batch_plan.plan(paths, work)
    quiet = flags.quiet or job.json
    todo = len(plan.todo)
    progress = BatchProgress(terminal.stderr(), todo, quiet=quiet, verbose=flags.verbose)
    engine = _engine(who, todo, progress)
    for path, why in plan.redone.items():
        progress.say(f"again: {path}: {why}")
    progress.say(f"{todo} of {len(plan.items)} files to fit, by {engine.described}")
    try:
        ran = batch_run.run(engine, work, plan, retries=who.retries, progress=progress)
    except ValueError:
        batch_plan.forget_empty(folder)
        raise
    total = len(plan.items)
    out = terminal.stdout()
    if job.json:
        sys.stdout.write(batch_report.as_json(ran, total) + "\n")
    elif flags.quiet:
        out.print(batch_report.sentence(ran, total), soft_wrap=True)
    else:
        batch_report.show(
            out, ran, folder, engine.described, total=total, verbose=flags.verbose
        )
    return _exit_code(ran)


def _check(who: Workers, job: Job) -> None:
    from fitting.cli.batch_recipe import own_files

    if who.retries < 0:
        raise failures.UsageError(f"--retries {who.retries}: expected 0 or more")
    if who.workers is not None and not 0 <= who.workers <= _MOST_WORKERS:
        raise failures.UsageError(
            f"--workers {who.workers}: expected a number from 0 to {_MOST_WORKERS}"
        )
    for path in own_files(job):
        if who.scheduler is not None and not path.expanduser().is_absolute():
            raise failures.UsageError(
                f"{path}: workers of a scheduler may be in another folder; give its full "
                f"path, {path.absolute()}"
            )


def _engine(who: Workers, todo: int, progress: BatchProgress) -> Engine:
    from fitting.batch import Cluster, Processes, Serial, cores

    workers = cores() if who.workers is None else who.workers
    if who.scheduler is not None:
        return Cluster(who.scheduler, max(workers, 1), progress.say)
    return Processes(min(workers, max(todo, 1))) if workers else Serial()


def _exit_code(ran: Ran) -> int:
    from fitting.cli.batch_run import Terminated

    if ran.stopped is not None:
        what = "interrupted" if isinstance(ran.stopped, KeyboardInterrupt) else ran.stopped
        print(
            f"brdf: {what}; what is done is kept, and the same command with --resume goes "
            "on",
            file=sys.stderr,
        )
        if isinstance(ran.stopped, Terminated):
            return _TERMINATED
        interrupted = isinstance(ran.stopped, KeyboardInterrupt)
        return failures.INTERRUPTED if interrupted else failures.NOT_CONVERGED
    good = all(row["status"] == "done" and row["converged"] for row in ran.files)
    return failures.GOOD if good else failures.NOT_CONVERGED
