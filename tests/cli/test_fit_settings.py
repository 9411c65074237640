"""Options of `brdf fit`: on the command line, in a job file, and both."""

from __future__ import annotations

import dataclasses
import math
from typing import get_args

import numpy as np
import pytest

from fitting.cli.failures import UsageError
from fitting.cli.fit_choices import Choices, ObjectiveChoice
from fitting.cli.fit_settings import settle
from fitting.objectives import OBJECTIVES
from fitting.options import FitOptions


def test_every_field_of_the_options_can_be_chosen():
    choices = {f.name for f in dataclasses.fields(Choices)}
    wanted = {f.name.removesuffix("_deg") for f in dataclasses.fields(FitOptions)}
    assert wanted <= choices
    assert set(get_args(ObjectiveChoice)) == {"auto", *OBJECTIVES}


def test_nothing_said_is_the_default():
    job = settle(Choices())
    assert job.options == {}
    assert FitOptions(**job.options) == FitOptions()
    assert job.cross_validate
    assert not job.colour


def test_the_command_line():
    job = settle(
        Choices(
            model=["lambert", "ggx", "lambert"],
            max_theta=70.0,
            noise="0.02,1e-3",
            energy="hard",
            fix=["ggx.f90=1", "*.f0=0.1,0.2,0.3"],
            bounds=["ggx.alpha=:0.3", "ggx.f0=0.01:"],
            tie=["ggx.f0=0.04*ggx.f90"],
            cv=False,
        )
    )
    assert job.models == ("lambert", "ggx")
    options = FitOptions(**job.options)
    assert options.max_theta_deg == 70.0
    assert options.noise == (0.02, 1e-3)
    assert options.energy == "hard"
    assert options.fix["ggx.f90"] == 1.0
    np.testing.assert_array_equal(options.fix["*.f0"], [0.1, 0.2, 0.3])
    assert options.bounds == {"ggx.alpha": (-math.inf, 0.3), "ggx.f0": (0.01, math.inf)}
    assert options.tie == {"ggx.f0": "0.04*ggx.f90"}
    assert not job.cross_validate


JOB = """
model = ["lambert + ggx"]
max-theta = 75
objective = "cbrt"
per_channel_shape = true
no-cv = true
energy = 0
noise = [0.01, 0.0]
starts = 8
[fix]
ggx.f90 = 1.0
"ggx.f0" = [0.1, 0.2]
[bounds]
"ggx.alpha" = "0.01:"
"""


def test_a_job_file_and_the_command_line_that_wins(tmp_path):
    path = tmp_path / "job.toml"
    path.write_text(JOB)
    job = settle(Choices(config=path, objective="l2", fix=["ggx.f90=0.5"], cv=True))
    assert job.models == ("lambert + ggx",)
    assert job.cross_validate
    options = FitOptions(**job.options)
    assert (options.objective, options.max_theta_deg) == ("l2", 75.0)
    assert options.per_channel_shape
    assert options.energy == 0.0
    assert options.starts == 8
    assert options.fix["ggx.f90"] == 0.5
    assert list(options.fix["ggx.f0"]) == [0.1, 0.2]  # type: ignore[arg-type]
    assert options.bounds == {"ggx.alpha": (0.01, math.inf)}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("objectiv = 'l2'", "did you mean 'objective'"),
        ("objective = 'l3'", "expected one of"),
        ("robust = 1", "true or false"),
        ("starts = 1.5", "whole number"),
        ("model = 3", "text"),
        ("fix = 3", "table"),
        ("noise = [1]", "A,B"),
        ("energy = 'soft'", "hard"),
        ("format = 3", "text"),
        ("= 3", "not TOML"),
    ],
)
def test_a_wrong_job_file(tmp_path, text, says):
    path = tmp_path / "job.toml"
    path.write_text(text)
    with pytest.raises(UsageError, match=says):
        settle(Choices(config=path))
