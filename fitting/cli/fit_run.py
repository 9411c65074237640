"""Running the fits of one `brdf fit`, with progress."""

from __future__ import annotations

import functools
from typing import Any

from data_formats import Measurement
from fitting.by_name import own_settings, unused, unused_words
from fitting.cli import terminal
from fitting.cli.failures import UsageError
from fitting.cli.fit_settings import Job
from fitting.cli.flags import Flags
from fitting.cli.steps import Steps
from fitting.comparison import Comparison, choose, default_models
from fitting.fitter import fit
from fitting.model import Model
from fitting.options import FitOptions
from fitting.result import FitResult
from fitting.side_by_side import side_by_side


def run(measurement: Measurement, job: Job, flags: Flags) -> Comparison:
    """Fit every model and choose.

    Raises `ModelError` or `UsageError` before any work for a model or a parameter that
    does not exist.
    """
    models = [Model(m) for m in job.models or default_models(measurement)]
    if nobody := unused(models, job.options):
        raise UsageError(unused_words(models, *nobody))
    options = [own_settings(m, job.options) for m in models]
    console = terminal.stderr()
    quiet = flags.quiet or job.json
    with Steps(console, len(models), quiet=quiet, verbose=flags.verbose) as steps:

        def one(model: Model, own: dict[str, Any]) -> FitResult:
            with steps.of(model.expression) as say:
                return fit(
                    measurement,
                    model,
                    FitOptions(**own),
                    cross_validate=job.cross_validate,
                    colour=job.colour,
                    progress=say,
                )

        both = zip(models, options, strict=True)
        jobs = [functools.partial(one, model, own) for model, own in both]
        results = side_by_side(jobs, measurement.value.size)
    best, reason = choose(tuple(results))
    if len(results) > 1 and not job.cross_validate:
        reason = (
            f"{results[best].model} fits best; without held-out angles (--no-cv) more "
            "parameters always look better"
        )
    return Comparison(tuple(results), best, reason)
