"""`fit_many` against the truth, against `fitting.fit`, and against itself elsewhere."""

from __future__ import annotations

import dataclasses

import haste
import jax
import numpy as np
import pytest
import skewed_lobe
import texel_samples
from scipy.optimize import least_squares

from data_formats import Channel, Measurement, MeasurementError
from fitting import Model, ModelError, fit, from_angles
from fitting.texels import TexelFits, fit_many
from fitting.texels.abreast import lanes

ANGLES = texel_samples.directions()
MODEL = "lambert + ggx"


@pytest.fixture(scope="module")
def sample() -> np.ndarray:
    clean = texel_samples.values_of(MODEL, texel_samples.truth(40), ANGLES)
    return texel_samples.noisy(clean)


def measurement(values: np.ndarray, sigma: np.ndarray | None = None) -> Measurement:
    known = np.isfinite(values)
    return Measurement(
        *ANGLES,
        value=np.where(known, values, 0.0),
        valid=known,
        channels=tuple(Channel(f"{k}") for k in range(values.shape[1])),
        sigma=sigma,
    )


def one_by_one(values: np.ndarray, model: str, sigma: np.ndarray | None = None, **settings):
    """What `fitting.fit` finds for a texel."""
    plain = {"energy": 0.0, "reciprocity": 0.0, "cross_validate": False}
    return fit(measurement(values, sigma), model, **plain, **settings)


def assert_same_fit(many: TexelFits, t: int, single) -> None:
    cost = float(many.cost[t])
    assert cost <= single.solver.cost * (1 + 1e-6)
    assert single.solver.cost <= cost * (1 + 1e-6)
    for p in single.parameters:
        found, error = many.parameters[p.name][t], many.uncertainties[p.name][t]
        value, known = (
            np.squeeze(p.value),
            np.squeeze(np.array(p.standard_uncertainty, float)),
        )
        loose = np.where(np.isfinite(known), known, np.abs(value))
        assert np.all(np.abs(np.squeeze(found) - value) <= 0.01 * loose + 1e-9), p.name
        both = np.isfinite(known) & np.isfinite(error)
        np.testing.assert_allclose(
            np.where(both, error, 1.0), np.where(both, known, 1.0), rtol=0.01
        )


def test_parameters_are_recovered_without_noise():
    truth = texel_samples.truth(50, seed=3)
    found = fit_many(texel_samples.values_of(MODEL, truth, ANGLES), ANGLES, MODEL)
    assert found.converged.all()
    for name, value in truth.items():
        np.testing.assert_allclose(found.parameters[name], value, rtol=1e-5)
    assert found.cost.max() < 1e-12
    assert (found.used == 60 * 3).all()


def test_the_fit_of_a_texel_is_that_of_fit(sample):
    found = fit_many(sample, ANGLES, MODEL)
    for t in (0, 7):
        assert_same_fit(found, t, one_by_one(sample[t], MODEL, objective="l2cos"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "settings"),
    [
        ("eon + ggx", {"objective": "l2cos"}),
        ("lambert + ggx(aniso)", {"objective": "l2"}),
        ("ggx", {"objective": "l2", "tie": {"ggx.f0": "0.04*ggx.f90"}}),
        (MODEL, {"objective": "l2cos", "bounds": {"lambert.albedo": (0.2, 0.3)}}),
        (MODEL, {"objective": "l2cos", "fix": {"ggx.alpha": 0.2}}),
    ],
)
def test_other_models_and_settings_agree_with_fit(sample, model, settings):
    found = fit_many(sample, ANGLES, model, **settings)
    assert found.converged.all()
    for t in (0, 5, 11):
        single = one_by_one(sample[t], model, **settings)
        assert found.cost[t] <= single.solver.cost * (1 + 1e-6)


def assert_agrees(many: TexelFits, t: int, single, rel: float = 1e-6) -> None:
    """Cost, values within their uncertainties, and these, also per channel."""
    assert many.cost[t] == pytest.approx(single.solver.cost, rel=rel)
    for p in single.parameters:
        found, error = many.parameters[p.name][t], many.uncertainties[p.name][t]
        value = np.broadcast_to(np.squeeze(p.value), found.shape)
        known = np.array(p.standard_uncertainty, float).squeeze()
        np.testing.assert_array_equal(np.isfinite(error), np.isfinite(known), p.name)
        some = np.isfinite(known)
        apart = np.abs(found - value)[some] / known[some]
        assert np.all(apart < 0.01), (p.name, apart)
        np.testing.assert_allclose(error[some], known[some], rtol=0.01, err_msg=p.name)


@pytest.mark.parametrize(
    "settings",
    [
        {"objective": "log1p"},
        pytest.param({"objective": "asinh", "weights": "rows"}, marks=pytest.mark.slow),
        pytest.param({"objective": "log1p", "robust": True}, marks=pytest.mark.slow),
        pytest.param(
            {"objective": "chi2", "noise": (0.02, 1e-3), "robust": True},
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"objective": "cbrt", "robust": True, "per_channel_shape": True},
            marks=pytest.mark.slow,
        ),
    ],
    ids=lambda s: " ".join(str(v) for v in s.values()),
)
def test_residuals_of_all_kinds_are_those_of_fit(sample, settings):
    """Also where values are missing and where some are wrong, if that is looked at."""
    values = sample[:12].copy()
    if settings.get("robust"):
        values[1, 5:20, 1] = np.nan
        values[2, ::9] *= 1.5
    found = fit_many(values, ANGLES, MODEL, **settings)
    assert found.converged.all()
    # The width of robust residuals follows from a fit that ended a little elsewhere.
    rel = 1e-4 if "robust" in settings else 1e-6
    for t in (0, 1, 2):
        assert_agrees(found, t, one_by_one(values[t], MODEL, **settings), rel)


@pytest.mark.slow
def test_an_albedo_above_1_is_penalised_as_in_fit():
    truth = texel_samples.truth(12)
    truth["lambert.albedo"] = truth["lambert.albedo"] + 0.5
    values = texel_samples.noisy(texel_samples.values_of(MODEL, truth, ANGLES))
    free = fit_many(values, ANGLES, MODEL)
    held = fit_many(values, ANGLES, MODEL, energy=1.0)
    assert held.converged.all()
    assert (held.cost > free.cost * 1.01).sum() > 3
    for t in range(0, 12, 3):
        single = fit(measurement(values[t]), MODEL, cross_validate=False, objective="l2cos")
        assert single.energy.active == (held.cost[t] != free.cost[t])
        assert_agrees(held, t, single)


def test_lobes_that_are_not_reciprocal_are_penalised_as_in_fit(monkeypatch):
    skewed_lobe.install(monkeypatch)
    truth = {
        "skewed.skew": np.full(3, 0.4),
        "skewed.albedo": np.random.default_rng(0).uniform(0.2, 0.6, (3, 3)),
    }
    values = texel_samples.noisy(texel_samples.values_of("skewed", truth, ANGLES))
    settings = {"objective": "l2cos", "energy": 0.0}
    found = fit_many(values, ANGLES, "skewed", reciprocity=10.0, **settings)
    free = fit_many(values, ANGLES, "skewed", reciprocity=0.0, **settings)
    assert (found.parameters["skewed.skew"] < 0.9 * free.parameters["skewed.skew"]).all()
    single = fit(
        measurement(values[1]), "skewed", cross_validate=False, reciprocity=10.0, **settings
    )
    assert_agrees(found, 1, single)


@pytest.mark.slow
def test_channels_without_light_and_noise_without_a_floor():
    """Everything 0 in a channel, half of the values 0, all of them 0, tiny, denormal."""
    texels = np.stack([sample_of_one()] * 5)
    texels[0, :, 0] = 0.0
    texels[1][np.random.default_rng(0).random((60, 3)) < 0.6] = 0.0
    texels[2] = 0.0
    texels[3] *= 1e-30
    texels[4, ::2] = 1e-310
    settings = {"objective": "chi2", "noise": (0.02, 0.0)}
    found = fit_many(texels, ANGLES, MODEL, **settings)
    assert found.converged.all()
    assert (found.used == 180).all()
    assert np.isnan(found.uncertainties["ggx.alpha"][2])
    single = one_by_one(texels[0], MODEL, **settings)
    assert single.solver.converged
    assert found.cost[0] == pytest.approx(single.solver.cost, rel=1e-6)
    for objective in ("asinh", "cbrt"):
        assert fit_many(texels, ANGLES, MODEL, objective=objective).converged.all()


def sample_of_one() -> np.ndarray:
    clean = texel_samples.values_of(MODEL, texel_samples.truth(1), ANGLES)
    return texel_samples.noisy(clean)[0]


def test_a_shape_at_its_bound_has_no_uncertainty(sample):
    settings = {"objective": "l2cos", "bounds": {"ggx.alpha": (0.1, 0.2)}}
    found = fit_many(sample[:6], ANGLES, MODEL, **settings)
    wide = fit_many(sample[:6], ANGLES, MODEL).parameters["ggx.alpha"]
    outside = (wide < 0.1) | (wide > 0.2)
    assert 0 < outside.sum() < 6
    np.testing.assert_array_equal(np.isnan(found.uncertainties["ggx.alpha"]), outside)


@pytest.mark.slow
def test_a_channel_that_is_not_known_leaves_the_others_alone(sample):
    values = sample[:3].copy()
    values[1, :, 1] = np.nan
    found = fit_many(values, ANGLES, MODEL, per_channel_shape=True)
    whole = fit_many(sample[:3], ANGLES, MODEL, per_channel_shape=True)
    assert found.converged.all()
    alpha = found.parameters["ggx.alpha"]
    assert np.isnan(alpha[1]).tolist() == [False, True, False]
    np.testing.assert_array_equal(alpha[:, ::2], whole.parameters["ggx.alpha"][:, ::2])
    assert found.cost[1] < whole.cost[1]
    one = fit_many(sample[:3, :, :1], ANGLES, MODEL, per_channel_shape=True)
    np.testing.assert_array_equal(one.parameters["ggx.alpha"], alpha[:, :1])


@pytest.mark.slow
def test_what_no_direction_sees_is_held_as_in_fit(sample):
    found = fit_many(sample[:2], ANGLES, "rough_dielectric")
    assert (found.parameters["rough_dielectric.transmitted"] == 1.0).all()


@pytest.mark.slow
def test_an_angle_is_told_within_its_period(sample):
    found = fit_many(sample[:8], ANGLES, "lambert + ggx(aniso)")
    angle = found.parameters["ggx.angle"]
    assert np.all((angle >= 0) & (angle < np.pi))


def test_weights_of_rows_count_as_in_fit(sample):
    weights = np.random.default_rng(0).uniform(0.0, 2.0, 60)
    found = fit_many(sample[:3], ANGLES, MODEL, weights=weights)
    single = one_by_one(sample[1], MODEL, objective="l2cos", weights=weights)
    assert_agrees(found, 1, single)


def test_scipy_finds_nothing_better(sample):
    """Of texels and starts drawn at random."""
    found = fit_many(sample, ANGLES, MODEL, objective="l2")

    model, geometry = Model(MODEL), from_angles(*ANGLES)

    @jax.jit
    def residual(z: jax.Array, y: jax.Array) -> jax.Array:
        kd, f0, f90 = z[1:].reshape(3, 3)
        names = ("ggx.alpha", "lambert.albedo", "ggx.f0", "ggx.f90")
        return (
            model(dict(zip(names, (z[0], kd, f0, f90), strict=True)), geometry) - y
        ).ravel()

    rng = np.random.default_rng(5)
    low = np.concatenate([[1e-4], np.zeros(9)])
    high = np.concatenate([[1.5], np.full(9, np.inf)])
    for t in rng.choice(40, 5, replace=False):
        start = np.concatenate([[rng.uniform(0.1, 0.3)], np.repeat([0.3, 0.1, 1.0], 3)])
        with jax.enable_x64(True):
            end = least_squares(
                lambda z, y: np.asarray(residual(z, y)), start, args=(sample[t],),
                bounds=(low, high), x_scale="jac",
            )  # fmt: skip
        assert found.cost[t] <= 2 * end.cost * (1 + 1e-6)


def test_unknown_values_are_left_out(sample):
    values = sample.copy()
    values[3, 5:20, 1] = np.nan
    values[9, ::7] = np.inf
    found = fit_many(values, ANGLES, MODEL, objective="l2")
    assert found.used[3] == 180 - 15
    assert found.used[9] == 180 - 27
    for t in (3, 9):
        assert_same_fit(found, t, one_by_one(values[t], MODEL, objective="l2"))
    known = np.isfinite(values)
    masked = fit_many(sample, ANGLES, MODEL, valid=known, objective="l2")
    np.testing.assert_array_equal(masked.cost, found.cost)


def test_texels_with_too_few_values_say_so(sample):
    values = sample.copy()
    values[0] = np.nan
    values[1, 2:] = np.nan
    values[2, :, 0] = np.nan
    found = fit_many(values, ANGLES, MODEL)
    assert not found.converged[:3].any()
    assert found.converged[3:].all()
    for v in (*found.parameters.values(), *found.uncertainties.values()):
        assert np.isnan(v[:3]).all()
    assert found.used[:3].tolist() == [0, 6, 120]


def test_known_uncertainties_count(sample):
    sigma = 0.02 * np.abs(sample) + 1e-3
    found = fit_many(sample, ANGLES, MODEL, sigma=sigma, objective="chi2")
    single = one_by_one(sample[4], MODEL, sigma[4], objective="chi2")
    assert_same_fit(found, 4, single)


def test_coefficients_are_never_negative():
    """Data that a negative albedo would explain better."""
    clean = texel_samples.values_of(MODEL, texel_samples.truth(30, seed=2), ANGLES)
    found = fit_many(clean - 0.2, ANGLES, MODEL)
    assert found.converged.all()
    assert min(found.parameters[n].min() for n in ("lambert.albedo", "ggx.f0")) == 0.0
    held = found.parameters["lambert.albedo"] == 0
    assert held.any()
    assert np.isnan(found.uncertainties["lambert.albedo"][held]).all()
    single = one_by_one(clean[2] - 0.2, MODEL, objective="l2cos")
    assert found.cost[2] == pytest.approx(single.solver.cost, rel=1e-6)


def test_fixed_and_tied_parameters_stay(sample):
    found = fit_many(
        sample, ANGLES, MODEL, fix={"ggx.f90": 1.0}, tie={"ggx.f0": "0.5*lambert.albedo"}
    )
    assert (found.parameters["ggx.f90"] == 1.0).all()
    assert np.isnan(found.uncertainties["ggx.f90"]).all()
    np.testing.assert_array_equal(
        found.parameters["ggx.f0"], 0.5 * found.parameters["lambert.albedo"]
    )


@pytest.fixture(
    params=[True, pytest.param(False, marks=pytest.mark.slow)],
    ids=["in haste", "as users do"],
)
def compiled(request: pytest.FixtureRequest):
    """Users have vectorised code, in which a texel's place could matter."""
    if request.param:
        yield
        return
    jax.clear_caches()
    with haste.compiling(in_haste=False):
        yield
    jax.clear_caches()


def test_neighbours_do_not_matter(compiled):
    """Bit for bit: in another order, without half of them, alone, with broken ones."""
    texels = 2 * lanes().batch + 100
    clean = texel_samples.values_of(MODEL, texel_samples.truth(texels), ANGLES)
    values = texel_samples.noisy(clean, 0.03)
    values[5::13, 8, 1] = np.nan
    all_of_them = fit_many(values, ANGLES, MODEL)
    order = np.random.default_rng(0).permutation(texels)
    broken = values.copy()
    broken[1::2, 2:] = np.nan
    for part, index in (
        (values[order], order),
        (values[::2], np.arange(0, texels, 2)),
        (values[700:701], np.array([700])),
    ):
        assert_bits(fit_many(part, ANGLES, MODEL), all_of_them, index)
    beside = fit_many(broken, ANGLES, MODEL)
    assert not beside.converged[1::2].any()
    for name, v in beside.parameters.items():
        np.testing.assert_array_equal(v[::2], all_of_them.parameters[name][::2])


def assert_bits(part: TexelFits, whole: TexelFits, index: np.ndarray) -> None:
    for f in dataclasses.fields(TexelFits):
        ours, theirs = getattr(part, f.name), getattr(whole, f.name)
        if not isinstance(ours, dict):
            ours, theirs = {f.name: ours}, {f.name: theirs}
        for name in ours:
            np.testing.assert_array_equal(ours[name], theirs[name][index], err_msg=name)


def test_two_axes_of_texels_and_any_number_type(sample):
    square = fit_many(sample.reshape(8, 5, 60, 3).astype(np.float32), ANGLES, MODEL)
    assert square.cost.shape == (8, 5)
    assert square.parameters["ggx.f0"].shape == (8, 5, 3)
    plain = fit_many(sample, ANGLES, MODEL)
    np.testing.assert_allclose(
        square.parameters["ggx.alpha"].ravel(), plain.parameters["ggx.alpha"], rtol=1e-4
    )


@pytest.mark.slow
def test_single_precision_first_ends_at_the_same(sample):
    plain = fit_many(sample, ANGLES, MODEL)
    quick = fit_many(sample, ANGLES, MODEL, single_first=True)
    assert quick.converged.all()
    np.testing.assert_allclose(quick.cost, plain.cost, rtol=1e-7)
    apart = quick.parameters["ggx.alpha"] - plain.parameters["ggx.alpha"]
    assert np.all(np.abs(apart) <= 0.01 * plain.uncertainties["ggx.alpha"])


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"values": np.ones((4, 60))}, MeasurementError, "expected (t, n, c)"),
        ({"values": np.ones((4, 61, 3))}, MeasurementError, "each (61,)"),
        ({"values": np.full((4, 60, 3), "x")}, MeasurementError, "expected numbers"),
        ({"valid": np.ones((4, 60))}, MeasurementError, "valid has the shape (4, 60)"),
        ({"objective": "l3"}, ModelError, "no objective 'l3'"),
        ({"objective": "chi2"}, ModelError, "go together: give both or neither"),
        ({"sigma": np.ones((4, 60, 3))}, ModelError, "go together: give both or neither"),
        ({"noise": (0.1, 0.0)}, ModelError, "go together: give both or neither"),
        ({"energy": "hard"}, ModelError, "found 'hard'"),
        ({"material": {"ggx": "Au"}}, ModelError, "no material"),
        ({"max_theta_deg": 1.0}, MeasurementError, "directions can be used; expected 4"),
        ({"colour": True}, ModelError, "no option colour"),
        ({"model": "lambert + gxx"}, ModelError, "did you mean 'ggx'"),
    ],
)
def test_bad_input_is_refused_in_words(change, error, words):
    given = {"values": np.ones((4, 60, 3)), "directions": ANGLES, "model": MODEL} | change
    with pytest.raises(error) as caught:
        fit_many(**given)
    assert words in str(caught.value)
