"""Pictures of the measured and the fitted material hold the right colours."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import rings
from made_up_results import result_of

from data_formats import Channel, Measurement
from fitting.plots import NoFigure, draw
from fitting.plots.patch import views

REFLECTANCE, FITTED = 0.2, 0.25


@pytest.fixture(scope="module")
def grey():
    """A matt grey surface, fitted as a brighter one."""
    angles = rings((0.0, 20.0, 40.0, 60.0, 80.0))
    value = np.full((angles[0].size, 1), REFLECTANCE / math.pi)
    data = Measurement(
        *angles, value=value, valid=np.ones(value.shape, bool), channels=(Channel("mono"),)
    )
    return result_of("lambert", {"lambert.albedo": FITTED}, data), data


def srgb(linear: float) -> float:
    """IEC 61966-2-1, above the linear part."""
    return 1.055 * linear ** (1 / 2.4) - 0.055


def grey_difference(one: float, other: float) -> float:
    """CIEDE2000 of two greys: ISO/CIE 11664-6 has only its lightness term left."""
    light, dark = (116 * v ** (1 / 3) - 16 for v in (one, other))
    middle = 0.5 * (light + dark) - 50.0
    weight = 1 + 0.015 * middle**2 / math.sqrt(20 + middle**2)
    return abs(light - dark) / weight


def test_a_flat_matt_patch_has_its_reflectance_in_any_light(grey):
    figure = draw("patch", *grey)
    expected = grey_difference(REFLECTANCE, FITTED)
    for first in (0, 3):
        measured, fit, difference = figure.axes[first : first + 3]
        for axes, value in ((measured, REFLECTANCE), (fit, FITTED)):
            pixels = axes.collections[0].get_array().reshape(-1, 4)[:, :3]
            # The lights are sampled by a few nodes per pixel.
            assert pixels.mean() == pytest.approx(srgb(value), abs=0.02)
            assert np.ptp(pixels, axis=1).max() < 1e-6, "grey"
        title = difference.get_title(loc="left")
        assert float(title.partition("= ")[2]) == pytest.approx(expected, rel=0.1)
        assert "measured" in measured.get_title(loc="left")


def test_both_materials_are_lit_alike(grey):
    _, data = grey
    same = result_of("lambert", {"lambert.albedo": REFLECTANCE}, data)
    for axes in draw("patch", same, data).axes:
        if "difference" in axes.get_title(loc="left"):
            mean = float(axes.get_title(loc="left").partition("= ")[2])
            assert mean < 0.02, "the noise of the nodes is that of both"


def test_sphere_is_round_and_dark_away_from_the_light(grey):
    measured = draw("sphere", *grey).axes[0].images[0].get_array()
    alpha = measured[..., 3]
    assert alpha[0, 0] == 0.0
    assert alpha[6, 6] == 1.0
    # The sun stands in the upper right.
    assert measured[3, 8, 0] > 1.5 * measured[9, 3, 0]


def test_the_highlight_lies_opposite_to_the_sun(drawn):
    figure = drawn("paint", "patch")
    (sun,) = [li for li in figure.axes[0].lines if li.get_marker() == "o"]
    at = np.array([sun.get_xdata()[0], sun.get_ydata()[0]])
    assert np.hypot(*at) == pytest.approx(math.sin(math.radians(40.0)))
    seen = views(math.radians(80.0), 6, 8)
    pixels = figure.axes[1].collections[0].get_array()
    light = pixels.reshape(-1, 4)[:, :3].mean(axis=1)
    centre = 0.5 * (seen.low + seen.high)
    sine = np.sqrt(1 - centre[:, 0] ** 2)
    where = np.stack([sine * np.cos(centre[:, 1]), sine * np.sin(centre[:, 1])], axis=1)
    brightest = where[np.argmax(light)]
    assert brightest @ at < -0.8 * np.hypot(*brightest) * np.hypot(*at)


def test_channels_without_colour_are_said_to_be_grey(grey):
    texts = [t.get_text() for t in draw("sphere", *grey).texts]
    assert any("these channels make no colour" in t for t in texts)


def test_no_light_reflected_at_the_front(leaf):
    through = leaf.data.select(leaf.data.transmitted)
    with pytest.raises(NoFigure, match="reflected at the front"):
        draw("sphere", leaf.result, through)
