"""Reflection and transmission, front and back, put together into one measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import data_formats
from data_formats import Channel, Measurement, MeasurementError, Note, Provenance


def made(path: str = "lab/front.astm", **changes) -> Measurement:
    fields = {
        "theta_i": np.array([0.5, 0.5, 0.7]),
        "phi_i": np.zeros(3),
        "theta_r": np.array([0.1, 0.5, 1.0]),
        "phi_r": np.array([0.0, np.pi, 1.0]),
        "value": np.array([[0.1, -0.2], [np.nan, 3.0], [0.0, 1.0]]),
        "valid": np.array([[True, True], [False, True], [True, True]]),
        "channels": (Channel.at(450), Channel.at(550)),
        "provenance": Provenance(path, path[-1] * 64, "astm", "G", "Tile", "2024"),
        "notes": (Note("negative-values", "negative values: 1; kept", 1),),
    }
    return Measurement(**(fields | changes))


@pytest.fixture
def front() -> Measurement:
    return made(symmetry="bilateral")


@pytest.fixture
def behind(front) -> Measurement:
    return made(
        "lab/behind.csv",
        theta_r=np.pi - front.theta_r,
        value=front.value + 1,
        notes=(Note("transmitted-rows", "rows of transmitted light: 3", 3),),
        provenance=Provenance(
            "lab/behind.csv", "f" * 64, "csv", "G", "Tile", "2025", {"MEAS_NAME": "BTDF"}
        ),
    )


def test_rows_one_after_another(front, behind):
    m = data_formats.join(front, behind)
    assert m.n_rows == 6
    assert m.select(range(3)).equals(replace(front, symmetry="isotropic"))
    assert m.select(range(3, 6)).equals(behind)
    assert m.transmitted.tolist() == [False] * 3 + [True] * 3
    p = m.provenance
    assert p.path == "lab/front.astm + lab/behind.csv"
    assert (p.format, p.instrument, p.sample) == ("astm + csv", "G", "Tile")
    assert p.date == "2024 + 2025"
    assert p.header["front.astm: sha256"] == "m" * 64
    assert p.header["behind.csv: sha256"] == "f" * 64
    assert p.header["behind.csv: MEAS_NAME"] == "BTDF"
    assert len(p.sha256) == 64
    assert [(n.code, n.sentence) for n in m.notes] == [
        ("negative-values", "front.astm: negative values: 1; kept"),
        ("transmitted-rows", "behind.csv: rows of transmitted light: 3"),
        ("joined", "Joined: front.astm (3 rows) and behind.csv (3 rows)"),
    ]


@pytest.mark.parametrize("suffix", [".astm", ".csv", ".h5"])
def test_what_was_joined_can_be_written(front, behind, suffix, tmp_path):
    m = data_formats.join(front, behind)
    data_formats.write(m, tmp_path / f"m{suffix}")
    again = data_formats.read(tmp_path / f"m{suffix}")
    assert again.equals(m)
    assert (again.notes, again.provenance) == (m.notes, m.provenance)


def test_none_one_and_three(front, behind):
    with pytest.raises(MeasurementError, match="nothing to join"):
        data_formats.join()
    assert data_formats.join(front) is front
    back = made("lab/back.csv", theta_i=np.pi - front.theta_i)
    at_once = data_formats.join(front, behind, back)
    by_and_by = data_formats.join(data_formats.join(front, behind), back)
    assert at_once.equals(by_and_by)
    assert at_once.provenance.path == by_and_by.provenance.path
    assert by_and_by.notes[-1].sentence == (
        "Joined: front.astm + behind.csv (6 rows) and back.csv (3 rows)"
    )


def test_repeats_stay_and_are_counted(front):
    other = replace(front, value=front.value + 1, notes=())
    m = data_formats.join(front, other)
    assert m.n_rows == 6
    assert {n.code: n.count for n in m.notes}["duplicate-directions"] == 3
    # The same file twice: the two are told apart by number.
    assert "lab/front.astm [1]: sha256" in m.provenance.header


def test_channels_in_another_order_or_with_other_last_digits(front):
    sigma = np.array([[0.1, 0.2]] * 3)
    front = replace(front, sigma=sigma)
    other = replace(
        front,
        value=front.value[:, ::-1],
        valid=front.valid[:, ::-1],
        sigma=sigma[:, ::-1],
        channels=(Channel.at(550 + 9e-7), Channel.at(450 - 9e-7)),
    )
    m = data_formats.join(front, other)
    assert m.channels == front.channels
    assert m.select([3, 4, 5]).equals(front)


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        ((Channel.at(450), Channel.at(551)), "front.* has the channels 550 nm and only b"),
        ((Channel.at(450), Channel.at(550 + 2e-6)), "has the channels 550.000002 nm"),
        ((Channel("R"), Channel("G")), "only behind.csv has the channels R, G"),
        ((Channel.at(450), Channel("green", 550.0)), "the channels green at 550 nm"),
    ],
)
def test_other_channels_are_refused(front, behind, channels, message):
    with pytest.raises(MeasurementError, match=message) as caught:
        data_formats.join(front, replace(behind, channels=channels))
    said = str(caught.value)
    assert said.startswith("front.astm and behind.csv cannot be joined")
    assert "\n" not in said


def test_fewer_and_many_channels(front, behind):
    fewer = replace(
        behind,
        value=behind.value[:, :1],
        valid=behind.valid[:, :1],
        channels=behind.channels[:1],
    )
    for pair in ((front, fewer), (fewer, front)):
        with pytest.raises(
            MeasurementError, match=r"only front\.astm has the channels 550 nm;"
        ):
            data_formats.join(*pair)
    many = replace(
        front,
        value=np.ones((3, 20)),
        valid=np.ones((3, 20), bool),
        channels=tuple(Channel.at(400 + k) for k in range(20)),
    )
    with pytest.raises(
        MeasurementError, match="404 nm, 405 nm and 14 more and only behind"
    ):
        data_formats.join(many, behind)


def test_uncertainties_all_or_none(front, behind):
    sigma = np.full((3, 2), 0.1)
    both = data_formats.join(replace(front, sigma=sigma), replace(behind, sigma=2 * sigma))
    assert both.sigma[:, 0].tolist() == [0.1] * 3 + [0.2] * 3
    for pair in (
        (replace(front, sigma=sigma), behind),
        (behind, replace(front, sigma=sigma)),
    ):
        with pytest.raises(
            MeasurementError, match=r"front.astm has uncert.*behind.csv has"
        ):
            data_formats.join(*pair)


@pytest.mark.parametrize(
    ("symmetries", "least"),
    [
        (("bilateral", "bilateral"), "bilateral"),
        (("bilateral", "isotropic"), "isotropic"),
        (("isotropic", "anisotropic"), "anisotropic"),
        (("anisotropic", "bilateral"), "anisotropic"),
    ],
)
def test_the_least_symmetric_decides(front, behind, symmetries, least):
    parts = [
        replace(m, symmetry=s) for m, s in zip((front, behind), symmetries, strict=True)
    ]
    assert data_formats.join(*parts).symmetry == least


def test_auxiliary_columns_that_all_have(front, behind):
    t, humidity = np.array([20.0, 21, 22]), np.full(3, 0.5)
    first = replace(front, auxiliary={"t": t, "humidity": humidity})
    m = data_formats.join(first, replace(behind, auxiliary={"t": t + 1, "lamp": t}))
    assert m.auxiliary["t"].tolist() == [20, 21, 22, 21, 22, 23]
    assert list(m.auxiliary) == ["t"]
    note = next(n for n in m.notes if n.code == "auxiliary-left-out")
    assert note.count == 2
    assert "humidity of front.astm, lamp of behind.csv" in note.sentence


def test_questions_about_the_frame(front, behind):
    def asked(**changes) -> set[str]:
        m = data_formats.join(front, replace(behind, **changes))
        return {n.code for n in m.notes if n.code.startswith("perhaps")}

    assert asked() == set()
    assert asked(phi_i=np.ones(3)) == {"perhaps-anisotropic"}
    assert asked(phi_i=np.ones(3), symmetry="anisotropic") == set()
    assert asked(provenance=Provenance("x", sample="Glass")) == {"perhaps-two-samples"}


def test_measurements_without_files():
    nameless = made(provenance=Provenance(), notes=(Note("n", "Said."),))
    m = data_formats.join(nameless, nameless)
    assert m.provenance.path == "measurement [1] + measurement [2]"
    assert m.provenance.sha256 == ""
    assert m.notes[0].sentence == "measurement [1]: Said."
