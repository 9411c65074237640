"""Environment maps: their light, their orientation against Mitsuba's, and their files."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_up_scenes import NM10, RGB, UP, made, only

from fitting.scene import SceneError
from fitting.scene.emitters import emitter_irradiance, emitters, towards
from fitting.scene.environment import Environment, averaged, interpolator
from fitting.scene.photometry import photometry


@settings(max_examples=25, deadline=None)
@given(
    height=st.integers(2, 6).map(lambda n: 2 * n),
    seed=st.integers(0, 1000),
    turn=st.floats(-7, 7),
)
def test_maps_keep_their_light(height, seed, turn):
    """Integrals over the sphere by dense midpoints: as pixels times their solid angles."""
    pixels = np.random.default_rng(seed).random((3, height, 2 * height)) ** 8
    edges = np.cos(np.arange(height + 1) * math.pi / height)
    solid = -np.diff(edges) * 2 * math.pi / (2 * height)
    expected = (pixels * solid[:, None]).sum(axis=(1, 2))
    n = 40 * height
    theta = (np.arange(n) + 0.5) * math.pi / n
    phi = (np.arange(8 * height) + 0.5) * 2 * math.pi / (8 * height) + turn
    t, p = np.meshgrid(theta, phi, indexing="ij")
    x, y, z = np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)
    of = interpolator(Environment(pixels), turn)
    values = of(x.ravel(), y.ravel(), z.ravel()).reshape(3, *t.shape)
    found = (values * np.sin(t)).sum(axis=(1, 2)) * math.pi / n * 2 * math.pi / phi.size
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    assert values.min() >= 0
    coarse = averaged(pixels, 2)
    np.testing.assert_allclose(
        (coarse * (-np.diff(edges[::2]) * 2 * math.pi / height)[:, None]).sum(axis=(1, 2)),
        expected,
    )


def test_maps_are_continuous_at_the_poles_and_around():
    pixels = np.random.default_rng(0).random((1, 8, 16))
    of = interpolator(Environment(pixels), 0.3)
    phi = np.linspace(0, 2 * math.pi, 50)
    for z in (1.0, -1.0):
        values = of(1e-7 * np.cos(phi), 1e-7 * np.sin(phi), np.full(50, z))
        assert np.ptp(values) < 1e-5
    seam = 0.3 + math.pi
    sides = [of(*(np.array([a]) for a in towards(70, math.degrees(seam) + d)))
             for d in (-1e-7, 1e-7)]  # fmt: skip
    np.testing.assert_allclose(*sides, rtol=1e-6)
    flat = interpolator(Environment(np.full((1, 8, 16), 3.0)))
    x, y, z = _unit(np.random.default_rng(1).standard_normal((500, 3))).T
    np.testing.assert_allclose(flat(x, y, z), 3.0, rtol=1e-12)


def test_maps_lie_as_mitsubas_do():
    """Mitsuba's y is our z, its z our x; it samples rows half a pixel differently."""
    mi = pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    rows = 128
    theta = (np.arange(rows) + 0.5)[:, None] * math.pi / rows
    turn = (np.arange(2 * rows) + 0.5) * math.pi / rows
    picture = 2 + np.stack(
        [
            np.cos(theta) + 0 * turn,
            np.sin(theta) * np.sin(turn),
            np.sin(theta) * np.cos(2 * turn + 0.5),
        ],
        axis=2,
    )
    envmap = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(picture.astype("f4"))})
    of = interpolator(Environment(np.moveaxis(picture, 2, 0)))
    rng = np.random.default_rng(0)
    for x, y, z in _unit(rng.standard_normal((30, 3))):
        at = mi.SurfaceInteraction3f()
        at.wi = -mi.Vector3f(y, z, x)
        ours = of(np.array([x]), np.array([y]), np.array([z]))[:, 0]
        np.testing.assert_allclose(
            ours, np.array(envmap.eval(at)), atol=1.5 * math.pi / rows
        )
    if before:
        mi.set_variant(before)


@pytest.fixture
def oiio():
    return pytest.importorskip("OpenImageIO", reason="OpenImageIO is not installed")


def saved(oiio, path: Path, picture: np.ndarray, names=("R", "G", "B")) -> str:
    height, width, channels = picture.shape
    spec = oiio.ImageSpec(width, height, channels, "float")
    spec.channelnames = names
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(picture.astype(np.float32))
    out.close()
    return str(path)


@pytest.mark.parametrize("suffix", ["hdr", "exr"])
def test_files_of_maps(oiio, tmp_path, suffix):
    """A lamp in one pixel, green; the map's brightness is what faces the lamp."""
    picture = np.zeros((16, 32, 3))
    picture[4, 8] = (0, 64, 0)
    path = saved(oiio, tmp_path / f"map.{suffix}", picture)
    light = {"kind": "map", "file": path, "phi_deg": 90, "brightness": 4}
    scene = made(light, seen={"kind": "sphere"})
    (lamp,) = emitters(scene, RGB)
    assert lamp.half_angle == math.pi
    assert lamp.finest == pytest.approx(math.pi / 16)
    # The pixel spans 8/32 to 9/32 of the width: 90 to 78.75 degrees left of the centre.
    expected = towards(4.5 * 180 / 16, 90 + 84.375)
    peak = lamp.pattern(*(np.array([a]) for a in expected))[:, 0] @ lamp.spectrum
    assert peak[1] > 0
    assert peak[0] == peak[2] == 0
    found = photometry(scene, RGB)
    assert float(found.facing @ expected) > math.cos(math.radians(2))
    # Only green, of luminance 0.7152; the spectra of primaries have it to 0.1 %.
    assert math.pi * found.white[1] * 0.71517 == pytest.approx(4.0, rel=1e-3)
    # As many W as lm: in spectral channels the same luminance.
    spectral = photometry(scene, NM10)
    ratio = (spectral.white @ spectral.tristimulus)[1]
    assert ratio == pytest.approx(100.0)
    peak_nm = NM10[int(np.argmax(spectral.white))].wavelength_nm
    assert peak_nm is not None
    assert 490 <= peak_nm <= 580


def test_one_channel_and_averaging(oiio, tmp_path):
    picture = np.random.default_rng(3).random((48, 96, 1))
    path = saved(oiio, tmp_path / "map.exr", picture, names=("Y",))
    light = {"kind": "map", "file": path, "smallest_detail_deg": 8}
    e = only(light, NM10)
    assert e.spectrum.shape == (1, len(NM10))
    # 3.75 degrees a pixel: two by two of them are one.
    assert e.finest == pytest.approx(math.radians(7.5))
    assert float(emitter_irradiance(e, UP[None])[0].max()) > 0


@pytest.mark.parametrize(
    ("picture", "says"),
    [
        (np.ones((8, 8, 3)), "8 x 8 pixels.*twice as wide as high"),
        (np.zeros((8, 16, 3)), "black"),
        (np.full((8, 16, 3), -1.0), "384 values are negative"),
        (np.full((8, 16, 3), np.inf), "384 values are not finite"),
    ],
)
def test_files_that_are_no_maps(oiio, tmp_path, picture, says):
    path = saved(oiio, tmp_path / "map.exr", picture)
    with pytest.raises(SceneError, match=says):
        only({"kind": "map", "file": path})


def test_broken_files(oiio, tmp_path):
    with pytest.raises(SceneError, match=r"none\.hdr: No such file"):
        only({"kind": "map", "file": str(tmp_path / "none.hdr")})
    junk = tmp_path / "junk.exr"
    junk.write_bytes(b"no picture at all")
    with pytest.raises(SceneError, match=r"junk\.exr: .*expected an environment map"):
        only({"kind": "map", "file": str(junk)})
    path = saved(oiio, tmp_path / "cut.hdr", np.ones((8, 16, 3)))
    whole = Path(path).read_bytes()
    Path(path).write_bytes(whole[: len(whole) - 40])
    with pytest.raises(SceneError, match=r"cut\.hdr: "):
        only({"kind": "map", "file": path})
    Path(path).write_bytes(whole.replace(b"rgbe", b"xyze"))
    with pytest.raises(SceneError, match="XYZE"):
        only({"kind": "map", "file": path})
    depth = saved(oiio, tmp_path / "depth.exr", np.ones((8, 16, 2)), names=("Z", "A"))
    with pytest.raises(SceneError, match=r"channels are .*; expected R, G, B or Y"):
        only({"kind": "map", "file": depth})


def test_a_missing_library_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    path = tmp_path / "map.hdr"
    path.write_bytes(b"#?RADIANCE")
    with pytest.raises(SceneError, match=r"pip install 'brdf-fitting\[images\]'"):
        only({"kind": "map", "file": str(path)})


def _unit(w: np.ndarray) -> np.ndarray:
    return w / np.linalg.norm(w, axis=1, keepdims=True)
