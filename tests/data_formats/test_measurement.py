"""`Measurement` accepts what its description says, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from data_formats import Channel, Measurement, MeasurementError


def made(**changes) -> Measurement:
    n, c = 3, 2
    fields = {
        "theta_i": np.full(n, 0.5),
        "phi_i": np.zeros(n),
        "theta_r": np.array([0.1, 0.5, 2.0]),
        "phi_r": np.array([0.0, np.pi, 7.0]),
        "value": np.array([[0.1, -0.2], [np.nan, 3.0], [0.0, 1e-300]]),
        "valid": np.array([[True, True], [False, True], [True, True]]),
        "channels": (Channel.at(450), Channel.at(550.5)),
        "sigma": np.full((n, c), 0.01),
        "auxiliary": {"temperature": np.array([20.0, 21.0, np.nan])},
    }
    return Measurement(**(fields | changes))


def test_sizes_and_wavelengths():
    m = made()
    assert (m.n_rows, m.n_channels) == (3, 2)
    assert m.wavelengths.tolist() == [450, 550.5]
    assert [c.name for c in m.channels] == ["450 nm", "550.5 nm"]
    assert made(channels=(Channel("R"), Channel.at(550))).wavelengths is None


def test_arrays_are_read_only_float64_copies():
    theta = np.array([0.1, 0.2, 0.3], dtype=np.float32)
    m = made(theta_i=theta)
    theta[0] = 1
    assert m.theta_i.dtype == np.float64
    assert m.theta_i[0] == pytest.approx(0.1)
    for array in (m.theta_i, m.value, m.valid, m.sigma, m.auxiliary["temperature"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_select_rows_by_mask_and_by_index():
    m = made()
    picked = m.select([2, 0])
    assert picked.theta_r.tolist() == [2.0, 0.1]
    assert picked.value.tolist() == [[0.0, 1e-300], [0.1, -0.2]]
    np.testing.assert_array_equal(picked.auxiliary["temperature"], [np.nan, 20.0])
    assert m.select(np.array([True, False, True])).theta_r.tolist() == [0.1, 2.0]
    assert m.select([]).n_rows == 0
    assert m.select(np.arange(3)).equals(m)


def test_sides_of_the_surface():
    edge = np.pi / 2
    pairs = [
        # theta_i, theta_r, transmitted, from_back
        (0.5, 0.5, False, False),
        (0.5, 2.0, True, False),
        (2.0, 0.5, True, True),
        (2.0, 2.0, False, True),
        (np.pi, 0.0, True, True),
        # On the horizon: on the other one's side, and in front if both are.
        (edge, 2.0, False, False),
        (2.0, edge, False, True),
        (0.5, edge, False, False),
        (edge, edge, False, False),
        (0.5, edge + 0.9e-9, False, False),
        (0.5, edge + 1.1e-9, True, False),
        (edge + 0.9e-9, 0.5, False, False),
        (edge + 1.1e-9, 0.5, True, True),
    ]
    theta_i, theta_r, transmitted, from_back = zip(*pairs, strict=True)
    n = len(pairs)
    m = made(
        theta_i=np.array(theta_i),
        phi_i=np.zeros(n),
        theta_r=np.array(theta_r),
        phi_r=np.zeros(n),
        value=np.ones((n, 2)),
        valid=np.ones((n, 2), bool),
        sigma=None,
        auxiliary={},
    )
    assert m.transmitted.dtype == m.from_back.dtype == np.bool_
    assert m.transmitted.tolist() == list(transmitted)
    assert m.from_back.tolist() == list(from_back)


def test_equality_is_exact_and_knows_nan():
    m = made()
    assert m.equals(made())
    assert not m.equals(replace(m, value=m.value + 1e-16))
    assert not m.equals(replace(m, sigma=None))
    assert not m.equals(replace(m, symmetry="anisotropic"))
    assert not m.equals(replace(m, auxiliary={}))
    assert not m.equals(m.select([0, 1]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"theta_i": np.zeros((3, 1))}, "theta_i has the shape"),
        ({"theta_r": np.zeros(2)}, r"theta_r has the shape \(2,\); expected \(3,\)"),
        ({"value": np.zeros((2, 3))}, r"value has the shape \(2, 3\); expected \(3, 2\)"),
        ({"theta_i": ["a", "b", "c"]}, "not an array of numbers"),
        ({"theta_i": np.array([0.1, -0.1, 0])}, "theta_i is -0.1 in row 1"),
        ({"theta_r": np.array([0.1, 3.2, 0])}, "theta_r is 3.2"),
        ({"phi_r": np.array([0.1, np.inf, 0])}, "phi_r is inf"),
        ({"valid": np.ones((3, 2), bool)}, "not finite in 1 entries"),
        ({"sigma": np.zeros((3, 2))}, "sigma is not a positive number in 5 valid entries"),
        ({"channels": ()}, "no channel"),
        ({"channels": (Channel("R"), Channel("R"))}, "two channels have the name R"),
        (
            {"channels": (Channel("a", 400.0), Channel("b", 400.0))},
            "two channels have the wavelength 400",
        ),
        ({"symmetry": "round"}, "symmetry is 'round'"),
        ({"auxiliary": {"": np.zeros(3)}}, "must be printable"),
    ],
)
def test_what_does_not_fit_is_refused(changes, message):
    with pytest.raises(MeasurementError, match=message):
        made(**changes)


@pytest.mark.parametrize("wavelength", [0.0, -400.0, np.inf, np.nan])
def test_wavelengths_are_positive(wavelength):
    with pytest.raises(MeasurementError, match="positive and finite"):
        Channel("x", wavelength)


def test_channel_names_are_printable():
    with pytest.raises(MeasurementError, match="printable"):
        Channel("\n")
