"""What the tests of figures draw: results and data with known answers, made once."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from made_up_results import result_of
from matplotlib.figure import Figure

import data_formats
from data_formats import Channel, Measurement
from fitting import sample
from fitting.plots import draw
from fitting.plots.style import styled
from fitting.result import FitResult


class Case(NamedTuple):
    """A result, and what it is compared with."""

    result: FitResult
    data: Measurement


@pytest.fixture(scope="session")
def paint() -> Case:
    """Seven wavelengths, isotropic, four angles of incidence: the bundled sample."""
    data = data_formats.read(sample.sample_path())
    return Case(result_of(sample.MODEL, sample.PARAMETERS, data), data)


@pytest.fixture(scope="session")
def matt() -> Case:
    """One channel, one angle of incidence, uncertainties, zeros and negatives.

    The model is 10 % brighter than the data, but for the values that are not positive.
    """
    angles = rings((30.0,))
    value = np.full((angles[0].size, 1), 0.2 / np.pi)
    value[::7], value[3::7] = 0.0, -0.01
    data = Measurement(
        *angles, value=value, valid=np.ones(value.shape, bool), channels=(Channel("mono"),),
        sigma=np.full(value.shape, 0.002), symmetry="isotropic",
    )  # fmt: skip
    return Case(result_of("lambert", {"lambert.albedo": 0.22}, data), data)


@pytest.fixture(scope="session")
def leaf() -> Case:
    """Three bands, both sides and both ways of light, anisotropic, two azimuths."""
    values = {"lambert.albedo": [0.3, 0.4, 0.1],
              "lambert_transmission.transmittance": [0.2, 0.3, 0.05]}  # fmt: skip
    parts = []
    for azimuth in (0.0, 90.0):
        ti, pi, tr, pr = rings((10.0, 50.0))
        turned = np.radians(azimuth)
        parts += [(ti, pi + turned, tr, pr + turned),
                  (ti, pi + turned, np.pi - tr, pr + turned)]  # fmt: skip
    angles = [np.concatenate(a) for a in zip(*parts, strict=True)]
    back = [np.pi - angles[0], angles[1], np.pi - angles[2], angles[3]]
    every = [np.concatenate(a) for a in zip(angles, back, strict=True)]
    through = (every[0] < np.pi / 2) != (every[2] < np.pi / 2)
    r, t = (np.array(v) / np.pi for v in values.values())
    data = Measurement(
        *every, value=np.where(through[:, None], t, r),
        valid=np.ones((through.size, 3), bool),
        channels=tuple(Channel(n) for n in "RGB"), symmetry="anisotropic",
    )  # fmt: skip
    model = "lambert + lambert(back) + lambert_transmission"
    own = {"lambert1.albedo": values["lambert.albedo"],
           "lambert2.albedo": values["lambert.albedo"],
           "lambert_transmission.transmittance":
               values["lambert_transmission.transmittance"]}  # fmt: skip
    return Case(result_of(model, own, data), data)


@pytest.fixture(scope="session")
def drawn(paint: Case, matt: Case, leaf: Case) -> Callable[..., Figure]:
    """A figure of one of the cases, drawn and rendered once for all tests."""
    cases = {"paint": paint, "matt": matt, "leaf": leaf}

    @functools.cache
    def figure(kind: str, name: str, *, data: bool = True) -> Figure:
        case = cases[kind]
        out = draw(name, case.result, case.data if data else None)
        file = io.BytesIO()
        with styled():
            out.savefig(file, format="png", dpi=40)
        assert file.getvalue().startswith(b"\x89PNG")
        return out

    return figure


@pytest.fixture(autouse=True)
def coarse_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few pixels and few nodes for each: what is tested does not depend on them."""
    monkeypatch.setattr("fitting.plots.sphere._PIXELS", 12)
    monkeypatch.setattr("fitting.plots.patch._POLAR", 6)
    monkeypatch.setattr("fitting.plots.patch._AROUND", 8)
    monkeypatch.setattr("fitting.plots.rendered._PER_PIXEL", 8)


@pytest.fixture
def saved(paint: Case, tmp_path: Path) -> Callable[..., Path]:
    """Writes a result of a file of its own beside it; returns the path of the result."""

    def save(folder: Path = tmp_path, **changes: object) -> Path:
        name = folder / "own.astm"
        name.write_bytes(sample.sample_path().read_bytes())
        data = data_formats.read(name)
        digest = hashlib.sha256(name.read_bytes()).hexdigest()
        assert data.provenance.sha256 == digest
        source = dataclasses.replace(data.provenance, path="own.astm")
        data = dataclasses.replace(data, provenance=source)
        result = result_of(sample.MODEL, sample.PARAMETERS, data, **changes)
        result.save(folder / "own.fit.json")
        return folder / "own.fit.json"

    return save


def rings(theta_i_deg: tuple[float, ...]) -> tuple[np.ndarray, ...]:
    """Rings of the detector every 10 deg up to 80, 24 azimuths each, rad."""
    theta_r, turn = np.meshgrid(np.arange(0.0, 81.0, 10.0), np.arange(0.0, 360.0, 15.0))
    theta_r, turn = theta_r.ravel(), turn.ravel()
    keep = (theta_r > 0) | (turn == 0)
    theta_r, turn = np.radians(theta_r[keep]), np.radians(turn[keep])
    parts = [
        (np.full(theta_r.size, np.radians(t)), np.zeros(theta_r.size), theta_r, turn)
        for t in theta_i_deg
    ]
    ti, pi, tr, pr = (np.concatenate(a) for a in zip(*parts, strict=True))
    return ti, pi, tr, pr
