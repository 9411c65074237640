"""Pictures of a sphere against Mitsuba 3's, pixel by pixel, within the noise of both.

Mitsuba's is the mean of renders with independent seeds, whose scatter is its noise, and so
is ours. Mitsuba's pixels are means over the background as well, which is black. Its disks
are ten thousand radii away, and hide what is behind them: materials and lights are rendered
one by one and added.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
from made_up_scenes import RGB, made

from fitting.model import Model
from fitting.scene.emitters import Emitter, towards
from fitting.scene.nodes import nodes
from fitting.scene.photometry import photometry
from fitting.scene.picture import Picture, picture
from fitting.scene.render import render

PIXELS, CAMERA = 20, 75.0
RUNS = 16
FAR = 1e4

Shape = dict[str, Any]
BEAM = {"kind": "direction", "theta_deg": 40, "phi_deg": 50}
LAMP = {"kind": "disk", "theta_deg": 40, "phi_deg": 50, "diameter_deg": 15}
SUN = {"kind": "disk", "theta_deg": 40, "phi_deg": 50, "diameter_deg": 0.53}
ROUND = {"kind": "uniform", "below_horizon": True, "brightness": 0.3}
LIGHTS = {"beam": (BEAM,), "sun": (SUN,), "lamp in a room": (LAMP, ROUND)}
ALBEDO = np.array([0.3, 0.5, 0.7])
ETA, K = np.array([0.2, 0.9, 1.4]), np.array([3.9, 2.5, 1.8])


class Pixels(NamedTuple):
    """Means over whole pixels ``(p, 3)``, and their standard errors."""

    mean: np.ndarray
    sigma: np.ndarray


@pytest.fixture(scope="module")
def mitsuba() -> Iterator[ModuleType]:
    module = pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
    before = module.variant()
    module.set_variant("scalar_rgb")
    yield module
    if before:
        module.set_variant(before)


def rgb(values) -> Shape:
    return {"type": "rgb", "value": [float(v) for v in np.broadcast_to(values, 3)]}


def their_light(mi: ModuleType, e: Emitter) -> Shape:
    """The light of a scene in Mitsuba, with the radiance that ours has."""
    power = rgb(e.spectrum[0])
    if e.half_angle == 0:
        return {
            "type": "directional",
            "direction": (-e.axis).tolist(),
            "irradiance": power,
        }
    if e.half_angle > 3:
        return {"type": "constant", "radiance": power}
    T: Any = mi.ScalarTransform4f
    size = FAR * math.tan(e.half_angle)
    there = T().look_at(
        origin=(FAR * e.axis).tolist(), target=[0, 0, 0], up=[0, 0.6, 0.8]
    ) @ T().scale([size, size, 1])
    return {
        "type": "disk",
        "to_world": there,
        "emitter": {"type": "area", "radiance": power},
    }


def theirs(
    mi: ModuleType, bsdf: Shape, emitter: Emitter, samples: int, seen: Picture
) -> Pixels:
    eye = 5 * towards(CAMERA, 0.0)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=eye.tolist(), target=[0, 0, 0], up=[0, 0, 1]
                ),
                "film": {
                    "type": "hdrfilm", "width": PIXELS, "height": PIXELS,
                    "rfilter": {"type": "box"}, "pixel_format": "rgb",
                    "component_format": "float32",
                },
                "sampler": {"type": "independent"},
            },
            "ball": {"type": "sphere", "bsdf": bsdf},
            "light": their_light(mi, emitter),
        }
    )  # fmt: skip
    runs = [np.asarray(mi.render(scene, spp=samples, seed=s)) for s in range(RUNS)]
    return scatter(np.array(runs, dtype=np.float64).reshape(RUNS, -1, 3)[:, seen.place])


def scatter(runs: np.ndarray) -> Pixels:
    return Pixels(runs.mean(axis=0), runs.std(axis=0, ddof=1) / math.sqrt(len(runs)))


def agree(
    mi: ModuleType,
    model: str,
    values: dict[str, Any],
    bsdfs: tuple[Shape, ...],
    lights: str,
    samples: int,
) -> tuple[Picture, np.ndarray]:
    """Compare the picture of a model with the sum of Mitsuba's of materials."""
    scene = made(*LIGHTS[lights], seen={"kind": "sphere", "pixels": PIXELS})
    assert scene.seen.camera_theta_deg == CAMERA  # pyright: ignore[reportAttributeAccessIssue]
    seen, emitters = picture(scene), photometry(scene, RGB).emitters
    images = [
        render(
            Model(model), values, [nodes(seen, e, samples // 4, seed=s) for e in emitters]
        )
        for s in range(RUNS)
    ]
    covered = seen.share[:, None]
    ours = scatter(np.array([i.radiance * covered for i in images]))
    parts = [theirs(mi, b, e, samples, seen) for b in bsdfs for e in emitters]
    mean = np.sum([p.mean for p in parts], axis=0)
    sigma = np.sqrt(ours.sigma**2 + np.sum([p.sigma**2 for p in parts], axis=0))
    lit = mean > 1e-4 * mean.max()
    off = (ours.mean - mean)[lit] / sigma[lit]
    size = float(np.sqrt(np.mean(off**2)))
    known = float(np.median(sigma[lit] / mean[lit]))
    whole = ours.mean.sum(axis=0) / mean.sum(axis=0) - 1
    whole_sigma = np.sqrt(np.sum(sigma**2, axis=0)) / mean.sum(axis=0)
    # What an image says of its own error, over all pixels and runs.
    stated = np.mean([(i.error * covered) ** 2 for i in images])
    honest = math.sqrt(stated / np.mean(RUNS * ours.sigma**2))
    largest = np.abs(off).max()
    print(f"{model}, {lights}: {size:.2f} (at most {largest:.1f}) of {100 * known:.2g} %")
    print(f"in all {whole[1]:.2g} of {whole_sigma[1]:.2g}; errors are {honest:.2f} stated")
    assert known < 0.02
    # Both noises are estimated from few runs: Student's t, not a normal distribution.
    assert size < 1.2
    assert largest < 6
    assert np.all(np.abs(whole) < 4 * whole_sigma)
    assert np.all(ours.mean[~lit] < 3e-4 * mean.max())
    assert 0.7 < honest < 1.4
    return seen, mean[:, 1]


def diffuse() -> Shape:
    return {"type": "diffuse", "reflectance": rgb(ALBEDO)}


def mirror_like(alpha: float) -> Shape:
    """Facets that reflect everything: f0 = f90 = 1."""
    return {
        "type": "roughconductor", "distribution": "ggx", "material": "none",
        "alpha": alpha, "sample_visible": True,
    }  # fmt: skip


def gloss(alpha: float) -> dict[str, Any]:
    return {"ggx.alpha": alpha, "ggx.f0": np.ones(3), "ggx.f90": np.ones(3)}


def test_a_matt_and_glossy_sphere_in_a_beam(mitsuba: ModuleType):
    values = {"lambert.albedo": ALBEDO, **gloss(0.2)}
    bsdfs = (diffuse(), mirror_like(0.2))
    seen, mean = agree(mitsuba, "lambert + ggx(uncorrelated)", values, bsdfs, "beam", 256)
    # The highlight is where the half vector is a normal: right of the middle and above it.
    row, column = divmod(int(seen.place[np.argmax(mean)]), PIXELS)
    half = towards(40, 50) + towards(CAMERA, 0)
    assert seen.camera is not None
    right, up = (seen.camera @ half)[:2] / np.linalg.norm(half)
    assert column == int((right + 1) / 2 * PIXELS) > PIXELS // 2
    assert row == int((1 - up) / 2 * PIXELS) < PIXELS // 2


def test_a_metal_sphere_in_the_sun(mitsuba: ModuleType):
    """A shape per channel: every one has an index of its own."""
    metal = mirror_like(0.05) | {"eta": rgb(ETA), "k": rgb(K)}
    del metal["material"]
    values = {"ggx.alpha": 0.05, "ggx.eta": ETA, "ggx.k": K, "ggx.scale": np.ones(3)}
    agree(mitsuba, "ggx(conductor, uncorrelated)", values, (metal,), "sun", 256)


def test_a_brushed_sphere_under_a_lamp_in_a_room(mitsuba: ModuleType):
    """The sample's x is east, as the first tangent of Mitsuba's sphere."""
    brushed = mirror_like(0.1) | {"alpha_u": 0.1, "alpha_v": 0.35}
    del brushed["alpha"]
    values = {
        "ggx.alpha_x": 0.1, "ggx.alpha_y": 0.35, "ggx.angle": 0.0,
        "ggx.f0": np.ones(3), "ggx.f90": np.ones(3),
    }  # fmt: skip
    model = "ggx(aniso, uncorrelated)"
    agree(mitsuba, model, values, (brushed,), "lamp in a room", 512)


@pytest.mark.slow
@pytest.mark.parametrize("lights", LIGHTS)
@pytest.mark.parametrize("alpha", [0.05, 0.2, None])
def test_spheres_in_all_lights(mitsuba: ModuleType, lights: str, alpha: float | None):
    bsdf = diffuse() if alpha is None else mirror_like(alpha)
    model = "lambert" if alpha is None else "ggx(uncorrelated)"
    values = {"lambert.albedo": ALBEDO} if alpha is None else gloss(alpha)
    agree(mitsuba, model, values, (bsdf,), lights, 512)
