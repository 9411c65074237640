"""Colours against published white points, colour-science's ASTM E308, and Monte Carlo."""

from __future__ import annotations

import json
import warnings

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting import colorimetry
from fitting.colorimetry import ColourError, ObjectColour, colour_of, rgb_colour
from fitting.expression import ModelError

W = np.arange(380.0, 781.0, 10.0)
GREEN = 0.1 + 0.5 * np.exp(-(((W - 540) / 40) ** 2))

# ASTM E308, Table 5 (sums of the weights), for the 2 and the 10 degree observer.
WHITES = [
    ("D65", "2", (95.047, 100.0, 108.883)),
    ("A", "2", (109.850, 100.0, 35.585)),
    ("D50", "2", (96.422, 100.0, 82.521)),
    ("D65", "10", (94.811, 100.0, 107.304)),
    ("A", "10", (111.144, 100.0, 35.200)),
]


def found(*args, **kwargs) -> ObjectColour:
    result = colour_of(*args, **kwargs)
    assert result is not None
    return result


@pytest.mark.parametrize(("illuminant", "observer", "white"), WHITES)
def test_white_of_the_perfect_diffuser(illuminant, observer, white):
    """To what tables in 1, 5 and 10 nm differ by."""
    w = np.arange(360.0, 831.0, 5.0)
    c = found(w, np.ones(w.size), illuminant=illuminant, observer=observer)
    np.testing.assert_allclose(c.xyz, white, atol=0.02)
    np.testing.assert_allclose(c.lab, (100, 0, 0), atol=1e-9)
    np.testing.assert_allclose(c.srgb, 1.0, atol=1e-9)
    assert c.srgb_in_gamut
    assert c.luminous_reflectance == pytest.approx(1.0, rel=1e-12)
    assert c.weight_outside == 0
    assert c.xyz_uncertainty is None


@pytest.mark.parametrize("illuminant", ["D65", "A", "FL2", "FL11"])
def test_colour_checker_as_by_astm_e308(illuminant):
    """All 24 patches, measured from 380 to 730 nm; both keep the last value beyond."""
    colour = colorimetry.colour_science()
    cmfs = colour.MSDS_CMFS[colorimetry.OBSERVER]
    source = colour.SDS_ILLUMINANTS[illuminant]
    differences = []
    for sd in colour.SDS_COLOURCHECKERS["BabelColor Average"].values():
        with warnings.catch_warnings():
            # It says that it aligns its tables.
            warnings.simplefilter("ignore")
            xyz = colour.sd_to_XYZ(sd, cmfs=cmfs, illuminant=source, method="ASTM E308")
        c = found(sd.wavelengths, sd.values, illuminant=illuminant)
        white = np.array(c.white)
        lab = colour.XYZ_to_Lab(xyz / 100, white[:2] / white.sum())
        differences.append(np.abs(lab - c.lab).max())
    assert len(differences) == 24
    assert max(differences) < 0.01


def test_srgb_of_a_published_patch():
    """The chart's makers give sRGB (115, 82, 68) for dark skin and (8, 133, 161) for cyan.

    The latter is out of gamut in red: clipped, and said to be.
    """
    colour = colorimetry.colour_science()
    patches = colour.SDS_COLOURCHECKERS["BabelColor Average"]
    skin, cyan = (
        found(patches[n].wavelengths, patches[n].values) for n in ("dark skin", "cyan")
    )
    np.testing.assert_allclose(255 * np.array(skin.srgb), (115, 82, 68), atol=3)
    assert skin.srgb_in_gamut
    assert skin.srgb == skin.srgb_clipped
    assert not cyan.srgb_in_gamut
    assert cyan.srgb[0] < 0 == cyan.srgb_clipped[0]
    assert cyan.srgb[1:] == cyan.srgb_clipped[1:]
    np.testing.assert_allclose(
        colour.XYZ_to_sRGB(np.array(skin.xyz) / 100), skin.srgb, atol=2e-3
    )


def test_bright_spectra_are_not_clipped():
    c = found(W, np.full(W.size, 3.0))
    assert c.xyz[1] == pytest.approx(300)
    assert not c.srgb_in_gamut
    assert min(c.srgb) > 1.2
    assert c.srgb_clipped == (1.0, 1.0, 1.0)


def test_black_and_negative_spectra():
    black = found(W, np.zeros(W.size), sigma=np.full(W.size, 0.01))
    assert black.xy is None
    assert black.lab == pytest.approx((0, 0, 0), abs=1e-12)
    assert black.lab_uncertainty[0] == pytest.approx(
        903.3 / 100 * black.xyz_uncertainty[1], rel=1e-4
    )
    below = found(W, np.full(W.size, -0.01))
    assert below.lab[0] == pytest.approx(-9.033, rel=1e-4)
    assert below.luminous_reflectance == pytest.approx(-0.01)


def uncertain() -> tuple[np.ndarray, np.ndarray]:
    sigma = 0.002 + 0.006 * GREEN
    distance = np.abs(W[:, None] - W) / 30
    return sigma, np.outer(sigma, sigma) * np.exp(-distance)


@pytest.mark.parametrize("kind", ["independent", "correlated", "covariance"])
def test_uncertainties_by_monte_carlo(kind):
    rng = np.random.default_rng(4)
    sigma, covariance = uncertain()
    if kind == "covariance":
        got = found(W, GREEN, covariance=covariance)
        noise = rng.multivariate_normal(np.zeros(W.size), covariance, size=40_000)
    else:
        got = found(W, GREEN, sigma=sigma, correlated=kind == "correlated")
        noise = rng.standard_normal((40_000, 1 if kind == "correlated" else W.size)) * sigma
    weights = colorimetry.tristimulus_weights(W)
    xyz = (GREEN + noise) @ weights.matrix
    np.testing.assert_allclose(got.xyz, GREEN @ weights.matrix, rtol=1e-12)
    np.testing.assert_allclose(got.xyz_uncertainty, xyz.std(axis=0), rtol=0.02)
    colour = colorimetry.colour_science()
    lab = colour.XYZ_to_Lab(xyz / 100, weights.white[:2] / weights.white.sum())
    np.testing.assert_allclose(got.lab_uncertainty, lab.std(axis=0), rtol=0.02)
    assert got.luminous_reflectance_uncertainty == got.xyz_uncertainty[1] / 100


def test_an_error_of_gain_is_one_of_lightness():
    """Of white with 1 %, all of one cause, ``a*, b*`` are certain; L* is by ``116 / 3``."""
    ones = np.ones(W.size)
    c = found(W, ones, sigma=0.01 * ones, correlated=True)
    assert c.luminous_reflectance_uncertainty == pytest.approx(0.01)
    assert c.lab_uncertainty[0] == pytest.approx(0.01 * 116 / 3)
    assert c.lab_uncertainty[1:] == pytest.approx((0, 0), abs=1e-6)
    independent = found(W, ones, sigma=0.01 * ones)
    assert independent.luminous_reflectance_uncertainty < 0.004


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.booleans())
def test_order_gaps_and_masked_values(seed, linear):
    """Shuffled rows and not-measured values change nothing but what is not known."""
    how = {"interpolation": "linear" if linear else "cubic"}
    shuffled = np.random.default_rng(seed).permutation(W.size)
    straight = found(W, GREEN, sigma=0.1 * GREEN, **how)
    mixed = found(W[shuffled], GREEN[shuffled], sigma=0.1 * GREEN[shuffled], **how)
    np.testing.assert_allclose(mixed.xyz, straight.xyz, rtol=1e-12)
    np.testing.assert_allclose(mixed.lab_uncertainty, straight.lab_uncertainty, rtol=1e-9)
    hole = np.where(np.arange(W.size) == 7, np.nan, GREEN)
    masked = found(W, hole, **how)
    np.testing.assert_allclose(masked.xyz, straight.xyz, rtol=2e-2)
    assert (straight.interval_nm, masked.interval_nm) == (10.0, 20.0)


def test_a_cubic_is_exact_and_lines_are_not():
    """A cubic in wavelength, sampled unevenly, has the same colour as sampled finely."""
    fine = np.arange(360.0, 781.0)

    def cubic(w):
        t = (w - 560) / 200
        return 0.4 + 0.2 * t - 0.1 * t**2 + 0.15 * t**3

    sparse = np.array([360.0, 395, 440, 480, 530, 560, 615, 660, 700, 780])
    exact = found(fine, cubic(fine))
    np.testing.assert_allclose(found(sparse, cubic(sparse)).xyz, exact.xyz, rtol=1e-12)
    straight = found(sparse, cubic(sparse), interpolation="linear")
    assert 0.01 < np.abs(np.subtract(straight.xyz, exact.xyz)).max() < 0.5


def test_the_range_is_told():
    w = np.arange(420.0, 681.0, 20.0)
    c = found(w, 0.5 * np.ones(w.size))
    assert (c.range_nm, c.interval_nm) == ((420.0, 680.0), 20.0)
    assert (c.summed_nm, c.step_nm) == ((360.0, 780.0), 1.0)
    assert (c.interpolation, c.extrapolation) == ("cubic", "constant")
    # Z has its weight in the violet; the share from colour-science's own tables.
    colour = colorimetry.colour_science()
    z = colour.MSDS_CMFS[colorimetry.OBSERVER].values[:421, 2]
    source = colour.SDS_ILLUMINANTS["D65"]
    z = z * np.interp(np.arange(360, 781), source.wavelengths, source.values)
    share = 1 - z[60:321].sum() / z.sum()
    assert c.weight_outside == pytest.approx(share, rel=1e-9)
    assert 0.03 < share < 0.05
    alone = found(w, 0.5 * np.ones(w.size), extrapolation="none")
    assert alone.summed_nm == (420.0, 680.0)
    assert alone.weight_outside == c.weight_outside
    assert alone.xyz[1] == pytest.approx(50)
    # Infrared channels count for nothing and are not in the range.
    wide = np.arange(400.0, 1601.0, 10.0)
    assert found(wide, np.ones(wide.size)).range_nm == (400.0, 790.0)


def test_too_few_visible_wavelengths():
    assert colour_of(W[:4], GREEN[:4]) is None
    assert colour_of(W + 500, GREEN) is None
    assert colour_of(W, np.where(np.arange(W.size) < 4, GREEN, np.nan)) is None
    assert colour_of([], []) is None
    assert colour_of(W[:5], GREEN[:5]) is not None


def test_every_illuminant_and_observer_by_name():
    colour = colorimetry.colour_science()
    for name in colour.SDS_ILLUMINANTS:
        assert found(W, GREEN, illuminant=name).illuminant == name
    for name in colour.MSDS_CMFS:
        if name.startswith("CIE"):
            assert found(W, GREEN, observer=name).observer == name
    two, ten = colorimetry.OBSERVER, "CIE 1964 10 Degree Standard Observer"
    for alias, name in {
        "2": two, "CIE 1931": two, "2°": two, "10": ten, "cie 1964": ten, "10 deg": ten,
        "cie_10_1964": ten,
    }.items():  # fmt: skip
        assert found(W, GREEN, observer=alias).observer == name
    assert found(W, GREEN, illuminant="d 65").illuminant == "D65"


WRONG = [
    ({"illuminant": "D66"}, "illuminant 'D66'; did you mean 'D65'"),
    ({"illuminant": "F11"}, "'FL11'"),
    ({"illuminant": "?"}, "known: A, B, C"),
    ({"observer": "CIE 1965"}, "mean 'CIE 1964 10 Degree"),
    ({"observer": "Stockman & Sharpe 2 Degree Cone Fundamentals"}, "l_bar"),
    ({"sigma": [0.1]}, "41 finite"),
    ({"sigma": -GREEN}, "none below 0"),
    ({"sigma": np.where(W == 400, np.nan, GREEN)}, "finite"),
    ({"sigma": GREEN, "covariance": np.eye(41)}, "one of them"),
    ({"covariance": np.eye(40)}, "(40, 40); expected 41 x 41"),
    ({"covariance": np.full((41, 41), np.nan)}, "finite"),
    ({"covariance": -np.eye(41)}, "eigenvalue"),
    ({"covariance": np.tri(41)}, "symmetric"),
]


@pytest.mark.parametrize(("how", "says"), WRONG, ids=[says for _, says in WRONG])
def test_what_is_wrong_is_said(how, says):
    with pytest.raises(ModelError) as caught:
        colour_of(W, GREEN, **how)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wrong_spectra_are_refused():
    with pytest.raises(ColourError, match="spectrum"):
        colour_of(W, GREEN[:-1])
    twice = np.where(np.arange(W.size) == 3, W[4], W)
    with pytest.raises(ColourError, match="different"):
        colour_of(twice, GREEN)
    with pytest.raises(ColourError, match="three finite"):
        rgb_colour("RGB", [1.0, np.nan, 0.0])


def test_named_bands():
    """The primaries of sRGB have published chromaticities (IEC 61966-2-1)."""
    for name, xy in {"R": (0.64, 0.33), "G": (0.3, 0.6), "B": (0.15, 0.06)}.items():
        c = rgb_colour("BGR", [float(n == name) for n in "BGR"])
        assert c is not None
        assert c.xy == pytest.approx(xy, abs=1e-12)
        assert "sRGB primaries" in (c.assumption or "")
        assert c.range_nm is None
    red = rgb_colour(["r", "g", "b"], [1.0, 0.0, 0.0], sigma=[0.1, 0.0, 0.0])
    assert red is not None
    assert red.luminous_reflectance == pytest.approx(0.2126, abs=1e-4)
    assert red.luminous_reflectance_uncertainty == pytest.approx(0.02126, abs=1e-5)
    assert red.srgb == pytest.approx((1, 0, 0), abs=1e-6)
    assert red.lab == pytest.approx((53.24, 80.09, 67.20), abs=0.02)
    c = rgb_colour(["Y", "X", "Z"], [0.4, 0.3, 0.2], sigma=[0.01, 0.02, 0.03])
    assert c is not None
    assert c.xyz == pytest.approx((30, 40, 20))
    assert c.xyz_uncertainty == pytest.approx((2, 1, 3))
    assert "D65" in (c.assumption or "")
    assert rgb_colour(["mono"], [0.3]) is None
    assert rgb_colour(["R", "G", "Z"], [0.3, 0.2, 0.1]) is None


def test_delta_e_2000_of_published_pairs():
    """Sharma, Wu and Dalal 2005, Table 1, pairs 1, 7, 17 and 25."""
    first = [[50, 2.6772, -79.7751], [50, 0, 0], [50, 2.5, 0], [60.2574, -34.0099, 36.2677]]
    second = [[50, 0, -82.7485], [50, -1, 2], [73, 25, -18], [60.4626, -34.1751, 39.4387]]
    got = colorimetry.delta_e_2000(first, second)
    np.testing.assert_allclose(got, [2.0425, 2.3669, 27.1492, 1.2644], atol=5e-5)


def test_a_colour_is_plain_data():
    sigma, _ = uncertain()
    c = found(W, GREEN, sigma=sigma)
    text = msgspec.json.encode(c)
    assert msgspec.json.decode(text, type=ObjectColour) == c
    assert all(v is not None for k, v in json.loads(text).items() if k != "assumption")
