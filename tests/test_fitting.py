"""The fit as users call it: constraints, options, results."""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
import sys

import jax
import jax.numpy as jnp
import jsonschema
import msgspec
import numpy as np
import pytest
import synthetic

import fitting
from data_formats import MeasurementError
from fitting import ModelError, ResultError, fit, from_angles, json_schema, load_result
from fitting.model import Model
from fitting.result import SCHEMA_VERSION

TRUTH = {
    "lambert.albedo": np.array([0.3, 0.2, 0.1]),
    "ggx.alpha": 0.25,
    "ggx.f0": np.full(3, 0.04),
    "ggx.f90": np.ones(3),
}


@pytest.fixture(scope="module")
def paint():
    return synthetic.measurement(
        "lambert + ggx", TRUTH, relative=0.01, absolute=1e-4, seed=1
    )


@pytest.fixture(scope="module")
def result(paint):
    return fit(paint, "lambert + ggx")


def test_truth_lies_within_four_standard_uncertainties(result):
    for name, truth in TRUTH.items():
        p = result.parameter(name)
        value, sd = np.array(p.value), np.array(p.standard_uncertainty, dtype=float)
        assert np.all(np.abs(value - truth) < 4 * sd), name
        assert np.all(sd < 0.2 * np.abs(value))
        for v, s, (low, high) in zip(value, sd, p.interval_95, strict=True):
            assert low < v < high
            assert high - low > 2 * 1.95 * s


def test_result_says_what_a_user_asks(result, paint):
    assert result.solver.converged
    assert "starts agree" in result.solver.sentence
    assert result.energy.max_albedo < 1
    assert not result.energy.active
    assert result.reciprocity.by_construction
    assert result.reciprocity.max_relative_difference < 1e-12
    assert [a.rows for a in result.by_angle] == [181] * 5
    assert len(result.cross_validation.by_angle) == 5
    assert result.data.rows == result.data.rows_used == paint.n_rows
    # 1 % of noise on f cos of at most a few: the error is of that order.
    assert result.scores.log1p < 0.01


def test_printing_a_result_shows_values_with_uncertainties(result):
    text = str(result)
    assert "lambert + ggx, 3 channels" in text
    alpha = result.parameter("ggx.alpha")
    assert f"{alpha.value[0]:.3f}" in text
    assert text.count("±") == 10
    assert "starts agree" in text


def test_json_round_trip_is_exact_and_valid(result, tmp_path):
    path = tmp_path / "paint.fit.json"
    result.save(path)
    again = load_result(path)
    assert again == result
    jsonschema.validate(json.loads(path.read_text()), json_schema())
    angles = np.random.default_rng(0).uniform(0, 1.5, (4, 300))
    np.testing.assert_array_equal(again.evaluate(*angles), result.evaluate(*angles))
    assert list(tmp_path.iterdir()) == [path]
    assert "NaN" not in path.read_text()
    assert "Infinity" not in path.read_text()


def test_committed_schema_is_the_current_one():
    from importlib.resources import files

    committed = json.loads(files("fitting").joinpath("fit_result.schema.json").read_text())
    assert committed == json_schema()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "not JSON"),
        (b"{}", "schema_version is None"),
        (b'{"schema_version": 99}', "schema_version is 99"),
        (b'{"schema_version": %d, "model": 3}' % SCHEMA_VERSION, "expected a result"),
        (b"\xff\xfe\x00", "not JSON"),
        (b"[" * 100_000, "not JSON"),
    ],
)
def test_a_file_that_is_no_result_is_answered_in_one_sentence(tmp_path, content, said):
    path = tmp_path / "x.json"
    path.write_bytes(content)
    with pytest.raises(ResultError, match=said):
        load_result(path)
    with pytest.raises(ResultError, match="No such file"):
        load_result(tmp_path / "missing.json")


def test_a_number_that_json_cannot_hold_is_never_written(result, tmp_path):
    bad = msgspec.structs.replace(
        result, scores=msgspec.structs.replace(result.scores, l2=math.nan)
    )
    with pytest.raises(ResultError, match=r"scores\.l2 is nan"):
        bad.save(tmp_path / "x.json")
    assert not list(tmp_path.iterdir())


def test_fix_bounds_and_tie(paint):
    r = fit(
        paint, "lambert + ggx", cross_validate=False,
        fix={"lambert.albedo": TRUTH["lambert.albedo"]},
        bounds={"ggx.alpha": (0.01, 0.2)}, tie={"ggx.f0": "0.04*ggx.f90"},
    )  # fmt: skip
    albedo, f0, f90, alpha = (
        r.parameter(n) for n in ("lambert.albedo", "ggx.f0", "ggx.f90", "ggx.alpha")
    )
    assert albedo.fixed
    assert albedo.value == [0.3, 0.2, 0.1]
    assert albedo.standard_uncertainty == [None] * 3
    assert f0.tied_to == "ggx.f90"
    np.testing.assert_allclose(f0.value, 0.04 * np.array(f90.value), rtol=1e-12)
    assert alpha.at_bound == [True]
    assert alpha.value[0] == pytest.approx(0.2, rel=1e-3)
    assert alpha.standard_uncertainty == [None]
    assert any("ggx.alpha is at a bound" in s for s in r.identifiability)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"fix": {"ggx.alfa": 1.0}}, "no parameter 'ggx.alfa'"),
        ({"fix": {"ggx.alpha": 7.0}}, "outside"),
        ({"fix": {"ggx.f0": np.ones(2)}}, "one per channel"),
        ({"fix": {"ggx.f0": math.nan}}, "finite"),
        ({"bounds": {"ggx.alpha": (0.3, 0.2)}}, "leave nothing"),
        ({"bounds": {"ggx.f0": (1.0, 0.0)}}, "low < high"),
        ({"tie": {"ggx.f0": "2 ggx.f90"}}, "not 'other'"),
        ({"tie": {"ggx.f0": "ggx.alpha"}}, "cannot be tied"),
        ({"tie": {"ggx.f0": "ggx.f0"}}, "itself"),
        ({"tie": {"ggx.f0": "-1*ggx.f90"}}, "factor above 0"),
        ({"tie": {"ggx.f0": 3}}, "expected 'factor"),
        ({"tie": {"ggx.f0": "ggx.f90"}, "fix": {"ggx.f0": 0.1}}, "both fixed and tied"),
        ({"bounds": {"ggx.f0": (0, 1)}, "fix": {"ggx.f0": 0.1}}, "cannot have bounds"),
        ({"bounds": {"ggx.f0": 3.0}}, "expected .low, high."),
        ({"fix": {"ggx.f0": -1.0}}, "outside"),
        ({"fix": {"ggx.f0": "a"}}, "finite"),
        ({"fix": None}, "a mapping"),
        ({"energy": "soft"}, "or 'hard'"),
        ({"energy": math.nan}, "or 'hard'"),
        ({"energy": "hard", "fix": {"lambert.albedo": 1.2}}, "at least 1.2"),
        ({"max_theta_deg": math.nan}, "up to 90"),
        ({"noise": (0.0, 0.0)}, "not both 0"),
        ({"weights": "foo"}, "'rows'"),
        ({"starts": 1.5}, "whole number"),
        ({"foo": 1}, "no option foo"),
        ({"objective": "l3"}, "no objective 'l3'"),
    ],
)
def test_senseless_options_name_the_parameter(paint, settings, said):
    with pytest.raises(ModelError, match=said):
        fit(paint, "lambert + ggx", **settings)


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("lambert + gxx", "did you mean 'ggx'"),
        ("lambert +", "no lobe"),
        ("0*ggx", "use 1 to 8"),
        ("ggx(shiny)", "no option 'shiny'"),
        ("lambert(aniso)", "no option 'aniso'"),
        ("", "no lobe"),
    ],
)
def test_senseless_expressions_name_the_part(expression, said):
    with pytest.raises(ModelError, match=said):
        Model(expression)


def test_energy_penalty_and_hard_limit():
    """A white surface, mis-calibrated by 10 %: shown, pulled, or made impossible."""
    white = synthetic.measurement(
        "lambert + ggx",
        {"lambert.albedo": np.array([1.02, 0.6]), "ggx.alpha": 0.3, "ggx.f0": 0.08},
        relative=0.01,
    )
    free = fit(white, "lambert + ggx", energy=0.0, cross_validate=False)
    soft = fit(white, "lambert + ggx", energy=10.0, cross_validate=False)
    hard = fit(white, "lambert + ggx", energy="hard", cross_validate=False)
    assert free.energy.max_albedo > 1.1
    assert free.energy.constraint == "none"
    assert soft.energy.active
    assert 1.0 < soft.energy.max_albedo < 0.5 * (1 + free.energy.max_albedo)
    assert hard.energy.max_albedo <= 1.0 + 1e-9
    assert hard.energy.constraint == "hard"
    top = sum(
        np.maximum.reduce([np.array(hard.parameter(n).value) for n in group])
        for group in (["lambert.albedo"], ["ggx.f0", "ggx.f90"])
    )
    assert np.all(top <= 1 + 1e-9)
    assert free.solver.cost < soft.solver.cost < hard.solver.cost
    # The penalty is no measurement: it does not make the albedo any better known.
    assert any("penalty holds the fit" in s for s in soft.identifiability)
    held, known = (
        r.parameter("lambert.albedo").standard_uncertainty[0] for r in (soft, free)
    )
    assert held is not None
    assert known is not None
    assert held > 0.7 * known


def test_a_penalty_that_does_not_bind_changes_nothing(paint, result):
    off = fit(paint, "lambert + ggx", energy=0.0)
    assert off.parameters == result.parameters


def test_robust_fit_ignores_outliers(paint):
    value = paint.value.copy()
    wrong = np.random.default_rng(5).choice(paint.n_rows, 30, replace=False)
    value[wrong] += 3.0
    spoilt = dataclasses.replace(paint, value=value)
    plain = fit(spoilt, "lambert + ggx", cross_validate=False)
    robust = fit(spoilt, "lambert + ggx", cross_validate=False, robust=True)

    def off(r):
        return abs(r.parameter("lambert.albedo").value[0] - 0.3)

    assert off(robust) < 0.005 < off(plain)


def test_shape_per_channel_is_the_fit_of_each_channel_alone(paint):
    own = fit(paint, "lambert + ggx", per_channel_shape=True, cross_validate=False)
    assert len(own.parameter("ggx.alpha").value) == 3
    for c in range(3):
        alone = dataclasses.replace(
            paint,
            value=paint.value[:, c : c + 1],
            valid=paint.valid[:, c : c + 1],
            channels=paint.channels[c : c + 1],
        )
        single = fit(alone, "lambert + ggx", cross_validate=False)
        for p in own.parameters:
            assert p.value[c] == pytest.approx(single.parameter(p.name).value[0], rel=1e-6)
    angles = [a[:40] for a in (paint.theta_i, paint.phi_i, paint.theta_r, paint.phi_r)]
    assert own.evaluate(*angles).shape == (40, 3)


def test_chi2_uses_the_sigma_of_the_data():
    m = synthetic.measurement(
        "lambert + ggx", TRUTH, relative=0.03, absolute=1e-3, sigma=True, seed=3
    )
    r = fit(m, "lambert + ggx", cross_validate=False)
    assert r.settings.objective == "chi2"
    assert r.scores.chi2_reduced == pytest.approx(1.0, abs=0.1)


def test_score_without_fitting_repeats_the_scores(paint, result):
    again = fitting.score(paint, result)
    assert again.scores == result.scores
    assert again.by_angle == result.by_angle
    other = dataclasses.replace(paint, channels=paint.channels[::-1])
    with pytest.raises(ModelError, match="must be the same"):
        fitting.score(other, result)


def test_data_without_a_row_to_fit():
    transmitted = synthetic.measurement("lambert", {}, angles=synthetic.directions(rings=4))
    transmitted = dataclasses.replace(transmitted, theta_r=np.pi - transmitted.theta_r)
    with pytest.raises(MeasurementError, match="no row is left for the model"):
        fit(transmitted.select(transmitted.theta_r > 1.7), "lambert")


def test_compare_keeps_the_smaller_model_when_the_larger_predicts_no_better(paint):
    out = fitting.compare(paint, ("lambert + ggx", "lambert + 2*ggx"))
    assert out.results[out.best].model == "lambert + ggx"
    assert "lambert + ggx" in out.reason


def test_gradient_of_a_loss_through_the_model_in_user_code(result):
    """In plain float32 JAX, against a finite difference in float64."""
    model = Model(result.model)
    geometry = from_angles(*np.random.default_rng(2).uniform(0.1, 1.3, (4, 64)))
    values = {n: jnp.asarray(v, dtype=jnp.float32) for n, v in result.values.items()}

    def loss(parameters):
        return jnp.mean(model(parameters, geometry) ** 2)

    gradient = jax.jit(jax.grad(loss))(values)
    assert gradient["ggx.alpha"].dtype == jnp.float32
    with jax.enable_x64(True):
        wide = {n: jnp.asarray(v) for n, v in result.values.items()}
        step = 1e-6
        up = loss(wide | {"ggx.alpha": wide["ggx.alpha"] + step})
        down = loss(wide | {"ggx.alpha": wide["ggx.alpha"] - step})
        difference = float((up - down) / (2 * step))
    assert float(gradient["ggx.alpha"]) == pytest.approx(difference, rel=1e-3)
    many = jax.vmap(lambda a: loss(values | {"ggx.alpha": a}))(jnp.array([0.1, 0.2]))
    assert many.shape == (2,)


def test_importing_configures_nothing_and_loads_no_jax():
    code = (
        "import sys, fitting, data_formats\n"
        "assert 'jax' not in sys.modules\n"
        "from fitting import fit\n"
        "import jax\n"
        "assert not jax.config.jax_enable_x64\n"
        "import fitting.fitter, fitting.scoring, fitting.comparison\n"
        "from fitting import fit, score, compare\n"
        "assert callable(fit) and callable(score) and callable(compare)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_everything_linear_fixed_or_everything_fixed(paint):
    linear = {"lambert.albedo": TRUTH["lambert.albedo"], "ggx.f0": 0.04, "ggx.f90": 1.0}
    r = fit(paint, "lambert + ggx", fix=linear)
    assert r.parameter("ggx.alpha").value[0] == pytest.approx(0.25, rel=0.01)
    assert r.parameter("ggx.alpha").standard_uncertainty[0] > 0
    r = fit(paint, "lambert + ggx", fix=linear | {"ggx.alpha": 0.25})
    assert r.solver.converged
    assert all(p.fixed for p in r.parameters)


def test_an_empty_end_of_bounds_is_the_end_of_the_support(paint):
    dark = dataclasses.replace(paint, value=paint.value - 0.15)
    r = fit(
        dark, "lambert + ggx", bounds={"lambert.albedo": (-math.inf, 0.5)},
        cross_validate=False,
    )  # fmt: skip
    assert min(r.parameter("lambert.albedo").value) == 0.0
    r = fit(
        dark, "lambert + ggx", bounds={"lambert.albedo": (-1.0, 0.5)}, cross_validate=False
    )
    assert min(r.parameter("lambert.albedo").value) < -0.1


def test_fewer_values_than_parameters_is_not_certainty(paint):
    for rows, model in (([100], "lambert"), ([100, 200], "lambert + ggx")):
        r = fit(paint.select(np.array(rows)), model, cross_validate=False)
        for p in r.parameters:
            assert p.standard_uncertainty == [None] * len(p.value)
        assert any("nothing is left over" in s for s in r.identifiability)


def test_no_influence_is_not_certainty(paint):
    r = fit(
        dataclasses.replace(paint, value=np.zeros_like(paint.value)), "lambert + ggx",
        cross_validate=False,
    )  # fmt: skip
    assert r.parameter("ggx.alpha").standard_uncertainty == [None]
    assert any(s.startswith("ggx.alpha has no uncertainty") for s in r.identifiability)
    assert json.loads(r.to_json())


def test_a_channel_without_a_valid_value_says_so(paint):
    valid = paint.valid.copy()
    valid[:, 1] = False
    r = fit(dataclasses.replace(paint, valid=valid), "lambert + ggx", cross_validate=False)
    assert any("500 nm has no valid value" in s for s in r.identifiability)
    assert r.by_channel[1].rms is None
    assert r.parameter("ggx.f90").standard_uncertainty[1] is None
    assert r.parameter("ggx.f90").standard_uncertainty[0] is not None


def test_a_dark_channel_does_not_spoil_the_others_where_noise_has_no_floor(paint):
    value = paint.value.copy()
    value[:, 1] = 0.0
    dark = dataclasses.replace(paint, value=value)
    options = {"objective": "chi2", "noise": (0.02, 0.0), "cross_validate": False}
    r = fit(dark, "lambert + ggx", **options)
    assert r.solver.converged
    assert r.parameter("lambert.albedo").value[1] == 0.0
    alone = fit(paint, "lambert + ggx", **options)
    assert r.parameter("ggx.alpha").value[0] == pytest.approx(
        alone.parameter("ggx.alpha").value[0], rel=0.01
    )


def test_scattered_angles_of_incidence_are_put_together_by_degrees():
    rng = np.random.default_rng(1)
    angles = (
        rng.uniform(0, 1.4, 1500), np.zeros(1500), rng.uniform(0, 1.4, 1500),
        rng.uniform(0, np.pi, 1500),
    )  # fmt: skip
    m = synthetic.measurement("lambert + ggx", TRUTH, relative=0.01, angles=angles)
    r = fit(m, "lambert + ggx")
    assert len(r.by_angle) <= 90
    assert len(r.cross_validation.by_angle) == 10
    assert r.parameter("ggx.alpha").value[0] == pytest.approx(0.25, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["asinh", "chi2", "log1p"])
def test_the_truth_lies_in_the_95_percent_interval_as_often_as_it_should(objective):
    """400 seeds of 1 % multiplicative noise; every parameter, 99 % binomial band.

    With log1p a few bright rows decide about a parameter; with so few degrees of freedom
    the intervals are wider than they need be, so that only the lower end is asserted.
    """
    from scipy.stats import binom

    seeds = 400
    low, high = binom.interval(0.99, seeds, 0.95)
    high = seeds if objective == "log1p" else high
    inside = {n: np.zeros(np.size(v)) for n, v in TRUTH.items()}
    noise = (0.01, 0.0) if objective == "chi2" else None
    for seed in range(seeds):
        m = synthetic.measurement("lambert + ggx", TRUTH, relative=0.01, seed=seed)
        r = fit(
            m, "lambert + ggx", objective=objective, noise=noise, starts=1,
            cross_validate=False,
        )  # fmt: skip
        for name, truth in TRUTH.items():
            truth = np.broadcast_to(truth, inside[name].shape)
            for c, interval in enumerate(r.parameter(name).interval_95):
                assert interval is not None
                inside[name][c] += interval[0] <= truth[c] <= interval[1]
    for name, count in inside.items():
        assert np.all((low <= count) & (count <= high)), (name, count)
