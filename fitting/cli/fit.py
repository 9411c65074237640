"""``brdf fit``: from a file to a model, its parameters and a verdict."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fitting.cli import failures
from fitting.cli.fit_choices import Choices
from fitting.cli.flags import Flags
from fitting.cli.target import check_target

if TYPE_CHECKING:
    from fitting.cli.fit_settings import Job
    from fitting.result import FitResult


def fit(
    *files: Annotated[
        Path,
        Parameter(
            name="FILE",
            negative="",
            help="A file of measured reflectance or transmittance, or NAME.fit.json to "
            "convert that fit to another model. Several files of one sample (reflection "
            "and transmission, front and back) are fitted together. Without: the bundled "
            "sample.",
        ),
    ],
    choices: Choices | None = None,
    flags: Flags | None = None,
) -> int:
    """Fit models to measured reflectance, transmittance or both, and judge the result.

    Prints parameters with standard uncertainties, errors, what the data leave open, and a
    verdict; writes everything to NAME.fit.json.
    """
    flags = flags or Flags()
    from fitting.cli.fit_settings import settle

    job = settle(choices or Choices())
    paths = files or (_sample(),)
    target = _target(job, paths)
    if target is not None:
        check_target(target)

    from fitting.cli import reading, terminal

    measurement = reading.read_files(paths, job.format, job.reader)
    say = terminal.stderr()
    if not flags.quiet and not job.json:
        if not files:
            say.print("no FILE given: fitting the bundled sample, which is synthetic")
        say.print(reading.headline(measurement, *paths), style="dim")

    from fitting.cli import jax_setup

    jax_setup.set_up()
    from fitting.cli import fit_run

    done = fit_run.run(measurement, job, flags)
    result = done.kept
    if target is not None:
        result.save(target)
    if job.json:
        sys.stdout.write(result.to_json() + "\n")
    else:
        from fitting.cli import fit_report

        out = terminal.stdout()
        fit_report.show(out, done, measurement, flags)
        if target is not None:
            out.print(f"\nwritten to {target}")
    return _exit_code(result)


def _sample() -> Path:
    from fitting.sample import sample_path

    return sample_path()


def _target(job: Job, paths: tuple[Path, ...]) -> Path | None:
    """Where the result goes: beside nothing, into the current folder, unless told."""
    from fitting.cli.reading import stem

    if job.output is not None:
        return job.output
    return None if job.json else Path(f"{'+'.join(map(stem, paths))}.fit.json")


def _exit_code(result: FitResult) -> int:
    return failures.GOOD if result.solver.converged else failures.NOT_CONVERGED
