"""What every registered lobe promises, whatever it models."""

from __future__ import annotations

import functools
from pathlib import Path

import cases
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import CASES, Case
from hypothesis import given, settings
from hypothesis import strategies as st

import fitting.models
from fitting.albedo import albedo_basis, model_albedo
from fitting.geometry import from_angles, from_components
from fitting.model import Model
from fitting.models import LOBES, lobe_class

SHARED_PHYSICS = {"fresnel", "lobe", "microfacet", "ndf", "shadowing"}


def some(of_default) -> pytest.MarkDecorator:
    """All cases, of which the default run takes those for which the condition holds."""
    slow = pytest.mark.slow
    marked = [
        pytest.param(c, marks=() if of_default(c) else slow, id=str(c)) for c in CASES
    ]
    return pytest.mark.parametrize("case", marked)


every_case = pytest.mark.parametrize("case", CASES, ids=str)
one_fresnel = some(lambda c: ("fresnel", "dielectric") not in c.options)
few = some(lambda c: str(c) in ("eon", "ggx(iso,schlick)", "ggx(aniso,schlick)"))
f32_and_slow_f64 = pytest.mark.parametrize(
    "x64", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["f32", "f64"]
)


@pytest.fixture(autouse=True)
def strict_promotion():
    with jax.numpy_dtype_promotion("strict"):
        yield


def basis_at(case: Case):
    """Stacked basis functions ``(b, n)`` of a dictionary of scalars and a geometry."""
    lobe = case.lobe
    return lambda shape, geometry: jnp.stack(lobe.basis(shape, geometry))


@functools.cache
def compiled(case: Case):
    return jax.jit(basis_at(case))


def test_registry_matches_the_files():
    folder = Path(fitting.models.__file__).parent
    files = {p.stem for p in folder.glob("*.py")} - {"__init__"} - SHARED_PHYSICS
    assert files == set(LOBES)
    for name in LOBES:
        assert name == lobe_class(name).NAME


@every_case
def test_declarations(case: Case):
    lobe = case.lobe
    parameters = lobe.parameters()
    assert lobe.REFERENCE
    assert len({p.name for p in parameters}) == len(parameters)
    for p in parameters:
        low, high = p.support
        assert low <= p.default <= high
        assert p.meaning
        assert p.unit
        if not p.coefficient:
            assert low <= p.start[0] < p.start[1] <= high
        if p.scale == "log":
            assert low > 0


@every_case
@f32_and_slow_f64
def test_finite_over_the_closed_domain(case: Case, x64: bool):
    """Values, and derivatives by shape parameters in both modes, at every extreme.

    float32 overflows first, so the default run is float32.
    """
    with jax.enable_x64(x64):
        basis = basis_at(case)

        def all_of(shape, geometry):
            value = basis(shape, geometry)
            if not shape:
                return value, (), ()
            return (
                value,
                jax.jacfwd(basis)(shape, geometry),
                jax.jacrev(basis)(shape, geometry),
            )

        over_directions = jax.vmap(all_of, in_axes=(None, 0))
        shapes = {n: jnp.asarray(v) for n, v in cases.extreme_shapes(case).items()}
        geometry = cases.on_device(cases.extreme_geometry())
        if shapes:
            over_directions = jax.vmap(over_directions, in_axes=(0, None))
        value, forward, reverse = jax.jit(over_directions)(shapes, geometry)
        assert value.dtype == (jnp.float64 if x64 else jnp.float32)
        assert np.all(np.isfinite(value))
        assert np.all(np.asarray(value) >= 0)
        for mode in (forward, reverse):
            for name, derivative in dict(mode).items():
                assert np.all(np.isfinite(derivative)), name


@one_fresnel
def test_finite_derivatives_by_directions(case: Case):
    """A fitted tilt of the sample moves the directions; nothing may become NaN."""
    with jax.enable_x64(True):
        basis = basis_at(case)
        shape = cases.default_shape(case)
        g = cases.on_device(cases.extreme_geometry())
        vectors = (g.wix, g.wiy, g.cos_i, g.wox, g.woy, g.cos_o)

        def of_vectors(*xyz):
            return basis(shape, from_components(*xyz))

        jacobian = jax.vmap(jax.jacrev(of_vectors, argnums=range(6)))
        for derivative in jax.jit(jacobian)(*vectors):
            assert np.all(np.isfinite(derivative))


@every_case
def test_zero_below_the_horizon(case: Case):
    with jax.enable_x64(True):
        ti, tr = np.radians(
            [[91.0, 30.0, 120.0, 90.0, 180.0], [10.0, 100.0, 170.0, 90.0, 0.0]]
        )
        geometry = cases.on_device(from_angles(ti, 0.1, tr, 2.0))
        values = np.asarray(compiled(case)(cases.default_shape(case), geometry))
        np.testing.assert_array_equal(values, 0.0)


@every_case
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_reciprocal_and_not_negative(case: Case, data):
    angle = st.floats(0.0, np.pi / 2)
    azimuth = st.floats(-np.pi, np.pi)
    ti, tr = (data.draw(st.lists(angle, min_size=4, max_size=4)) for _ in range(2))
    pi, pr = (data.draw(st.lists(azimuth, min_size=4, max_size=4)) for _ in range(2))
    shape = {p.name: data.draw(st.floats(*p.support), label=p.name) for p in case.shapes}
    with jax.enable_x64(True):
        shape = {n: jnp.asarray(v) for n, v in shape.items()}
        there = compiled(case)(shape, cases.on_device(from_angles(ti, pi, tr, pr)))
        back = compiled(case)(shape, cases.on_device(from_angles(tr, pr, ti, pi)))
        assert np.all(np.isfinite(there))
        assert np.all(np.asarray(there) >= 0)
        if case.lobe.RECIPROCAL:
            np.testing.assert_allclose(there, back, rtol=1e-12)


@pytest.mark.parametrize("case", [c for c in CASES if not c.anisotropic], ids=str)
def test_isotropic_lobes_do_not_see_a_rotation(case: Case):
    rng = np.random.default_rng(1)
    ti, tr = rng.uniform(0, np.pi / 2, (2, 200))
    pi, pr, turn = rng.uniform(0, 2 * np.pi, (3, 200))
    with jax.enable_x64(True):
        shape = cases.default_shape(case)
        before = compiled(case)(shape, cases.on_device(from_angles(ti, pi, tr, pr)))
        after = compiled(case)(
            shape, cases.on_device(from_angles(ti, pi + turn, tr, pr + turn))
        )
        np.testing.assert_allclose(before, after, rtol=1e-11)


@pytest.mark.parametrize("case", [c for c in CASES if c.anisotropic], ids=str)
def test_anisotropic_lobes_turn_with_their_angle(case: Case):
    """Turning the tangent and both directions changes nothing; equal widths are round."""
    rng = np.random.default_rng(2)
    ti, tr = rng.uniform(0, np.pi / 2, (2, 200))
    pi, pr = rng.uniform(0, 2 * np.pi, (2, 200))
    with jax.enable_x64(True):
        shape = cases.default_shape(case)
        here = cases.on_device(from_angles(ti, pi, tr, pr))
        turned = cases.on_device(from_angles(ti, pi + 0.7, tr, pr + 0.7))
        np.testing.assert_allclose(
            compiled(case)(shape, here),
            compiled(case)({**shape, "angle": shape["angle"] + 0.7}, turned),
            rtol=1e-11,
        )
        options = (("anisotropic", False), *case.options[1:])
        round_case = Case(case.name, options)
        equal = {**shape, "alpha_x": shape["alpha_x"], "alpha_y": shape["alpha_x"]}
        single = {
            n: v for n, v in shape.items() if n not in ("alpha_x", "alpha_y", "angle")
        }
        np.testing.assert_allclose(
            compiled(case)(equal, here),
            compiled(round_case)({**single, "alpha": shape["alpha_x"]}, here),
            rtol=1e-11,
        )


@one_fresnel
def test_compiled_and_mapped_agree_with_the_plain_call(case: Case):
    rng = np.random.default_rng(3)
    ti, tr = rng.uniform(0, np.pi / 2, (2, 20))
    with jax.enable_x64(True):
        shape = cases.default_shape(case)
        geometry = cases.on_device(from_angles(ti, 0.2, tr, rng.uniform(0, 6, 20)))
        basis = basis_at(case)
        plain = basis(shape, geometry)
        mapped = jax.vmap(basis, in_axes=(None, 0), out_axes=1)(shape, geometry)
        np.testing.assert_allclose(compiled(case)(shape, geometry), plain, rtol=1e-12)
        np.testing.assert_allclose(mapped, plain, rtol=1e-12)


@one_fresnel
def test_derivatives_agree_with_differences(case: Case):
    if not case.shapes:
        pytest.skip("no shape parameters")
    rng = np.random.default_rng(4)
    ti, tr = rng.uniform(0, 1.4, (2, 20))
    with jax.enable_x64(True):
        shape = cases.default_shape(case)
        geometry = cases.on_device(from_angles(ti, 0.2, tr, rng.uniform(0, 6, 20)))
        basis = compiled(case)
        derivatives = jax.jit(jax.jacfwd(basis))(shape, geometry)
        for name, value in shape.items():
            step = 1e-5 * value
            up = basis({**shape, name: value + step}, geometry)
            down = basis({**shape, name: value - step}, geometry)
            difference = (up - down) / (2 * step)
            scale = float(np.max(np.abs(difference)))
            np.testing.assert_allclose(
                derivatives[name], difference, rtol=1e-6, atol=1e-8 * scale
            )


@one_fresnel
def test_albedo_keeps_its_bound(case: Case):
    bound = case.lobe.ALBEDO_BOUND
    if bound is None:
        pytest.skip("no bound declared")
    cos_theta = [0.02, 0.1, 0.3, 0.6, 0.9, 1.0]
    with jax.enable_x64(True):
        ones = tuple(jnp.asarray(1.0) for p in case.lobe.parameters() if p.coefficient)

        @jax.jit
        def albedo(shape):
            amplitudes = case.lobe.amplitudes(shape, ones)
            each = albedo_basis(case.lobe, shape, cos_theta, azimuth=0.4, nodes=32)
            return sum(a * e for a, e in zip(amplitudes, each, strict=True))

        for values in zip(*cases.extreme_shapes(case).values(), strict=True):
            shape = {
                p.name: jnp.asarray(v) for p, v in zip(case.shapes, values, strict=True)
            }
            total = np.asarray(albedo(shape))
            assert np.all(total > 0)
            assert np.all(total <= bound * (1 + 1e-3)), (shape, total)


@few
@f32_and_slow_f64
def test_albedo_is_differentiable(case: Case, x64: bool):
    cos_theta = [0.0, 1e-3, 0.3, 1.0]
    with jax.enable_x64(x64):

        def total(shape):
            return sum(
                jnp.sum(e) for e in albedo_basis(case.lobe, shape, cos_theta, nodes=8)
            )

        shapes = {n: jnp.asarray(v[::3]) for n, v in cases.extreme_shapes(case).items()}
        if not shapes:
            assert np.isfinite(total({}))
            return
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
