"""Pictures by direct light against what can be said of them on paper."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from data_formats import Channel
from fitting.albedo import model_albedo
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.predict import predict_geometry
from fitting.scene.description import (
    ColourDifference,
    Direction,
    Disk,
    Flat,
    Histogram,
    RelativeRadiance,
    Scene,
    Sphere,
    Tolerance,
    Uniform,
)
from fitting.scene.nodes import nodes
from fitting.scene.photometry import photometry
from fitting.scene.picture import picture
from fitting.scene.render import _padded, radiance, render

GREY = (Channel("G", None),)
SEEN = Tolerance(colour_difference=ColourDifference())
READ = Tolerance(relative_radiance=RelativeRadiance())
MATT = {"lambert.albedo": np.array([0.6])}
WHITE_GLOSS = {"ggx.f0": np.array([1.0]), "ggx.f90": np.array([1.0])}


def staged(scene: Scene, per_pixel: int):
    """The picture's pixels, its nodes, and the white of the light."""
    light = photometry(scene, GREY)
    seen = picture(scene)
    return seen, [nodes(seen, e, per_pixel) for e in light.emitters], light.white


def test_a_matt_sphere_under_a_direction_has_the_cosine_of_its_normals():
    scene = Scene(
        lights=(Direction(theta_deg=50.0, phi_deg=40.0),), seen=Sphere(pixels=12),
        tolerance=SEEN,
    )  # fmt: skip
    seen, lights, white = staged(scene, 256)
    found = render(Model("lambert"), MATT, lights).radiance[:, 0]
    # Means over the pixels, by a fine raster of the normals.
    u = (np.arange(64) + 0.5) / 64
    grid = np.stack([a.ravel() for a in np.meshgrid(u, u)], axis=1)
    theta, phi = np.radians([50.0, 40.0])
    towards = np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )
    expected = np.empty(seen.size)
    for p in range(seen.size):
        normal, _, there = seen.normals_and_views(seen.points(np.full(len(grid), p), grid))
        cosine = np.maximum(normal[there] @ towards, 0.0)
        expected[p] = cosine.mean() if there.any() else 0.0
    inner = seen.share > 0.99
    # The irradiance of what faces the light is pi times the white's radiance.
    np.testing.assert_allclose(
        found[inner], 0.6 * white[0] * expected[inner], rtol=0.02, atol=2e-3 * white[0]
    )
    # A light to the right of the camera makes the right side brighter: columns ascend.
    column = seen.place % seen.shape[1]
    assert found[column >= 6].sum() > found[column < 6].sum()


@pytest.mark.parametrize("alpha", [0.02, 0.4])
def test_under_an_even_sky_a_surface_is_as_bright_as_its_albedo(alpha: float):
    """Reciprocity; the albedo by the half-vector quadrature of `fitting.albedo`."""
    scene = Scene(
        lights=(Uniform(),), seen=Flat(theta_deg=(0.0, 75.0)), tolerance=READ,
    )  # fmt: skip
    seen, lights, white = staged(scene, 2048)
    image = render(Model("ggx"), {"ggx.alpha": alpha, **WHITE_GLOSS}, lights)
    cosine = 0.5 * (seen.low[:, 0] + seen.high[:, 0])
    with jax.enable_x64(True):
        albedo = np.asarray(
            model_albedo(Model("ggx"), {"ggx.alpha": alpha, **WHITE_GLOSS}, cosine)
        )
    ring = seen.low[:, 0]
    for level in np.unique(ring):
        own = ring == level
        np.testing.assert_allclose(
            image.radiance[own].mean() / white[0], albedo[own].mean(), rtol=0.01
        )
    far = np.abs(image.radiance[:, 0] / white[0] - albedo[:, 0])
    assert np.mean(far <= 4 * image.error[:, 0] / white[0] + 0.02 * albedo[:, 0]) > 0.9


def test_a_histogram_is_the_value_times_the_cosine():
    rows = ((30.0, 0.0, 30.0, 180.0, 1.0), (50.0, 10.0, 20.0, 90.0, 2.0))
    scene = Scene(lights=(Direction(),), seen=Histogram(rows=rows), tolerance=READ)
    seen, lights, white = staged(scene, 2)
    values = {"ggx.alpha": 0.2, **WHITE_GLOSS}
    found = render(Model("ggx"), values, lights).radiance[:, 0]
    theta_i, phi_i, theta_r, phi_r, weight = np.radians(np.array(rows)).T
    f = predict_geometry(Model("ggx"), values, from_angles(theta_i, phi_i, theta_r, phi_r))
    expected = np.pi * white[0] * np.cos(theta_i) * f[:, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    np.testing.assert_allclose(seen.weight, weight / weight.sum())


@pytest.mark.parametrize("alpha", [0.003, 0.05])
def test_narrow_gloss_under_a_small_light_is_found(alpha: float):
    """All the light of a highlight far smaller than a pixel, and an honest error."""
    scene = Scene(
        lights=(Disk(theta_deg=40.0, phi_deg=30.0, diameter_deg=0.53),),
        seen=Sphere(pixels=10), tolerance=SEEN,
    )  # fmt: skip
    values = {"ggx.alpha": alpha, **WHITE_GLOSS}
    _, few, _ = staged(scene, 64)
    seen, many, _ = staged(scene, 1024)
    coarse, fine = (render(Model("ggx"), values, n) for n in (few, many))
    total = np.array([seen.share @ i.radiance[:, 0] for i in (coarse, fine)])
    np.testing.assert_allclose(total[0], total[1], rtol=0.02)
    # Two halves tell the error of a single pixel badly, that of the picture well.
    off = np.linalg.norm(coarse.radiance - fine.radiance)
    stated = np.hypot(np.linalg.norm(coarse.error), np.linalg.norm(fine.error))
    assert off <= 3 * stated + 1e-3 * np.linalg.norm(fine.radiance)
    assert stated <= 0.1 * np.linalg.norm(fine.radiance)


def test_pictures_are_differentiable_and_single_precision_is_enough():
    scene = Scene(
        lights=(Disk(theta_deg=40.0, phi_deg=30.0, diameter_deg=20.0),),
        seen=Sphere(pixels=8), tolerance=SEEN,
    )  # fmt: skip
    _, (light,), _ = staged(scene, 32)
    model, values = Model("ggx"), {"ggx.alpha": np.array(0.2), **WHITE_GLOSS}
    with jax.enable_x64(True):
        padded = _padded(light, True)

        def total(alpha, f0):
            own = {k: jnp.asarray(v) for k, v in values.items()}
            own |= {"ggx.alpha": alpha, "ggx.f0": f0[None]}
            return jnp.sum(radiance(model, own, *padded, 2 * light.pixels))

        at = (jnp.asarray(0.2), jnp.asarray(0.5))
        slopes = jax.grad(total, argnums=(0, 1))(*at)
        for k, h in ((0, 1e-5), (1, 1e-5)):
            up, down = ([a + s * h * (i == k) for i, a in enumerate(at)] for s in (1, -1))
            difference = (total(*up) - total(*down)) / (2 * h)
            np.testing.assert_allclose(slopes[k], difference, rtol=1e-6)
    double = render(model, values, [light]).radiance
    single = render(model, values, [light], precision="f32").radiance
    np.testing.assert_allclose(single, double, rtol=1e-4, atol=1e-5 * double.max())
