"""What instruments get wrong is found in the numbers, masked and counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import data_formats
from data_formats import Measurement
from data_formats.instrument_quirks import apply_quirks

SPECTRAL = "theta_i,phi_i,theta_s,phi_s," + ",".join(f"{w}nm" for w in range(400, 701, 10))
LEDS = "theta_i,phi_i,theta_s,465nm,525nm,630nm"


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def test_cornell_shadow(write_astm, shadowed_rows, cornell_rows):
    m = data_formats.read(write_astm(shadowed_rows, SPECTRAL))
    hidden = np.flatnonzero(~m.valid.any(axis=1))
    np.testing.assert_allclose(np.rad2deg(m.theta_i[hidden]), 80, atol=1e-3)
    np.testing.assert_allclose(np.rad2deg(m.theta_r[hidden]), 79.05, atol=1e-2)
    np.testing.assert_allclose(
        np.sort(np.rad2deg(m.phi_r[hidden])), [-170, -165, -160, -155], atol=1e-3
    )
    assert (m.value[hidden] == 0.0003).all()
    assert codes(m)["cornell-shadow-masked"] == 4
    assert m.symmetry == "bilateral"
    assert "half-hemisphere" in codes(m)
    # The same directions without the shadow: nothing to mask.
    sound = data_formats.read(write_astm(cornell_rows, SPECTRAL))
    assert sound.valid.all()
    assert "cornell-shadow-masked" not in codes(sound)
    assert "cornell-spike" in codes(sound)


def test_cornell_noise_and_zeros_are_noted_and_not_masked(write_astm, cornell_rows):
    rows = cornell_rows.copy()
    rows[:, 4:6] *= np.random.default_rng(1).uniform(0.2, 2, (len(rows), 2))
    rows[:30, 10] = 0
    m = data_formats.read(write_astm(rows, SPECTRAL))
    assert m.valid.all()
    assert codes(m)["clamped-zeros"] == 30
    assert "cornell-noisy-blue" in codes(m)
    rows[0, 10] = -0.1
    assert "clamped-zeros" not in codes(data_formats.read(write_astm(rows, SPECTRAL)))


def test_other_directions_are_not_cornell(write_astm, cornell_rows):
    rows = cornell_rows.copy()
    rows[7, 2] += 0.01
    m = data_formats.read(write_astm(rows, SPECTRAL))
    assert not [c for c in codes(m) if c.startswith("cornell")]


def test_ramp_to_grazing(write_astm, ramped_rows):
    m = data_formats.read(write_astm(ramped_rows, LEDS))
    beyond = m.theta_r > np.deg2rad(75.5)
    assert (m.valid == ~beyond[:, None]).all()
    assert codes(m)["ramp-masked"] == beyond.sum() == 3 * 3 * 12
    assert codes(m)["phi-s-inserted"] == 0
    # The source stays at azimuth pi, and specular is phi_r - phi_i = pi.
    np.testing.assert_allclose(m.phi_i, np.pi)
    for incidence in np.unique(m.theta_i[m.theta_i > 0]):
        rows = np.flatnonzero((m.theta_i == incidence) & m.valid.all(axis=1))
        top = rows[np.argmax(m.value[rows, 0])]
        assert np.cos(m.phi_r[top] - m.phi_i[top]) == pytest.approx(-1)
        assert m.theta_r[top] == pytest.approx(incidence)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda r: r[:, 4:] * (1 + 1e-6 * np.sin(1e4 * r[:, :1] + 300 * r[:, 2:3])),
        lambda r: 0 * r[:, 4:],
        lambda r: 0 * r[:, 4:] + np.cos(r[:, 2:3]),
    ],
)
def test_what_is_no_ramp_stays(write_astm, ramped_rows, spoil):
    rows = ramped_rows.copy()
    rows[:, 4:] = spoil(rows)
    assert "ramp-masked" not in codes(data_formats.read(write_astm(rows, LEDS)))


def test_zeros_elsewhere_stay(write_astm, ramped_rows):
    rows = ramped_rows[ramped_rows[:, 2] < 1.3].copy()
    forward = (rows[:, 0] > 0.3) & (np.cos(rows[:, 3]) > 0.5)
    rows[forward, 4:] = 0
    m = data_formats.read(write_astm(rows, LEDS))
    assert m.valid.all()


def test_quirks_are_not_applied_twice(tmp_path, write_astm, shadowed_rows, ramped_rows):
    for rows, names in ((shadowed_rows, SPECTRAL), (ramped_rows, LEDS)):
        m = data_formats.read(write_astm(rows, names))
        for suffix in (".astm", ".csv", ".h5"):
            path = tmp_path / f"again{suffix}"
            data_formats.write(m, path)
            again = data_formats.read(path)
            assert again.equals(m)
            assert again.notes == m.notes
            assert again.provenance == m.provenance


def test_quirks_need_no_valid_rows(write_astm, shadowed_rows, ramped_rows):
    for rows, names in ((shadowed_rows, SPECTRAL), (ramped_rows, LEDS)):
        m = data_formats.read(write_astm(rows, names))
        nothing = replace(
            m, valid=np.zeros_like(m.valid), value=np.full_like(m.value, np.nan)
        )
        assert not apply_quirks(nothing).valid.any()
        assert apply_quirks(m.select([])).n_rows == 0
