"""``brdf fit`` and ``brdf info`` on files with transmitted light."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from running import refuse

from data_formats import Channel, Measurement, write
from fitting.predict import predict
from fitting.result import load_result

MODEL = "lambert + lambert_transmission"
VALUES = {"lambert.albedo": 0.3, "lambert_transmission.transmittance": 0.2}


def measured(*, behind: bool, sides: tuple[float, ...] = (0.0,)) -> Measurement:
    rows = [
        (abs(side - i), 0.0, abs(side - (180.0 - o if behind else o)), p)
        for side in sides
        for i in (10, 30, 50)
        for o in (0, 10, 30, 50, 70)
        for p in range(0, 181, 30)
    ]
    angles = np.radians(np.array(rows, dtype=float).T)
    value = predict(MODEL, VALUES, *angles).reshape(-1, 1)
    value = value * np.random.default_rng(0).normal(1.0, 0.01, value.shape)
    return Measurement(*angles, value=value, valid=value > 0, channels=(Channel("mono"),),
                       symmetry="bilateral")  # fmt: skip


@pytest.fixture
def files(run) -> list[str]:
    write(measured(behind=False), "leaf_r.csv")
    write(measured(behind=True), "leaf_t.csv")
    return ["leaf_r.csv", "leaf_t.csv"]


def test_two_files_are_fitted_together(run, files):
    outcome = run("fit", *files, "-m", MODEL, "--no-cv")
    assert outcome.code == 0, outcome.err
    assert "leaf_r.csv + leaf_t.csv: 210 rows" in outcome.err
    assert "Joined: leaf_r.csv (105 rows) and leaf_t.csv (105 rows)" in outcome.out
    assert "of which" in outcome.out
    assert "is transmitted" in outcome.out
    result = load_result(Path("leaf_r+leaf_t.fit.json"))
    for name, truth in VALUES.items():
        assert result.parameter(name).value[0] == pytest.approx(truth, rel=0.01)


def test_files_that_do_not_go_together_are_refused_and_nothing_is_written(run, files):
    other = measured(behind=True)
    write(Measurement(other.theta_i, other.phi_i, other.theta_r, other.phi_r, other.value,
                      other.valid, (Channel("R"),)), "other.csv")  # fmt: skip
    names = ("leaf_r.csv", "other.csv")
    refuse(run, 3, "fit", *names, says=names)


def test_a_file_given_twice_is_no_more_evidence(run, files):
    Path("copy.csv").write_bytes(Path(files[0]).read_bytes())
    for second in (files[0], "copy.csv"):
        refuse(run, 2, "fit", files[0], second, says=["are the same file"])


def test_info_tells_reflected_from_transmitted_light(run):
    write(measured(behind=True, sides=(0.0, 180.0)), "both.astm")
    outcome = run("info", "both.astm", "--relative-index", "1.2")
    assert outcome.code == 0, outcome.err
    for words in ("10 T", "130 T", "transmitted light: 210 rows", "lit from the back",
                  "in transmission, over the squared index, 1.2 behind"):  # fmt: skip
        assert words in " ".join(outcome.out.split()), words
    refuse(run, 2, "info", "both.astm", "--relative-index", "0", says=["--relative-index"])


def test_models_tells_which_lobes_transmit(run):
    listed = run("models").out
    assert "RT" in next(x for x in listed.splitlines() if x.startswith("thin_slab"))
    assert "from front to back" in run("models", "lambert_transmission").out
