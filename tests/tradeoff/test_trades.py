"""Inside a model: what must follow from what is varied, on data whose truth is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import synthetic

from data_formats import Channel
from fitting import FitOptions, fit
from fitting.tradeoff.albedo_error import albedo_error
from fitting.tradeoff.quadrature_trades import quadrature_trades
from fitting.tradeoff.sampling_trades import channel_trades, row_trades, spread_rows
from fitting.tradeoff.solver_trades import start_trades, tolerance_trades
from fitting.tradeoff.trade import NotPossible, Setting, enough, trades

OPTIONS = FitOptions(starts=4)
# Few rows and the plainest objective, of which the code is soon compiled.
PLAIN = FitOptions(objective="l2")
MATT = np.array([0.2, 0.5, 0.3])
FEW = synthetic.directions(theta_i_deg=(10.0, 40.0, 65.0), rings=8, azimuths=5)


def matt(albedo: np.ndarray = MATT):
    """Noise-free Lambert with an albedo per wavelength, 400 nm, 500 nm, ..."""
    return synthetic.measurement("lambert", {"lambert.albedo": albedo}, angles=FEW)


@pytest.fixture(scope="module")
def glossy():
    """Noisy two-lobed data, and a fit of one lobe."""
    truth = {
        "lambert.albedo": np.array([0.2, 0.3, 0.4]),
        "ggx1.alpha": 0.1, "ggx2.alpha": 0.4,
    }  # fmt: skip
    m = synthetic.measurement("lambert + 2*ggx", truth, relative=0.02)
    return m, fit(m, "lambert + ggx", OPTIONS, cross_validate=False)


def test_a_looser_tolerance_takes_fewer_steps_and_is_no_better(glossy):
    found = tolerance_trades(*glossy, OPTIONS, repeats=3)
    steps = [t.work for t in found]
    errors = [t.error for t in found]
    assert steps == sorted(steps, reverse=True)
    assert steps[-1] < steps[0]
    assert min(errors) >= errors[0] * (1 - 1e-9)
    # It is the objective of the fit that `fit` states.
    assert errors[0] == pytest.approx(glossy[1].scores.log1p, rel=1e-6)
    assert found[0].relative_seconds == found[0].relative_error == 1.0


def test_fewer_starts_are_no_better(glossy):
    found = start_trades(*glossy, OPTIONS, repeats=3)
    errors = [t.error for t in found]
    assert errors == sorted(errors)
    assert [t.setting for t in found][-1] == "1"
    assert errors[0] == pytest.approx(glossy[1].scores.log1p, rel=1e-6)


@pytest.mark.slow
def test_more_nodes_are_nearer_to_the_adaptive_albedo(glossy):
    found = quadrature_trades(glossy[1], repeats=3)
    off = [t.worst for t in found if t.setting != "adaptive"]
    assert off == sorted(off)
    # `albedo_basis` states below 5e-4 with 32 nodes, 2e-3 with 16 and 1.3e-2 with 8, at
    # each lobe; what is measured is relative to an albedo of about a third.
    assert off[0] < 3 * 5e-4
    assert [t.work for t in found][1:] == [1024.0, 256.0, 64.0, 16.0]
    assert "nodes" in enough(found, 0.02)


def test_any_rows_of_noise_free_data_tell_the_truth():
    result = fit(matt(), "lambert", PLAIN, cross_validate=False)
    found = row_trades(matt(), result, PLAIN, repeats=1)
    assert len(found) == 4
    assert max(t.worst for t in found) < 1e-12
    for t, k in zip(found, (1, 2, 4, 8), strict=True):
        assert abs(t.work - result.data.rows_used / k) <= 3


def test_choices_of_rows_are_apart_and_together_everything():
    parts = [spread_rows(997, 4, k) for k in range(4)]
    np.testing.assert_array_equal(np.sort(np.concatenate(parts)), np.arange(997))
    # No rhythm: every block of 16 rows has its share, whatever the table's period.
    for block in range(0, 960, 16):
        assert 2 <= np.sum((parts[0] >= block) & (parts[0] < block + 16)) <= 6


def test_a_bent_spectrum_has_the_error_of_linear_interpolation():
    bent = np.array([0.4, 0.25, 0.2, 0.25, 0.4])
    result = fit(matt(bent), "lambert", PLAIN, cross_validate=False)
    found = channel_trades(matt(bent), result, PLAIN, repeats=1)
    assert [t.work for t in found] == [5.0, 3.0]
    assert found[0].error < 1e-12
    # At the two that were left out the chord is 0.05 above; of albedo over pi.
    assert found[1].error == pytest.approx(np.sqrt(2 * 0.05**2) / np.pi, abs=1e-9)


def test_bands_and_few_wavelengths_are_refused(glossy):
    m, result = glossy
    bands = dataclasses.replace(m, channels=tuple(Channel(n) for n in "RGB"))
    with pytest.raises(NotPossible, match="no wavelengths"):
        channel_trades(bands, result, OPTIONS, repeats=1)
    with pytest.raises(NotPossible, match="too few"):
        channel_trades(matt(), result, OPTIONS, repeats=1)


def test_albedo_error_is_the_difference_of_the_albedos():
    result = fit(matt(), "lambert", PLAIN, cross_validate=False)
    darker = matt(MATT - np.array([0.1, 0.05, 0.0]))
    found = albedo_error(darker, result)
    assert found.angles == 3
    # A matt surface sums to its albedo, but for the zones between the rings.
    assert found.worst == pytest.approx(0.1, rel=0.02)
    assert found.rms == pytest.approx(np.sqrt((0.1**2 + 0.05**2) / 3), rel=0.02)


def settings(*rows, deviation: bool):
    return trades(
        "thing", [Setting(n, None, w, e, e) for n, w, e in rows], cost_of="fit",
        work_unit="steps", error_of="log1p", deviation=deviation,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "deviation", "says"),
    [
        ((("a", 9, 1.0), ("b", 3, 1.005), ("c", 1, 1.2)), False, "b will do in place of a: "
         "0.33 times the steps, 1.005 times the error"),
        ((("a", 9, 1.0), ("b", 3, 2.0)), False, "nothing replaces a: all else loses"),
        ((("a", 3, 1.0), ("b", 9, 1.0)), False, "what is as good as a costs no less"),
        ((("a", 9, 0.0), ("b", 3, 5e-4)), True, "b will do in place of a: 0.33 times the "
         "steps, off by at most 0.05 %, where the noise is 1 %"),
        ((("a", 9, 0.0), ("b", 3, 2e-3)), True, "deviates by more than a tenth"),
    ],
)  # fmt: skip
def test_what_will_do(rows, deviation, says):
    assert says in enough(settings(*rows, deviation=deviation), 0.01)
