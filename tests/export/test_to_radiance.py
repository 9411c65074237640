"""Radiance loads trees and matrices, finds them reciprocal, and sees the fit in them."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import jax
import numpy as np
import pytest
from made_up import result_of

import data_formats
from fitting.albedo import model_albedo
from fitting.export import export
from fitting.model import Model

ALBEDO = [0.5, 0.15, 0.05]
# Primaries and white of Radiance, and what Y is of them.
LUMINANCE = np.array([0.265, 0.670, 0.065])


@pytest.fixture(scope="module")
def tools() -> Path:
    pyradiance = pytest.importorskip("pyradiance", reason="pyradiance is not installed")
    return Path(pyradiance.__file__).parent


def run(tools: Path, name: str, *argv: object, given: bytes = b"") -> bytes:
    env = {**os.environ, "RAYPATH": f".:{tools / 'lib'}"}
    done = subprocess.run(
        [tools / "bin" / name, *map(str, argv)],
        input=given, capture_output=True, env=env, check=True,
    )  # fmt: skip
    return done.stdout


def checked(tools: Path, path: Path) -> tuple[float, float, float]:
    """Largest total reflectance of the front, and its reciprocity errors, mean and largest.

    Radiance calls the side of a surface's normal interior.
    """
    text = run(tools, "checkBSDF", path).decode()
    total = re.search(r"Interior Refl.*?([\d.]+)%", text)
    numbers = r"\s+([\d.]+)" * 3
    errors = re.search(rf"Error.*?Interior Refl{numbers}", text, re.DOTALL)
    assert total, text
    assert errors, text
    return float(total[1]) / 100, float(errors[2]) / 100, float(errors[3]) / 100


def seen(tools: Path, path: Path, theta_i: float, theta_r: float, phi: float) -> np.ndarray:
    """BRDF in Radiance's RGB, of a surface under a small lamp."""
    t, r, p = np.radians([theta_i, theta_r, phi])
    lamp, half = 1e5, np.radians(0.25)
    scene = f"""
void BSDF m
6 0 {path} 0 1 0 .
0
0
m polygon p
0
0
12 -1 -1 0 1 -1 0 1 1 0 -1 1 0
void light lamp
0
0
3 {lamp} {lamp} {lamp}
lamp source s
0
0
4 {np.sin(t)} 0 {np.cos(t)} 0.5
"""
    scene_path = path.with_suffix(".rad")
    scene_path.write_text(scene)
    octree = path.with_suffix(".oct")
    octree.write_bytes(run(tools, "oconv", scene_path))
    o = np.array([np.sin(r) * np.cos(p), np.sin(r) * np.sin(p), np.cos(r)])
    ray = " ".join(map(str, [*(2 * o), *(-o)])) + "\n"
    out = run(
        tools, "rtrace", "-h", "-ab", 0, "-dj", 0, "-ds", 0, "-dt", 0, "-st", 0, "-w-",
        octree, given=ray.encode() * 200,
    )  # fmt: skip
    value = np.array([[float(x) for x in line.split()] for line in out.splitlines()])
    solid = 2 * np.pi * (1 - np.cos(half))
    return value.mean(axis=0) / (lamp * solid * np.cos(t))


@pytest.fixture(scope="module")
def satin():
    return result_of(
        "lambert + ggx", lambert__albedo=ALBEDO, ggx__alpha=0.3, ggx__f0=0.05, ggx__f90=1.0
    )


@pytest.fixture(scope="module", params=["radiance", "klems"])
def exported(request, satin, tmp_path_factory):
    """The target's name, the file, and the report."""
    path = tmp_path_factory.mktemp("radiance") / "satin.xml"
    level = {"level": 4} if request.param == "radiance" else {}
    return request.param, path, export(satin, request.param, path, **level)


def test_energy_and_reciprocity(tools, satin, exported):
    target, path, report = exported
    assert report.residual.relative_rms < 0.5
    assert any("both sides" in r for r in report.remarks)
    total, mean, largest = checked(tools, path)
    with jax.enable_x64(True):
        cosines = np.cos(np.radians(np.arange(2.5, 76.0, 5.0)))
        y = np.array([0.2126, 0.7152, 0.0722])
        found = np.asarray(model_albedo(Model(satin.model), satin.values, cosines)) @ y
    # Cells and patches reach beyond 75 degrees, where more is reflected.
    assert 0.95 * found.max() < total < 1.3 * found.max()
    assert mean < 0.02
    if target == "klems":
        assert largest < 0.01


def test_radiance_sees_the_fit(tools, satin, exported):
    """Under a small lamp, as far as patches of 10 degrees let it."""
    _, path, _ = exported
    for at in ((30.0, 10.0, 0.0), (20.0, 60.0, 90.0), (30.0, 50.0, 120.0)):
        t = np.radians(at)
        y = satin.evaluate(t[0], 0.0, t[1], t[2]) @ [0.2126, 0.7152, 0.0722]
        assert seen(tools, path, *at) @ LUMINANCE == pytest.approx(y, rel=0.1)


def test_a_coloured_surface_has_a_white_highlight(tools, exported):
    """Isotropic trees in colour, of which Radiance would take the diffuse part out."""
    _, path, _ = exported
    off = seen(tools, path, 30.0, 10.0, 90.0)
    on = seen(tools, path, 60.0, 60.0, 180.0)
    assert off[0] > 2 * off[1] > 2 * off[2]
    added = on - off
    # Radiance keeps the colours of matrices to some per cent.
    np.testing.assert_allclose(added / added.mean(), 1.0, atol=0.05)


def test_our_reader_reads_it_back(satin, exported):
    """The averages, at the centres of their cells."""
    _, path, _ = exported
    m = data_formats.read(path)
    assert [c.name for c in m.channels] == ["X", "Visible", "Z"]
    front = m.select(~m.from_back)
    across = np.cos(front.phi_r - front.phi_i)
    broad = front.select((front.theta_i < 0.8) & (across > 0))
    at = (broad.theta_i, broad.phi_i, broad.theta_r, broad.phi_r)
    y = satin.evaluate(*at) @ [0.2126, 0.7152, 0.0722]
    error = np.abs(broad.value[:, 1] / y - 1)
    assert np.median(error) < 0.005
    assert np.quantile(error, 0.95) < 0.05


def test_both_ways_through_a_diffuser(tools, tmp_path):
    """Opal glass: the same on all sides, and nothing is doubled."""
    result = result_of(
        "lambert + lambert(back) + lambert_transmission",
        lambert1__albedo=0.3, lambert2__albedo=0.2, lambert_transmission__transmittance=0.4,
    )  # fmt: skip
    report = export(result, "radiance", tmp_path / "a.xml", level=3)
    assert report.residual.relative_rms < 1e-6
    assert not report.remarks
    text = run(tools, "checkBSDF", tmp_path / "a.xml").decode()
    # Radiance's front is the file's back.
    assert re.search(r"Interior Refl\s+20\.0", text)
    assert re.search(r"Exterior Refl\s+30\.0", text)
    assert re.search(r"Ext->Int Trans\s+40\.0", text)


def test_brushed_metal_is_a_tree_of_rank_four(tools, tmp_path):
    result = result_of(
        "ggx(aniso)", ggx__alpha_x=0.2, ggx__alpha_y=0.6, ggx__angle=0.3, ggx__f0=0.7
    )
    report = export(result, "radiance", tmp_path / "a.xml", level=2)
    assert "rank 4" in report.represented_by
    total, mean, _ = checked(tools, tmp_path / "a.xml")
    assert 0.4 < total < 0.9
    assert mean < 0.2
    m = data_formats.read(tmp_path / "a.xml")
    assert m.symmetry == "anisotropic"


def test_levels_are_checked(satin, tmp_path):
    with pytest.raises(ValueError, match="expected 1 to 7"):
        export(satin, "radiance", tmp_path / "a.xml", level=9)
