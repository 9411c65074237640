"""What is drawn are the values of the data and of the model."""

from __future__ import annotations

import math

import numpy as np
import pytest
from made_up_results import result_of

from data_formats import Channel, Measurement
from fitting.plots import draw
from fitting.sample import sample_path


def lines(axes, label: str) -> list:
    return [line for line in axes.lines if line.get_label() == label]


def file_rows() -> np.ndarray:
    """The numbers of the bundled file, read without this program's reader."""
    text = sample_path().read_text("utf-8").splitlines()
    rows = [line.split(",") for line in text if line[:1].isdigit() or line[:1] == "-"]
    return np.array(rows, dtype=float)


def test_slices_hold_the_numbers_of_the_file(paint):
    figure = draw("slices", paint.result, paint.data, channels=("550 nm",))
    linear, log = figure.axes
    rows = file_rows()
    for axes in (linear, log):
        drawn = np.concatenate([li.get_xydata() for li in lines(axes, "measured")])
        in_plane = np.abs(np.sin(rows[:, 2]) * np.sin(rows[:, 3])) < 1e-6
        signed = np.degrees(np.where(np.cos(rows[:, 3]) < 0, rows[:, 2], -rows[:, 2]))
        # At the normal the sign is of no consequence.
        expected = np.stack([np.abs(signed), rows[:, 4 + 3]], axis=1)[in_plane]
        drawn[:, 0] = np.abs(drawn[:, 0])
        assert drawn.shape == expected.shape
        for table in (drawn, expected):
            table[:] = table[np.lexsort(table.T.round(9))]
        np.testing.assert_allclose(drawn, expected, rtol=0, atol=1e-9)
    assert log.get_yscale() == "log"
    assert linear.get_yscale() == "linear"


def test_slices_of_a_matt_surface_are_flat(drawn):
    figure = drawn("leaf", "slices")
    by_title = {axes.get_title(loc="left"): axes for axes in figure.axes}
    for title, value in (("reflected, G", 0.4), ("reflected at the back, G", 0.4),
                         ("transmitted, G", 0.3),
                         ("transmitted, lit from the back, G", 0.3)):  # fmt: skip
        fits = lines(by_title[title], r"fit, $\theta_i$ = 50°")
        assert len(fits) == 2, "one per azimuth of the source"
        for line in fits:
            np.testing.assert_allclose(line.get_ydata(), value / math.pi, rtol=1e-12)
            assert line.get_xdata().min() == pytest.approx(-80.0, abs=0.6)


def test_values_without_a_logarithm_are_marked_and_counted(drawn):
    figure = drawn("matt", "slices")
    linear, log = figure.axes
    (edge,) = lines(log, "_edge")
    value = np.concatenate([li.get_ydata() for li in lines(linear, "measured")])
    assert edge.get_xdata().size == np.sum(value <= 0) > 0
    assert edge.get_transform() == log.get_xaxis_transform()
    labels = [t.get_text() for t in figure.legends[0].get_texts()]
    assert f"zero or negative ({edge.get_xdata().size})" in labels
    assert linear.get_ylim()[0] < value.min()


def test_uncertainties_are_bars_of_two_standard_deviations(drawn):
    linear = drawn("matt", "slices").axes[0]
    (bars,) = [c for c in linear.collections if c.get_label() == "_sigma"]
    lengths = [np.ptp(s[:, 1]) for s in bars.get_segments()]
    np.testing.assert_allclose(lengths, 4 * 0.002, rtol=1e-9)


def test_polar_radius_is_the_value(drawn):
    figure = drawn("leaf", "polar")
    linear = figure.axes[0]
    (reflected, *_), *_ = [lines(linear, r"fit, $\theta_i$ = 50°")]
    np.testing.assert_allclose(reflected.get_ydata(), 0.4 / math.pi, rtol=1e-12)
    sides = [np.abs(li.get_xdata()).max() for li in lines(linear, "measured")]
    assert min(sides) < math.pi / 2 < max(sides)
    (source, *_) = lines(linear, "_source")
    assert source.get_xdata()[0] == pytest.approx(-math.radians(10.0))


def test_logarithmic_polar_radius_is_in_decades(drawn):
    linear, log = drawn("paint", "polar").axes[:2]
    label = r"fit, $\theta_i$ = 30°"
    (one,), (other,) = lines(linear, label), lines(log, label)
    decades = np.diff(np.log10(one.get_ydata()))
    np.testing.assert_allclose(np.diff(other.get_ydata()), decades, atol=1e-12)


def test_beta_of_the_abg_model_is_its_formula():
    b0, shoulder, g = 2.0, 0.05, 1.8
    theta_r = np.radians(np.concatenate([np.arange(0.0, 31.0), np.arange(31.0, 80.0)]))
    theta_i = np.full(theta_r.size, np.radians(30.0))
    turn = np.full(theta_r.size, math.pi)
    data = Measurement(
        theta_i, np.zeros(theta_r.size), theta_r, turn, value=np.ones((theta_r.size, 1)),
        valid=np.ones((theta_r.size, 1), bool), channels=(Channel("mono"),),
    )  # fmt: skip
    result = result_of("abg", {"abg.b0": b0, "abg.shoulder": shoulder, "abg.g": g}, data)
    axes = draw("beta", result, data).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    towards, beyond = lines(axes, r"fit, $\theta_i$ = 30°")
    for line in (towards, beyond):
        x, f = line.get_data()
        # Pfisterer's A / (B + |beta - beta_0|^g), of peak A / B and shoulder B^(1/g).
        np.testing.assert_allclose(f, b0 / (1.0 + (x / shoulder) ** g), rtol=1e-9)
    assert towards.get_xdata().max() > beyond.get_xdata().max()
    x = np.concatenate([li.get_xdata() for li in lines(axes, "measured")])
    expected = np.abs(np.sin(theta_r) - 0.5)
    np.testing.assert_allclose(np.sort(x), np.sort(expected[expected > 1e-9]), atol=1e-12)
    (peak,) = lines(axes, "_peak")
    assert peak.get_xdata().size == 1


def test_image_slice_is_the_mean_of_the_rows(drawn):
    figure = drawn("leaf", "image_slice")
    measured, fit, ratio = (axes.collections[0] for axes in figure.axes[:3])
    for mesh in (measured, fit):
        np.testing.assert_allclose(mesh.get_array().compressed(), 0.4 / math.pi, rtol=1e-9)
    np.testing.assert_allclose(ratio.get_array().compressed(), 0.0, atol=1e-9)
    assert measured.get_array().mask.any(), "cells without rows stay empty"


def test_image_slice_ratio_has_limits_around_zero(drawn):
    for kind in ("paint", "matt"):
        ratio = drawn(kind, "image_slice").axes[2].collections[0]
        low, high = ratio.get_clim()
        assert low == -high < 0
    bright = drawn("matt", "image_slice").axes
    logs = bright[2].collections[0].get_array().compressed()
    # Means that hold zeros and negatives are further off than the 10 % of the others.
    assert logs.min() == pytest.approx(math.log10(1.1), abs=1e-9)


def test_lobe_has_the_measured_points_at_their_radius(drawn):
    figure = drawn("leaf", "lobe")
    axes = figure.axes[0]
    radii = []
    for cloud in axes.collections:
        if hasattr(cloud, "_offsets3d"):
            x, y, z = (np.asarray(v) for v in cloud._offsets3d)
            radii.append(np.sqrt(x**2 + y**2 + z**2)[z > 1e-9])
    above = np.concatenate(radii)
    assert above.size
    assert np.ptp(above) < 1e-9
