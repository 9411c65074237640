"""Running the fits of one `brdf fit`, with progress."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping
from typing import Any

from data_formats import Measurement
from fitting.cli import terminal
from fitting.cli.failures import UsageError
from fitting.cli.fit_settings import Job
from fitting.cli.flags import Flags
from fitting.cli.steps import Steps
from fitting.comparison import Comparison, choose, default_models
from fitting.fitter import fit
from fitting.model import Model
from fitting.options import FitOptions

_BY_NAME = ("fix", "bounds", "tie")


def run(measurement: Measurement, job: Job, flags: Flags) -> Comparison:
    """Fit every model and choose.

    Raises `ModelError` or `UsageError` before any work for a model or a parameter that
    does not exist.
    """
    models = [Model(m) for m in job.models or default_models(measurement)]
    options = [_options_for(m, job.options) for m in models]
    _every_name_is_used(models, job.options)
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


def _options_for(model: Model, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options without what concerns parameters that only other models have."""
    own = dict(options)
    for key in _BY_NAME:
        if key in own:
            own[key] = {
                pattern: v for pattern, v in own[key].items() if _matches(model, pattern)
            }
    return own


def _every_name_is_used(models: list[Model], options: Mapping[str, Any]) -> None:
    for key in _BY_NAME:
        for pattern in options.get(key, {}):
            if any(_matches(m, pattern) for m in models):
                continue
            has = "; ".join(f"{m.expression}: {', '.join(m.parameters())}" for m in models)
            raise UsageError(f"--{key} {pattern}: there is no such parameter; {has}")


def _matches(model: Model, pattern: str) -> bool:
    return any(fnmatch.fnmatch(name, pattern) for name in model.parameters())
