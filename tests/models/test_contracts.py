"""What every registered lobe promises, whatever it models.

The promises themselves, and how they are checked, are in `fitting.stress`.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import DEFAULTS, FEW, QUICK, VARIANTS, default_and_slow, each

import fitting.models
from fitting.albedo import albedo_basis, model_albedo
from fitting.model import Model
from fitting.models import LOBES, lobe_class
from fitting.stress import Finding, Variant, report
from fitting.stress import points as at
from fitting.stress.exercise import Exercise
from fitting.stress.points import Points
from fitting.stress.self_fit import self_fit
from fitting.stress.variants import of_expression

# What several lobes share, and what is no lobe of its own.
NO_LOBES = {
    "fresnel",
    "lobe",
    "lobe_file",
    "microfacet",
    "multiple_scattering",
    "ndf",
    "quotients",
    "retro",
    "shadowing",
    "slab",
    "turned_over",
    "wrapper",
}
# Whose fit to their own values CI looks at; the others are in the full sweep.
ONE_OF_A_KIND = {
    *("eon", "interfaced_lambert", "ggx", "student_t", "blinn_phong", "lafortune"),
    *("abg", "rpv"),
}
ROUND = [v for v in VARIANTS if any(p.name == "alpha_x" for p in v.shapes)]


@pytest.fixture(autouse=True)
def strict_promotion():
    with jax.numpy_dtype_promotion("strict"):
        yield


def exercises(variant: Variant) -> dict[str, Exercise]:
    """What is compiled in haste runs longer: fewer points at a time, to stop in time."""
    return {p: Exercise(variant, p, chunk=128) for p in report.PRECISIONS}


def after(seconds: float) -> Callable[[], bool]:
    """Of costly lobes as many points as the time allows, once the first are done."""
    ends: list[float] = []

    def enough() -> bool:
        now = time.process_time()
        ends.append(now + seconds)
        return now > ends[0]

    return enough


def refuse_failures(findings: list[Finding]) -> None:
    failed = [str(f) for f in findings if not f.passed]
    assert not failed, "\n".join(failed)


def fits_itself(variant: Variant) -> None:
    # Solvers of others do not keep to the strict rules of these tests.
    with jax.numpy_dtype_promotion("standard"):
        refuse_failures(list(self_fit(variant)))


def test_registry_matches_the_files():
    folder = Path(fitting.models.__file__).parent
    files = {p.stem for p in folder.glob("*.py")} - {"__init__"} - NO_LOBES
    assert files == set(LOBES)
    for name in LOBES:
        assert name == lobe_class(name).NAME


@default_and_slow(FEW)
def test_contracts(variant: Variant):
    """float32 overflows first, so the default run is float32."""
    refuse_failures(list(report.kept(exercises(variant), 240, ("f32",), after(0.7))))


@pytest.mark.slow
@each(QUICK)
def test_contracts_in_float64(variant: Variant):
    refuse_failures(list(report.kept(exercises(variant), 1000, ("f64",), after(0.7))))


def test_self_fit():
    fits_itself(of_expression("oren_nayar"))


@pytest.mark.slow
@each([v for v in DEFAULTS if v.name in ONE_OF_A_KIND])
def test_self_fit_of_one_of_a_kind(variant: Variant):
    fits_itself(variant)


@pytest.mark.full
@each([v for v in DEFAULTS if v.name not in {*ONE_OF_A_KIND, "oren_nayar"}])
def test_self_fit_of_every_lobe(variant: Variant):
    fits_itself(variant)


@pytest.mark.full
@each([v for v in VARIANTS if v not in DEFAULTS])
def test_self_fit_with_every_option(variant: Variant):
    fits_itself(variant)


@each(ROUND)
def test_equal_widths_are_round(variant: Variant):
    """An anisotropic lobe with equal widths is the isotropic one."""
    isotropic = of_expression(variant.name.replace("(aniso)", ""))
    points = at.interior(variant, 200)
    width = points.shape["alpha_x"]
    own = {n: points.shape[n] for n in ("angle",)}
    rest = {
        n: v for n, v in points.shape.items() if n not in ("alpha_x", "alpha_y", "angle")
    }

    def having(shape: dict[str, np.ndarray]) -> Points:
        return dataclasses.replace(points, shape=shape)

    np.testing.assert_allclose(
        Exercise(variant, "f64").value(
            having({**rest, **own, "alpha_x": width, "alpha_y": width})
        ),
        Exercise(isotropic, "f64").value(having({**rest, "alpha": width})),
        rtol=1e-11,
    )


@default_and_slow([of_expression(e) for e in ("eon", "ggx", "ggx(aniso)")], QUICK)
def test_albedo_is_differentiable(variant: Variant):
    albedo_has_derivatives(variant, x64=False)


@pytest.mark.slow
@each(DEFAULTS)
def test_albedo_is_differentiable_in_float64(variant: Variant):
    albedo_has_derivatives(variant, x64=True)


@pytest.mark.full
@each([v for v in VARIANTS if v not in DEFAULTS])
def test_albedo_is_differentiable_in_float64_with_every_option(variant: Variant):
    albedo_has_derivatives(variant, x64=True)


def albedo_has_derivatives(variant: Variant, *, x64: bool) -> None:
    cos_theta = [0.0, 1e-3, 0.3, 1.0]
    extreme = at.product_of_extremes(variant, 48)
    with jax.enable_x64(x64):

        def total(shape):
            return sum(
                jnp.sum(e)
                for way in variant.lobe.ways
                for e in albedo_basis(variant.lobe, shape, cos_theta, nodes=8, way=way)
            )

        if not variant.shapes:
            assert np.isfinite(total({}))
            return
        exercise = Exercise(variant, "f64" if x64 else "f32")
        shapes, _ = exercise.on_device(extreme)
        value, derivative = jax.jit(jax.vmap(jax.value_and_grad(total)))(shapes)
        assert value.dtype == (jnp.float64 if x64 else jnp.float32)
        assert np.all(np.isfinite(value))
        for name, d in derivative.items():
            assert np.all(np.isfinite(d)), name


def test_model_albedo_sums_the_lobes_per_channel():
    with jax.enable_x64(True):
        model = Model("lambert + eon + ggx(aniso)")
        parameters: dict[str, object] = dict(model.defaults())
        parameters["lambert.albedo"] = jnp.asarray([0.1, 0.2, 0.3])
        parameters["eon.albedo"] = jnp.asarray([0.3, 0.2, 0.1])
        albedo = jax.jit(lambda p: model_albedo(model, p, [0.3, 1.0], azimuth=0.5))
        total = albedo(parameters)
        assert total.shape == (2, 3)
        rest = albedo({**parameters, "lambert.albedo": jnp.zeros(3)})
        np.testing.assert_allclose(total - rest, [[0.1, 0.2, 0.3]] * 2, rtol=1e-7)
        assert model_albedo(Model("lambert"), {"lambert.albedo": 0.4}, [1.0]).shape == (
            1,
            1,
        )


def test_eon_amplitudes_beyond_white():
    """The multiple scattering has a pole at rho = 6; the amplitudes go on without it."""
    lobe = lobe_class("eon")()
    with jax.enable_x64(True):
        rho = jnp.asarray([0.0, 0.5, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 2.0, 5.98, 100.0])
        for roughness in (0.0, 0.5, 1.0):
            shape = {"roughness": jnp.asarray(roughness)}
            single, multiple = lobe.amplitudes(shape, (rho,))
            np.testing.assert_array_equal(single, rho)
            assert np.all(np.isfinite(multiple))
            assert np.all(np.diff(multiple) > 0)
            slope = jax.vmap(jax.grad(lambda x, s=shape: lobe.amplitudes(s, (x,))[1]))(rho)
            np.testing.assert_allclose(slope[2], slope[4], rtol=1e-7)
            np.testing.assert_allclose(multiple[3], 1.0, rtol=1e-14)
