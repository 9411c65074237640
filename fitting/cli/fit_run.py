"""Running the fits of one `brdf fit`, with progress."""

from __future__ import annotations

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
    results = []
    with Steps(console, len(models), quiet=quiet, verbose=flags.verbose) as steps:
        for model, own in zip(models, options, strict=True):
            steps.begin(model.expression)
            results.append(
                fit(
                    measurement,
                    model,
                    FitOptions(**own),
                    cross_validate=job.cross_validate,
                    colour=job.colour,
                    progress=steps.say,
                )
            )
    best, reason = choose(tuple(results))
    if len(results) > 1 and not job.cross_validate:
        reason = (
            f"{results[best].model} fits best; without held-out angles (--no-cv) more "
            "parameters always look better"
        )
    return Comparison(tuple(results), best, reason)
