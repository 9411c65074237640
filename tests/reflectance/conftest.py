"""One fit with a known truth, which these tests share since compiling takes long."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import pytest
from synthetic import measurement

import fitting
from data_formats import Channel
from fitting.result import FitResult


class Fitted(NamedTuple):
    truth: dict
    result: FitResult
    path: Path


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Fitted:
    albedo = [0.1, 0.2, 0.3, 0.5, 0.6]
    truth = {"lambert.albedo": albedo, "ggx.alpha": 0.25, "ggx.f0": [0.05] * 5,
             "ggx.f90": [1.0] * 5}  # fmt: skip
    data = measurement("lambert + ggx", truth, relative=0.02, absolute=1e-4, seed=1)
    at = (420.0, 500.0, 560.0, 620.0, 700.0)
    data = dataclasses.replace(data, channels=tuple(Channel.at(w) for w in at))
    result = fitting.fit(data, "lambert + ggx", starts=1)
    path = tmp_path_factory.mktemp("fitted") / "paint.fit.json"
    result.save(path)
    return Fitted(truth, result, path)
