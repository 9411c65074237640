"""Residuals, albedos, spectra, correlations and starts as they are drawn."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from made_up_results import RELATIVE_UNCERTAINTY

from fitting.plots import NoFigure, draw
from fitting.plots.style import around_zero, channel_colours


def lines(axes, label: str) -> list:
    return [line for line in axes.lines if line.get_label() == label]


def test_residuals_are_in_units_of_sigma(matt, drawn):
    axes = drawn("matt", "residuals").axes
    (points,) = lines(axes[0], "mono")
    expected = (0.22 / math.pi - matt.data.value[:, 0]) / 0.002
    np.testing.assert_allclose(np.sort(points.get_ydata()), np.sort(expected), rtol=1e-9)
    (median,) = lines(axes[2], "median")
    np.testing.assert_allclose(median.get_ydata(), np.median(expected), rtol=1e-9)
    assert axes[0].get_ylim()[0] == -axes[0].get_ylim()[1]


def test_residuals_without_sigma_are_relative_to_both(paint):
    brighter = [
        msgspec.structs.replace(p, value=[1.5 * v for v in p.value])
        if p.kind == "coefficient" else p
        for p in paint.result.parameters
    ]  # fmt: skip
    result = msgspec.structs.replace(paint.result, parameters=brighter)
    figure = draw("residuals", result, paint.data)
    top = figure.axes[0]
    (median,) = lines(top, "median")
    # 2 (1.5 - 1) / (1.5 + 1), but for the Fresnel term's 1 - f0 and the noise.
    np.testing.assert_allclose(np.median(median.get_ydata()), 40.0, atol=0.5)
    heat = [c for axes in figure.axes for c in axes.collections
            if c.get_cmap().name == "RdBu_r" and c.get_array() is not None]  # fmt: skip
    low, high = heat[0].get_clim()
    assert low == -high < 0


def test_angles_from_the_mirror_direction(paint, drawn):
    axes = drawn("paint", "residuals").axes[0]
    drawn = np.concatenate([li.get_xdata() for li in lines(axes, "550 nm")])
    m = paint.data
    wo = np.array([np.sin(m.theta_r) * np.cos(m.phi_r), np.sin(m.theta_r) * np.sin(m.phi_r),
                   np.cos(m.theta_r)])  # fmt: skip
    mirror = np.array([-np.sin(m.theta_i), 0 * m.theta_i, np.cos(m.theta_i)])
    expected = np.degrees(np.arccos(np.clip(np.sum(wo * mirror, axis=0), -1, 1)))
    np.testing.assert_allclose(np.sort(drawn), np.sort(expected), atol=1e-5)


def test_albedo_of_matt_surfaces_and_the_energy_limit(drawn):
    front, back, *coverage = drawn("leaf", "albedo").axes
    for axes in (front, back):
        for name, value in (("reflected", 0.4), ("transmitted", 0.3), ("together", 0.7)):
            (curve,) = lines(axes, f"{name}, G")
            np.testing.assert_allclose(curve.get_ydata(), value, rtol=1e-6)
            (sums,) = lines(axes, f"sum of the data, {name}, G")
            np.testing.assert_allclose(sums.get_ydata(), value, rtol=0.02)
            np.testing.assert_allclose(sums.get_xdata(), [10.0, 50.0], atol=1e-6)
        (limit,) = lines(axes, "energy limit")
        assert list(limit.get_ydata()) == [1.0, 1.0]
        assert axes.get_ylim()[1] > 1.0
    for axes in coverage:
        covered = np.concatenate([li.get_ydata() for li in lines(axes, "covered")])
        assert np.all((covered > 0.9) & (covered <= 1.0 + 1e-9))


def test_albedo_says_why_there_are_no_sums(paint):
    few = paint.data.select(np.abs(np.sin(paint.data.phi_r)) < 1e-6)
    figure = draw("albedo", paint.result, few)
    assert any("no sums of the data" in text.get_text() for text in figure.texts)


def test_spectrum_holds_values_and_intervals(paint, drawn):
    figure = drawn("paint", "spectrum")
    by_title = {axes.get_title(loc="left"): axes for axes in figure.axes}
    assert set(by_title) >= {"lambert.albedo", "ggx1.f0", "ggx2.f90"}
    axes = by_title["lambert.albedo"]
    (line,) = lines(axes, "lambert.albedo")
    value = np.array(paint.result.parameter("lambert.albedo").value)
    np.testing.assert_array_equal(line.get_ydata(), value)
    np.testing.assert_array_equal(line.get_xdata(), np.arange(400.0, 701.0, 50.0))
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert band.max() == pytest.approx(value.max() * (1 + 2 * RELATIVE_UNCERTAINTY))
    assert band.min() == pytest.approx(value.min() * (1 - 2 * RELATIVE_UNCERTAINTY))
    assert any("ggx1.alpha 0.0800 ± 0.0024" in t.get_text() for t in figure.texts)


def test_spectrum_marks_what_has_no_interval(leaf):
    changed = msgspec.structs.replace(
        leaf.result.parameters[0], at_bound=[True, False, False],
        interval_95=[None, (0.1, 0.5), None],
        standard_uncertainty=[None, 0.1, None],
    )  # fmt: skip
    result = msgspec.structs.replace(
        leaf.result, parameters=[changed, *leaf.result.parameters[1:]]
    )
    figure = draw("spectrum", result)
    marks = [
        (li.get_marker(), li.get_xdata().size) for li in lines(figure.axes[0], "_values")
    ]
    assert marks == [("o", 1), ("o", 1), ("s", 1)]
    labels = [t.get_text() for t in figure.legends[0].get_texts()]
    assert "at a bound, no interval" in labels
    assert "not determined, no interval" in labels


def test_correlations_are_those_of_the_result(paint):
    figure = draw("correlations", paint.result, channels=("450 nm", "700 nm"))
    images = [axes.images[0] for axes in figure.axes if axes.images]
    for image, c in zip(images, (1, 6), strict=True):
        np.testing.assert_array_equal(
            image.get_array(), paint.result.correlations.matrices[c]
        )
        assert image.get_clim() == (-1.0, 1.0)


def test_correlations_that_are_not_known_are_crossed_out(leaf):
    known = leaf.result.correlations
    matrix = [[1.0, None, 0.2], [None, None, None], [0.2, None, 1.0]]
    result = msgspec.structs.replace(
        leaf.result,
        correlations=msgspec.structs.replace(known, matrices=[matrix] * 3),
    )
    axes = draw("correlations", result).axes[0]
    assert axes.images[0].get_array().mask.sum() == 5
    assert len(lines(axes, "_none")) == 5


def test_starts_are_counted(paint, drawn):
    left, right = drawn("paint", "starts").axes
    (agreeing,), (elsewhere,) = lines(left, "agreeing"), lines(left, "elsewhere")
    assert (agreeing.get_xdata().size, elsewhere.get_xdata().size) == (6, 2)
    (other,) = lines(right, "next")
    assert other.get_xdata()[0] == pytest.approx(0.25)
    alone = msgspec.structs.replace(
        paint.result,
        solver=msgspec.structs.replace(paint.result.solver, runner_up_cost_ratio=None),
    )
    assert not lines(draw("starts", alone).axes[1], "next")


def test_nothing_was_free(leaf):
    none = msgspec.structs.replace(leaf.result.correlations, names=[], matrices=[])
    with pytest.raises(NoFigure, match="no parameter was free"):
        draw("correlations", msgspec.structs.replace(leaf.result, correlations=none))


def test_diverging_limits():
    assert (around_zero(np.array([-1.0, 3.0])).vmin, around_zero(np.zeros(2)).vmax) == (
        pytest.approx(-2.96), 1.0
    )  # fmt: skip


def test_colours_of_channels():
    red, green, blue = channel_colours(["R", "G", "B"], [None] * 3)
    # Okabe and Ito 2008: vermillion, bluish green, blue.
    assert (red, green, blue) == ("#D55E00", "#009E73", "#0072B2")
    assert channel_colours(["a", "b", "c"], [600.0, 500.0, 450.0]) == [red, green, blue]
