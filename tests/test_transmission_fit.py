"""Reflection and transmission fitted together: rows, weights, penalties, diagnostics."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest

import data_formats
from data_formats import Channel, Measurement, MeasurementError
from fitting import diagnostics, fit
from fitting.comparison import choose, compare, default_models
from fitting.conversion import resample
from fitting.expression import ModelError
from fitting.given import with_given
from fitting.model import Model
from fitting.options import FitOptions
from fitting.predict import predict
from fitting.refractive_index import refractive_index
from fitting.rows import select_rows, ways_of
from fitting.scoring import score
from fitting.solid_angle import solid_angle_weights
from fitting.unknowns import make_unknowns
from fitting.unseen import without_unseen

ALL = ("front", "down", "back", "up")
GLASS = {
    "lambert.albedo": [0.1, 0.2],
    "rough_dielectric.alpha": 0.3,
    "rough_dielectric.eta": 1.5,
    "rough_dielectric.reflected": [1.0, 0.9],
    "rough_dielectric.transmitted": [0.8, 0.7],
}
FOIL = {
    "lambert.albedo": [0.15, 0.3],
    "lambert_transmission.transmittance": [0.3, 0.2],
}
BOTH = "lambert + lambert_transmission"


def directions(ways, theta_i=(10.0, 40.0, 60.0)) -> np.ndarray:
    rows = []
    for way in ways:
        for i in np.radians(theta_i):
            for o in np.radians(np.arange(0.0, 81.0, 10.0)):
                for p in np.radians(np.arange(0.0, 181.0, 20.0)):
                    source = np.pi - i if way in ("back", "up") else i
                    detector = np.pi - o if way in ("back", "down") else o
                    rows.append((source, 0.0, detector, p))
    return np.array(rows).T


def measured(expression, values, ways, noise=0.0, **where) -> Measurement:
    angles = directions(ways, **where)
    own = {n: np.asarray(v) for n, v in values.items()}
    value = predict(expression, own, *angles).reshape(angles.shape[1], -1)
    factor = 1.0 + noise * np.random.default_rng(1).standard_normal(value.shape)
    return Measurement(
        *angles,
        value=value * factor,
        valid=np.ones(value.shape, dtype=bool),
        channels=tuple(Channel.at(450.0 + 100.0 * c) for c in range(value.shape[1])),
        symmetry="bilateral",
    )


@pytest.fixture(scope="module")
def glass():
    """Rough glass, seen from both sides, and its fit."""
    m = measured("lambert + rough_dielectric", GLASS, ALL, noise=0.01)
    return m, fit(m, "lambert + rough_dielectric", cross_validate=False, starts=3)


def test_one_width_and_index_for_what_is_reflected_and_transmitted(glass):
    _, result = glass
    for name, truth in GLASS.items():
        p = result.parameter(name)
        for value, sd, true in zip(
            p.value, p.standard_uncertainty, np.atleast_1d(truth), strict=True
        ):
            assert abs(value - true) < 5 * sd
    assert result.reciprocity.by_construction
    assert result.reciprocity.max_relative_difference < 1e-12
    assert result.data.left_out == []


def test_energy_is_that_of_both_hemispheres_for_light_from_either_side(glass):
    m, result = glass
    e = result.energy
    assert 0.0 < e.transmitted < e.max_albedo < 1.0
    sums = diagnostics.data_albedo(m)
    assert [round(np.degrees(a.theta_i)) for a in sums] == [10, 40, 60, 120, 140, 170]
    assert all(a.transmitted is not None and a.albedo > a.transmitted for a in sums)


def test_generalised_reciprocity_is_a_diagnostic_of_the_data(glass):
    m, result = glass
    found = result.data.reciprocity_transmitted
    assert found is not None
    assert found.relative_index == pytest.approx(1.5, abs=0.01)
    assert found.median_relative_difference < 0.02
    wrong = diagnostics.data_transmitted_reciprocity(m, 1.0)
    assert wrong is not None
    assert wrong[0] > 0.7
    assert diagnostics.data_transmitted_reciprocity(m.select(~m.from_back)) is None


def test_a_result_is_scored_and_converted_on_all_its_ways(glass):
    m, result = glass
    assert score(m, result).rows_used == m.n_rows
    assert set(ways_of(resample(result))) == set(ALL)


def test_rows_are_kept_for_the_ways_that_a_model_knows():
    m = measured(BOTH, FOIL, ("front", "down", "back"))
    third = m.n_rows // 3
    one = fit(m, "lambert", cross_validate=False)
    assert one.data.rows_used == third
    assert len(one.data.left_out) == 2
    assert any("transmitted rows" in s and "lambert_transmission" in s
               for s in one.data.left_out)  # fmt: skip
    assert any("reflected at the back" in s for s in one.data.left_out)
    with pytest.raises(MeasurementError, match="no row is left for the model"):
        select_rows(m.select(m.transmitted), 85.0, Model("ggx").ways)


def test_grazing_transmitted_rows_are_cut_off_like_reflected_ones():
    m = measured(BOTH, FOIL, ("down",), theta_i=(10.0, 80.0))
    rows = select_rows(m, 65.0, ("down",))
    steep = np.minimum(m.theta_r, np.pi - m.theta_r)
    kept = (np.degrees(steep) <= 65.001) & (np.degrees(m.theta_i) < 65)
    assert rows.index.size == np.count_nonzero(kept)


def test_both_sides_of_the_sample_weigh_alike():
    there, through = directions(("front",)), directions(("down",))
    weights = solid_angle_weights(*np.concatenate([there, through], axis=1))
    half = there.shape[1]
    np.testing.assert_allclose(weights[:half], weights[half:], rtol=1e-9)
    np.testing.assert_allclose(weights[:half], solid_angle_weights(*there), rtol=1e-9)


def test_two_files_are_one_sample(tmp_path):
    for way in ("front", "down"):
        data_formats.write(measured(BOTH, FOIL, (way,)), tmp_path / f"{way}.csv")
    both = data_formats.join(*(data_formats.read(tmp_path / f"{w}.csv") for w in
                               ("front", "down")))  # fmt: skip
    result = fit(both, BOTH, cross_validate=False)
    np.testing.assert_allclose(result.values["lambert.albedo"], FOIL["lambert.albedo"],
                               rtol=1e-6)  # fmt: skip
    np.testing.assert_allclose(
        result.values["lambert_transmission.transmittance"],
        FOIL["lambert_transmission.transmittance"], rtol=1e-6,
    )  # fmt: skip


def test_more_light_than_arrives_is_held_back_by_the_penalty_and_forbidden_by_hard():
    bright = {
        "lambert.albedo": [0.7, 0.4],
        "lambert_transmission.transmittance": [0.6, 0.5],
    }
    m = measured(BOTH, bright, ("front", "down"))
    free = fit(m, BOTH, cross_validate=False, energy=0.0)
    soft = fit(m, BOTH, cross_validate=False)
    hard = fit(m, BOTH, cross_validate=False, energy="hard")
    assert free.energy.max_albedo == pytest.approx(1.3, abs=1e-4)
    assert soft.energy.active
    assert 1.0 < soft.energy.max_albedo < 1.2
    assert hard.energy.max_albedo <= 1.0 + 1e-6
    np.testing.assert_allclose(hard.values["lambert.albedo"][1], 0.4, rtol=1e-5)
    assert [a for a in free.data.albedo if a.albedo > 1.0]


def test_hard_energy_counts_each_side_for_itself():
    model = Model("lambert + lambert(back) + lambert_transmission")
    with jax.enable_x64(True):
        unknowns = make_unknowns(model, 1, FitOptions(energy="hard"))
        rows = np.asarray(unknowns.rows)
    sums = {tuple(r) for r in rows if np.count_nonzero(r) > 1}
    assert sums == {(-1.0, 0.0, -1.0), (0.0, -1.0, -1.0)}


def test_what_no_row_sees_is_held_and_said():
    truth = Model("thin_slab").defaults() | {"thin_slab.reflected": 0.7}
    rows = select_rows(measured("thin_slab", truth, ("down",)), 85.0, ("down",))
    model = Model("lambert + ggx(back) + thin_slab")
    with jax.enable_x64(True):
        options, words = without_unseen(rows, model, FitOptions(fix={"ggx.f90": 1.0}))
    assert options.fix == {
        "lambert.albedo": 0.0, "ggx.alpha": 0.2, "ggx.f0": 0.0, "ggx.f90": 1.0,
        "thin_slab.reflected": 1.0,
    }  # fmt: skip
    assert [w.partition(" ")[0] for w in words] == ["lambert", "ggx", "thin_slab.reflected"]
    with jax.enable_x64(True):
        assert without_unseen(rows, model, options)[1] == []


def test_what_is_held_keeps_to_the_users_bounds_and_ties():
    values = {"lambert.albedo": 0.4}
    rows = select_rows(measured("lambert", values, ("front",)), 85.0, ("front",))
    bounds = {"thin_slab.transmitted": (0.0, 0.5)}
    with jax.enable_x64(True):
        held, _ = without_unseen(rows, Model("thin_slab"), FitOptions(bounds=bounds))
        assert held.fix["thin_slab.transmitted"] == 0.5
        assert held.bounds == {}
        make_unknowns(Model("thin_slab"), 1, held)
        tie = {"lambert.albedo": "lambert_transmission.transmittance"}
        free, words = without_unseen(rows, Model(BOTH), FitOptions(tie=tie))
    assert (free.fix, words) == ({}, [])


@pytest.mark.slow
def test_lobes_that_disagree_on_the_media_are_told_and_penalised():
    expression = "lambert_transmission + rough_dielectric"
    values = {n: v for n, v in GLASS.items() if n != "lambert.albedo"}
    values["lambert_transmission.transmittance"] = [0.1, 0.1]
    m = measured(expression, values, ("down",), theta_i=(20.0,))
    known = {"rough_dielectric.eta": 1.5, "rough_dielectric.alpha": 0.3}
    result = fit(m, expression, cross_validate=False, starts=1, fix=known)
    assert not result.reciprocity.by_construction
    assert result.reciprocity.weight == 1.0
    assert any("disagree on the media" in s for s in result.identifiability)


def test_the_common_models_follow_the_light_that_was_measured():
    def models(*ways: str) -> tuple[str, ...]:
        return default_models(measured(BOTH, FOIL, ways, theta_i=(20.0,)))

    assert models("front") == default_models(measured("lambert", {"lambert.albedo": 0.5},
                                                      ("front",)))  # fmt: skip
    assert all("transmission" in m or "slab" in m for m in models("down"))
    assert not any(
        "lambert +" in m.split("lambert_transmission")[0] for m in models("down")
    )
    for m in models(*ALL):
        assert {"front", "back", "down"} <= set(Model(m).ways)
    assert "lambert(back)" in models("back")[0]


def test_models_on_different_rows_are_not_compared_by_their_errors():
    m = measured(BOTH, FOIL, ("front", "down"))
    found = compare(m, ["lambert", BOTH])
    assert found.best == 1
    assert "different rows" in choose(found.results)[1]


def test_an_index_is_that_of_one_medium_in_another(tmp_path):
    table = tmp_path / "glass.csv"
    table.write_text("400, 1.53\n700, 1.51\n")
    index = refractive_index(f"{table} in 1.33", np.array([400.0, 550.0]))
    np.testing.assert_allclose(index.eta, np.array([1.53, 1.52]) / 1.33)
    assert index.source == f"{table} in 1.33"
    with pytest.raises(ModelError, match="above 0"):
        refractive_index("1.5 in -1", np.array([400.0]))
    m = measured("rough_dielectric", Model("rough_dielectric").defaults(), ("down",))
    wanted = FitOptions(material={"rough_dielectric": "1.5 in 1.25"})
    known = with_given(
        replace(m, channels=(Channel.at(500.0),)), Model("rough_dielectric"), wanted
    )
    assert known.fix["rough_dielectric.eta"] == pytest.approx(1.2)


def test_the_solid_angle_that_a_file_states_goes_before_what_rings_tell():
    m = measured(BOTH, FOIL, ("front", "down"), theta_i=(10.0,))
    steep = np.minimum(m.theta_r, np.pi - m.theta_r)
    share = np.cos(steep) * np.sin(steep)
    own = np.pi * share / share[~m.transmitted].sum()
    stated = replace(m, auxiliary={"projected_solid_angle": own})
    (found,) = diagnostics.data_albedo(stated)
    assert found.covered == pytest.approx(1.0, abs=1e-9)
    assert found.albedo == pytest.approx(0.3 + 0.2, abs=1e-9)
    assert found.transmitted == pytest.approx(0.2, abs=1e-9)


def test_one_pair_of_directions_is_evaluated_in_double_precision():
    values = Model("rough_dielectric").defaults()
    into = np.radians([30.0, 0.0, 155.0, 170.0])
    there, back = (
        predict("rough_dielectric", values, *into[order])
        for order in ([0, 1, 2, 3], [2, 3, 0, 1])
    )
    assert there.shape == ()
    assert there.dtype == np.float64
    assert float(there / back) == pytest.approx(1.5**2, rel=1e-13)


def test_a_real_fabric_measured_from_both_sides(real_data):
    """Woven screen, Klems patches, all four ways of light: what is diffuse of it."""
    m = data_formats.read(real_data / "radiance/2011-SA1.XML")
    model = "lambert + lambert(back) + lambert_transmission"
    result = fit(m, model, cross_validate=False, objective="l2cos", weights="rows")
    sums = {round(np.degrees(a.theta_i)): a for a in diagnostics.data_albedo(m)}
    assert set(ways_of(m)) == set(ALL)
    for angle, name in ((40, "lambert1.albedo"), (140, "lambert2.albedo")):
        reflected = sums[angle].albedo - sums[angle].transmitted
        assert result.values[name].max() == pytest.approx(reflected, rel=0.15)
    through = result.values["lambert_transmission.transmittance"].max()
    assert through == pytest.approx(sums[40].transmitted, rel=0.3)
    assert 0.5 < result.energy.max_albedo < 0.8
    assert result.data.reciprocity_transmitted is not None
