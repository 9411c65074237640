"""What every target keeps, and what is said where one cannot."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from made_up import RGB, SPECTRAL, directions, geometry_of, result_of

import fitting.export
from fitting import result as results
from fitting.export import TARGETS, Report, export, targets
from fitting.export.channels import linear_srgb, tristimulus
from fitting.export.pairs import pairs_of
from fitting.export.parts import parts_of, sum_of
from fitting.export.report import residual
from fitting.export.surface import surface_of
from fitting.expression import ModelError
from fitting.model import Model

ALBEDO = [0.7, 0.3, 0.05]


def test_the_registry_agrees_with_the_files():
    folder = Path(fitting.export.__file__).parent
    named = {p.stem for p in folder.glob("*.py") if "\nNAME = " in p.read_text()}
    assert named == set(TARGETS)


@pytest.mark.parametrize("name", TARGETS)
def test_a_target_keeps_the_contract(name):
    module = importlib.import_module(f"fitting.export.{name}")
    assert name == module.NAME
    assert all(s.startswith(".") for s in module.SUFFIXES)
    known = {f.name for f in fitting.export.Request.__dataclass_fields__.values()}
    assert set(module.OPTIONS) <= known
    assert ("representation" in module.OPTIONS) == bool(module.REPRESENTATIONS)
    (info,) = [t for t in targets() if t.name == name]
    assert info.suffixes == module.SUFFIXES
    assert info.description.endswith(".")
    assert "\n" not in info.description


# What takes a refit of a model with an expensive base is written as it is.
WRITTEN = {
    "openpbr": "openpbr", "blender": "openpbr", "gltf": "gltf", "abg": "lambert",
    "klems": "lambert",
}  # fmt: skip


# The table of MERL, of 1.5 million bins and without comments, has a test of its own.
@pytest.mark.parametrize("name", [n for n in TARGETS if n != "merl"])
def test_every_target_writes_and_reports(name, tmp_path):
    module = importlib.import_module(f"fitting.export.{name}")
    result = result_of(WRITTEN.get(name, "lambert"), SPECTRAL)
    path = tmp_path / f"some paint{module.SUFFIXES[0]}"
    report = export(result, name, path, **({"level": 3} if name == "radiance" else {}))
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert report.target == name
    assert report.file == str(path)
    assert report.conventions
    again = msgspec.json.decode(msgspec.json.encode(report), type=Report)
    assert again == report
    # Everything that is said is in the file as well.
    content = path.read_bytes().decode("utf-8", errors="replace")
    said = report.conventions[0].replace("--", "- -")
    assert said in content or json.dumps(said)[1:-1] in content


def test_listing_targets_loads_none(tmp_path):
    program = (
        "import sys; from fitting.export import targets; targets(); "
        "print([m for m in sys.modules if m.split('.')[0] in ('jax', 'numpy', 'mitsuba')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True,
        cwd=tmp_path,
    )  # fmt: skip
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("target", "path", "options", "says"),
    [
        ("mitsubo", "a.xml", {}, "did you mean 'mitsuba'"),
        ("mitsuba", "a.png", {}, ".xml or .json"),
        ("mitsuba", "a.xml", {"representation": "glass"}, "sum, principled"),
        ("mitsuba", "a.xml", {"spectral": True}, "bands and no wavelengths"),
        ("mitsuba", "a.xml", {"theta_i": (1.0,)}, "--theta-i"),
        ("gltf", "a.gltf", {"spectral": True}, "no use for it"),
        ("mitsuba", "a.xml", {"channels": ("R",)}, "expected three"),
        ("mitsuba", "a.xml", {"channels": ("R", "G", "Q")}, "no such channel"),
        ("csv", "a.csv", {"channels": ("Q",)}, "no such channel"),
        ("gltf", "a.gltf", {}, "reflects nothing from the front"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(tmp_path, target, path, options, says):
    model = "lambert_transmission" if target == "gltf" and not options else "lambert"
    with pytest.raises(ModelError, match=says.replace("(", r"\(")):
        export(result_of(model), target, tmp_path / path, **options)
    assert not list(tmp_path.iterdir())


def channels(*names: str | float) -> list[results.Channel]:
    return [
        results.Channel(n, None) if isinstance(n, str) else results.Channel(f"{n:g} nm", n)
        for n in names
    ]


def test_channels_become_linear_srgb():
    """White is white; the primaries are those of IEC 61966-2-1."""
    wide = channels(*np.arange(380.0, 781.0, 10.0))
    np.testing.assert_allclose(linear_srgb(wide).matrix.sum(axis=0), 1.0, atol=1e-6)
    warm = linear_srgb(wide, illuminant="A")
    np.testing.assert_allclose(warm.matrix.sum(axis=0), 1.0, atol=1e-6)
    assert "A" in warm.sentence
    xyz = linear_srgb(channels("X", "Y", "Z")).matrix
    expected = [
        [3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570],
    ]  # fmt: skip
    np.testing.assert_allclose(xyz.T, expected, atol=5e-4)
    back = tristimulus(channels("B", "G", "R"))
    np.testing.assert_allclose(
        back.matrix[::-1], np.linalg.inv(np.transpose(expected)), atol=2e-4
    )


def test_three_lamps_and_a_grey():
    lamps = linear_srgb(channels(465.0, 525.0, 630.0))
    np.testing.assert_array_equal(lamps.matrix, np.eye(3)[:, ::-1])
    assert "no colorimetry" in lamps.sentence
    grey = linear_srgb(channels("mono"))
    np.testing.assert_array_equal(grey.matrix, np.ones((1, 3)))
    with pytest.raises(ModelError, match="no colour follows"):
        linear_srgb(channels(400.0, 500.0))


def test_weights_integrate_a_peak_and_a_base():
    """Of GGX with alpha 0.02, the white-sky reflectance by an adaptive quadrature."""
    model, values = Model("lambert + ggx"), {"ggx.alpha": 0.02}
    values = model.defaults() | values | {"ggx.f0": 1.0, "lambert.albedo": 0.3}
    at = pairs_of(model, values, ("front",), 1 << 15)
    result = result_of(
        "lambert + ggx", RGB[:1], ggx__alpha=0.02, ggx__f0=1.0, lambert__albedo=0.3
    )
    f = surface_of(result, linear_srgb(result.channels))(at.geometry)[:, 0]
    found = np.sum(at.weight * f) / np.pi
    # Directions beyond 85 degrees are left out: 0.76 % of the sources, and of Lambert's
    # light; of GGX what its tails carry there.
    share = np.sin(np.radians(85.0)) ** 2
    assert found == pytest.approx(share * (1.0 + 0.3 * share), rel=5e-3)


def test_the_distance_of_two_known_surfaces():
    """Twice as bright everywhere: the relative RMS is 1, the largest at the brightest."""
    result = result_of("lambert", lambert__albedo=[0.2, 0.4, 0.3])
    surface = surface_of(result, linear_srgb(result.channels))
    twice = sum_of([("lambert", {"albedo": np.array([0.4, 0.8, 0.6])})])
    found = residual(surface, twice)
    assert found.relative_rms == pytest.approx(1.0, rel=1e-12)
    assert found.typical == pytest.approx(1.0, rel=1e-12)
    assert 0.9 < found.relative_rms_log1p < 1.0
    assert found.largest == pytest.approx(0.4 / np.pi, rel=1e-12)
    assert found.channel == "G"
    assert not found.exact
    same = residual(surface, sum_of([("lambert", {"albedo": np.array([0.2, 0.4, 0.3])})]))
    assert same.exact


def test_spectra_of_a_plain_sum_mix_exactly():
    """One shape for all wavelengths and linear coefficients: the colour of the sum is the
    sum of the colours."""
    result = result_of(
        "lambert + interfaced_lambert + ggx", SPECTRAL,
        lambert__albedo=np.linspace(0.2, 0.4, 6), ggx__f0=np.linspace(0.04, 0.06, 6),
        interfaced_lambert__albedo=np.linspace(0.3, 0.5, 6),
    )  # fmt: skip
    mixing = linear_srgb(result.channels)
    surface = surface_of(result, mixing)
    parts, remarks = parts_of(surface)
    assert not remarks
    mixed = sum_of([(str(p.term), p.values) for p in parts])
    g = geometry_of(*directions(0, 500))
    np.testing.assert_allclose(mixed(g), surface(g), rtol=1e-9)


def gold():
    """A metal whose index changes over the spectrum: no colour has an index of it."""
    return result_of(
        "ggx(conductor)", SPECTRAL, ggx__alpha=0.2, ggx__eta=np.linspace(1.5, 0.2, 6),
        ggx__k=np.linspace(2.0, 4.0, 6),
    )  # fmt: skip


@pytest.mark.parametrize("target", ["mitsuba", "pbrt", "materialx"])
def test_the_colour_of_a_metal_is_that_of_its_spectrum(target):
    report = export(gold(), target)
    assert report.residual.relative_rms < 0.03
    assert report.residual.typical < 0.02
    assert not report.exact
