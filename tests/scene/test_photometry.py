"""Spectra, white and colours of a scene's light against colour-science and tables."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from made_up_scenes import GREY, NM10, RGB, UP, XYZ, made, only
from scipy.constants import c, h, k

from data_formats import Channel
from fitting.colorimetry import colour_of, colour_science, delta_e_2000
from fitting.scene import SceneError
from fitting.scene.emitters import emitters, towards
from fitting.scene.photometry import counts, display_white, photometry, tristimulus, white
from fitting.scene.spectra import channel_means, power, rgb_parts


def test_black_bodies_and_illuminants_are_colour_sciences():
    colour = colour_science()
    w = np.array([400.0, 500.0, 560.0, 640.0, 780.0, 1500.0])
    for kelvin in (1000.0, 2856.0, 6500.0):
        ours = power(msgspec.convert({"blackbody_kelvin": kelvin}, _spectrum())).of(w)
        exact = 1 / (w**5 * np.expm1(h * c / (w * 1e-9 * k * kelvin)))
        np.testing.assert_allclose(ours / ours[2], exact / exact[2], rtol=1e-8)
        # Its constant c2 is rounded to 0.014388 m K.
        theirs = colour.colorimetry.planck_law(w * 1e-9, kelvin)
        np.testing.assert_allclose(ours / ours[2], theirs / theirs[2], rtol=3e-4)
    table = colour.SDS_ILLUMINANTS["FL2"]
    np.testing.assert_allclose(power("fl2").of(w[:5]), [table[x] for x in w[:5]])
    assert power("D65").of(np.array([1000.0]))[0] == 0
    assert power("E").of(np.array([5000.0]))[0] == 1


@pytest.mark.parametrize("name", ["D65", "A", "FL2", "FL11", "LED-B3"])
@pytest.mark.parametrize("step", [5, 10])
def test_white_points_of_lights_with_lines(name, step):
    """Published chromaticities; channels of 10 nm smooth a lamp's lines a little."""
    channels = [Channel.at(w) for w in range(380, 781, step)]
    scene = made({"kind": "direction", "spectrum": name})
    x, y, z = display_white(scene, channels)
    assert y == pytest.approx(100.0, rel=1e-12)
    xy = colour_science().CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"][name]
    lines = name not in ("D65", "A")
    tolerance = (5e-4 if step == 5 else 1.5e-3) if lines else 2e-4
    np.testing.assert_allclose([x / (x + y + z), y / (x + y + z)], xy, atol=tolerance)


def test_narrow_lines_are_not_missed():
    """A laser 0.02 nm wide: what it has is shared between the channels around it."""
    line = {"bands": [[632.81, 632.83, 50.0]]}
    laser = power(msgspec.convert(line, _spectrum()))
    means = channel_means(laser, np.array([620.0, 640.0, 600.0, 630.0]))
    # A tent's share, over its area of 10 nm: the line's power is 1.
    np.testing.assert_allclose(means, [0, 0.282 / 10, 0, 0.718 / 10], atol=1e-5)
    assert only({"kind": "direction", "spectrum": line}, NM10).spectrum[0, 23] > 0


def test_the_parts_of_rgb_are_all_of_white_and_the_primaries():
    w = np.arange(300.0, 1100.0, 1.0)
    parts = rgb_parts(w)
    np.testing.assert_allclose(parts.sum(axis=0), 1.0, atol=1e-15)
    assert parts.min() > 0
    scene = made({"kind": "direction", "spectrum": "D65"})
    channels = [Channel.at(x) for x in range(380, 781, 5)]
    found = (
        white(scene, channels) * rgb_parts(np.arange(380.0, 781.0, 5.0))
    ) @ tristimulus(scene, channels)
    primaries = colour_science().RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T
    np.testing.assert_allclose(found / 100, primaries, atol=2e-3)


def test_colours_are_those_of_the_illuminant():
    """A green surface, spectral, under the sky's D65: as `colour_of` has it."""
    w = np.array([c.wavelength_nm for c in NM10], dtype=float)
    factors = 0.1 + 0.5 * np.exp(-(((w - 540) / 40) ** 2))
    for name in ("D65", "A"):
        scene = made({"kind": "sky", "type": 1, "spectrum": name})
        found = photometry(scene, NM10)
        xyz = (found.white * factors) @ found.tristimulus
        expected = colour_of(w, factors, illuminant=name)
        assert expected is not None
        lab = colour_science().XYZ_to_Lab(xyz / 100, _xy(found.display_white))
        assert delta_e_2000(lab, expected.lab) < 0.1


@pytest.mark.parametrize("channels", [NM10, RGB, GREY, NM10[10:13]])
def test_white_at_exposure_is_the_exposure(channels):
    lights = ({"kind": "disk", "diameter_deg": 20, "theta_deg": 30}, {"kind": "uniform"})
    for exposure, expected in (("auto", 100.0), (0.25, 25.0)):
        scene = made(*lights, viewer={"exposure": exposure})
        found = photometry(scene, channels)
        assert (found.white @ found.tristimulus)[1] == pytest.approx(expected, rel=1e-12)
        assert found.display_white[1] == pytest.approx(100.0, rel=1e-12)
    if len(channels) > 5 or channels is RGB:
        np.testing.assert_allclose(_xy(found.display_white), (0.3127, 0.3290), atol=3e-4)


def test_xyz_channels_hold_the_white_of_d65():
    """A white surface's f is (0.9505, 1, 1.089) / pi in them, and it is shown as white."""
    found = photometry(made({"kind": "uniform"}), XYZ)
    shown = found.white * np.array([0.95047, 1.0, 1.08883]) @ found.tristimulus
    np.testing.assert_allclose(shown, found.display_white, rtol=3e-4)


def test_wavelengths_that_do_not_count():
    narrow = made({"kind": "uniform"}, viewer={"wavelengths_nm": [500, 600]})
    inside = counts(narrow, NM10)
    assert [c.name for c, seen in zip(NM10, inside, strict=True) if seen][:1] == ["500 nm"]
    matrix = tristimulus(narrow, NM10)
    assert np.all(matrix[~inside] == 0)
    assert (white(narrow, NM10) @ matrix)[1] == pytest.approx(100.0)
    with pytest.raises(SceneError, match="400 to 700 nm; expected some of them"):
        counts(made({"kind": "uniform"}, viewer={"wavelengths_nm": [900, 950]}), NM10)
    infrared = {"kind": "uniform", "spectrum": {"bands": [[900, 1000, 1]]}}
    with pytest.raises(SceneError, match=r"no power that counts.*observer none"):
        emitters(made(infrared, viewer={"wavelengths_nm": [380, 1000]}), NM10)
    detector = {"wavelengths_nm": [800, 1000], "observer": "none"}
    found = photometry(made(infrared, viewer=detector), [Channel.at(950.0)])
    assert found.white[0] > 0
    assert found.tristimulus.shape == (1, 3)
    with pytest.raises(SceneError, match="has light"):
        photometry(made(infrared, viewer=detector), [Channel.at(850.0)])


def test_brightness_is_illuminance_whatever_the_spectrum():
    spectra = ("A", "FL2", {"blackbody_kelvin": 9000}, {"rgb": [1, 0.2, 0.1]})
    fine = [Channel.at(w) for w in range(380, 781, 5)]
    lights = [{"kind": "direction", "spectrum": s, "brightness": 2.5} for s in spectra]
    for channels in (fine, RGB, XYZ, GREY):
        scene = made(*lights)
        y = tristimulus(scene, channels)[:, 1]
        given = [float(e.spectrum[0] @ y) for e in emitters(scene, channels)]
        np.testing.assert_allclose(given, given[0], rtol=2e-3)


def test_tints_in_rgb_are_relative_to_the_first_light():
    daylight = {"kind": "uniform", "spectrum": "D65"}
    lamp = {"kind": "direction", "spectrum": "A"}
    first, second = emitters(made(daylight, lamp), RGB)
    np.testing.assert_allclose(first.spectrum * math.pi, 1.0, rtol=1e-4)
    colour = colour_science()
    a = np.array([1.09850, 1.0, 0.35585])
    expected = colour.XYZ_to_RGB(a, "sRGB", chromatic_adaptation_transform=None)
    np.testing.assert_allclose(second.spectrum[0], expected, atol=3e-3)
    alone = only({**lamp, "kind": "direction"}, RGB)
    np.testing.assert_allclose(alone.spectrum, 1.0, rtol=1e-9)
    blue, green, red = emitters(made(daylight, lamp), [RGB[2], RGB[1], RGB[0]])[1].spectrum[
        0
    ]
    np.testing.assert_allclose((red, green, blue), second.spectrum[0])


def test_a_sphere_is_exposed_for_its_brightest_part():
    one = {"kind": "direction", "theta_deg": 50, "phi_deg": 30}
    scene = made(one, seen={"kind": "sphere"})
    np.testing.assert_allclose(photometry(scene, GREY).facing, towards(50, 30), atol=1e-6)
    np.testing.assert_allclose(white(scene, GREY), 1 / math.pi)
    # Two at a right angle: 2 cos 45 deg in the middle, more than either.
    scene = made({"kind": "direction"}, {**one, "theta_deg": 90}, seen={"kind": "sphere"})
    np.testing.assert_allclose(photometry(scene, GREY).facing, towards(45, 30), atol=1e-6)
    np.testing.assert_allclose(white(scene, GREY), math.sqrt(2) / math.pi)
    # The clear sky pulls towards the sun's side.
    sky = made({"kind": "sky", "type": 12, "sun_theta_deg": 60}, seen={"kind": "sphere"})
    x, y, z = photometry(sky, GREY).facing
    assert y == pytest.approx(0, abs=1e-3)
    assert 0 < math.atan2(x, z) < math.radians(60)


def test_a_histogram_has_its_light_at_the_normal():
    rows = {"kind": "histogram", "rows": [[30, 0, 30, 180, 1]]}
    scene = made({"kind": "disk", "diameter_deg": 2}, seen=rows)
    np.testing.assert_allclose(emitters(scene, GREY)[0].axis, UP)
    np.testing.assert_allclose(white(scene, GREY), 1 / math.pi)


def _xy(xyz: np.ndarray) -> np.ndarray:
    return xyz[:2] / xyz.sum()


def _spectrum() -> type:
    from fitting.scene.lights import Spectrum

    return Spectrum
