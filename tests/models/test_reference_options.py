"""Options of facet lobes against published numbers, closed forms and each other."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.albedo import albedo_basis, model_albedo
from fitting.expression import ModelError
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.models import fresnel, ndf, shadowing

# 1 - E of GGX with uncorrelated shadowing and F = 1, Adobe's OpenPBR tables (16 bit):
# alpha = (i / 31)^2 by mu = j / 31, j = 4, 8, 16, 24, 31.
ADOBE_MU = np.array([4, 8, 16, 24, 31]) / 31
ADOBE_LOST = {
    16: "0.15860 0.17819 0.15491 0.11911 0.09609",
    20: "0.20526 0.23902 0.26079 0.24872 0.22924",
    24: "0.28087 0.32348 0.37726 0.40160 0.40790",
    28: "0.37742 0.42826 0.50251 0.55282 0.58407",
    31: "0.45643 0.51218 0.59521 0.65409 0.69314",
}
# alpha: E at mu = 0.05, 0.1, 0.25, 0.5, 0.75, 1, by a quadrature of 256 x 256 nodes.
MU = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
UNCORRELATED = {
    0.10: "0.8859704 0.8727561 0.9203112 0.9691151 0.9831362 0.9883041",
    0.25: "0.8745816 0.8542964 0.8285124 0.8550985 0.8911647 0.9158124",
    0.50: "0.7922765 0.7722761 0.7255543 0.6860072 0.6787288 0.6878485",
    1.00: "0.5844816 0.5579142 0.4909645 0.4091371 0.3506889 0.3068528",
}
# (eta, k): F at 0, 30, 45, 60, 75, 81.79 (acos(1/7)), 85 deg; average. Johnson and
# Christy 1972 (Au at 548.6 and 659.5 nm, Ag, Cu), Rakic 1995 (Al).
CONDUCTORS = {
    (0.43, 2.455): "0.78691576 0.78647228 0.78545870 0.78813190 0.82502929 0.87963166"
    " 0.91964559 0.79403120",
    (0.14, 3.697): "0.96258537 0.96230506 0.96113531 0.95812323 0.95666023 0.96571353"
    " 0.97597821 0.96072275",
    (0.06, 3.586): "0.98283630 0.98270506 0.98216283 0.98080205 0.98039695 0.98478422"
    " 0.98946982 0.98202426",
    (0.22, 3.747): "0.94332967 0.94291774 0.94119251 0.93671217 0.93424789 0.94744948"
    " 0.96288032 0.94053213",
    (1.0728, 6.7839): "0.91471805 0.91400173 0.91067099 0.89944873 0.86846068 0.85637383"
    " 0.87353290 0.90377899",
}
CONDUCTOR_COSINES = np.concatenate(
    [np.cos(np.radians([0, 30, 45, 60, 75])), [1 / 7], np.cos(np.radians([85]))]
)


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


def numbers(text: str) -> np.ndarray:
    return np.array(text.split(), dtype=np.float64)


@functools.cache
def compiled(expression: str, nodes: int):
    lobe = Model(expression).lobes[0]
    return jax.jit(lambda shape, mu: albedo_basis(lobe, shape, mu, nodes=nodes))


def albedos(expression: str, cos_theta, nodes: int = 32, **shape: float):
    values = {n: jnp.asarray(v) for n, v in shape.items()}
    mu = jnp.asarray(cos_theta)
    return [np.asarray(e) for e in compiled(expression, nodes)(values, mu)]


@functools.cache
def compiled_basis(expression: str):
    return jax.jit(Model(expression).lobes[0].basis)


def basis(expression: str, geometry, **shape: float) -> np.ndarray:
    values = {n: jnp.asarray(v) for n, v in shape.items()}
    return np.stack(compiled_basis(expression)(values, geometry))


def directions(count: int = 400, seed: int = 3):
    rng = np.random.default_rng(seed)
    theta, phi = rng.uniform(0, 1.55, (2, count)), rng.uniform(0, 2 * np.pi, (2, count))
    return theta[0], phi[0], theta[1], phi[1]


@pytest.mark.parametrize("i", ADOBE_LOST)
def test_uncorrelated_ggx_against_adobe(i: int):
    total = sum(albedos("ggx(uncorrelated)", ADOBE_MU, alpha=(i / 31) ** 2))
    np.testing.assert_allclose(1 - total, numbers(ADOBE_LOST[i]), atol=6e-5)


@pytest.mark.parametrize("alpha", UNCORRELATED)
def test_uncorrelated_ggx(alpha: float):
    total = sum(albedos("ggx(uncorrelated)", MU, nodes=64, alpha=alpha))
    np.testing.assert_allclose(total, numbers(UNCORRELATED[alpha]), atol=3e-6)


@pytest.mark.parametrize(
    ("alpha", "mu", "reflected"),
    [(0.50364, 1.0, 0.028031), (0.50364, 0.5161, 0.041664), (1.0, 1.0, 0.012702)],
)
def test_what_a_rough_dielectric_reflects(alpha: float, mu: float, reflected: float):
    """Single scattering, index 1.5, uncorrelated Smith."""
    (total,) = albedos("ggx(dielectric, uncorrelated)", [mu], alpha=alpha, eta=1.5)
    np.testing.assert_allclose(total, reflected, atol=4e-6)


@pytest.mark.parametrize("index", CONDUCTORS, ids=str)
def test_conductors(index: tuple[float, float]):
    eta, k = (jnp.asarray(v) for v in index)
    expected = numbers(CONDUCTORS[index])
    got = fresnel.conductor(jnp.asarray(CONDUCTOR_COSINES), eta, k)
    np.testing.assert_allclose(got, expected[:-1], atol=6e-9)
    average = fresnel.average("conductor", {"eta": eta, "k": k}, (jnp.asarray(1.0),))
    np.testing.assert_allclose(average, expected[-1], atol=6e-9)


def test_a_conductor_that_does_not_absorb_is_a_dielectric():
    cosine = jnp.linspace(0.0, 1.0, 201)
    for eta in (1.01, 1.33, 1.5, 4.0):
        n = jnp.asarray(eta)
        np.testing.assert_allclose(
            fresnel.conductor(cosine, n, jnp.asarray(0.0)),
            fresnel.dielectric(cosine, n),
            rtol=1e-12,
            atol=1e-15,
        )


@pytest.mark.parametrize(
    ("eta", "k", "absorbed"),
    [(1e-3, 10.0, 4.874413e-5), (0.5, 1000.0, 2.49999e-6)],
)
def test_a_good_mirror_in_single_precision(eta: float, k: float, absorbed: float):
    """``1 - F`` is what is left of 1 in float32; the two losses keep more digits."""
    with jax.enable_x64(False):
        reflected = fresnel.conductor(*(jnp.asarray(v) for v in (0.5, eta, k)))
        assert reflected.dtype == jnp.float32
        np.testing.assert_allclose(1 - float(reflected), absorbed, atol=6e-8)
    reflected = fresnel.conductor(*(jnp.asarray(v) for v in (0.5, eta, k)))
    np.testing.assert_allclose(1 - float(reflected), absorbed, rtol=1e-6)


@pytest.mark.parametrize("x64", [False, True])
def test_conductor_derivatives_are_finite(x64: bool):
    both_ways = [
        jax.jit(of(fresnel.conductor, argnums=(1, 2))) for of in (jax.jacfwd, jax.jacrev)
    ]
    with jax.enable_x64(x64):
        cosine = jnp.asarray([0.0, 1e-7, 0.01, 1 / 7, 0.5, 1.0])
        pairs = [(1e-3, 10.0), (0.05, 4.0), (1.0, 7.0), (1.5, 0.0), (0.5, 1e3), (1e-3, 0.0)]
        for eta, k in pairs:
            for slopes in both_ways:
                found = slopes(cosine, jnp.asarray(eta), jnp.asarray(k))
                assert np.all(np.isfinite(found)), (eta, k)


def test_f82_is_what_it_says():
    """At 0 and 90 degrees and at the dip; its average falls by the dip's, over 126."""
    one = jnp.ones(())
    shape: dict = {}
    f0, f90, tint = jnp.asarray(0.9), jnp.asarray(1.0), jnp.asarray(0.7)
    cosine = jnp.asarray([1.0, 1 / 7, 0.0])
    terms = fresnel.split("f82", shape, one, cosine)
    factors = fresnel.amplitudes("f82", (f0, f90, tint))
    total = sum(a * b for a, b in zip(factors, terms, strict=True))
    schlick = 0.9 + 0.1 * (6 / 7) ** 5
    np.testing.assert_allclose(total, [0.9, 0.7 * schlick, 1.0], rtol=1e-14)
    x, w = np.polynomial.legendre.leggauss(20)
    nodes = jnp.asarray(0.5 * (x + 1))
    terms = fresnel.split("f82", shape, one, nodes)
    values = sum(a * b for a, b in zip(factors, terms, strict=True))
    mean = float(np.sum(w * nodes * values))
    np.testing.assert_allclose(
        fresnel.average("f82", shape, (f0, f90, tint)), mean, rtol=1e-13
    )
    white = fresnel.average("f82", shape, (f0, f90, one))
    lost = 0.3 * schlick / (1 / 7 * (6 / 7) ** 6) / 126
    np.testing.assert_allclose(white - mean, lost, rtol=1e-12)


def test_generalised_schlick():
    g = from_angles(*directions())
    plain = basis("ggx", g, alpha=0.3)
    np.testing.assert_allclose(
        basis("ggx(generalised)", g, alpha=0.3, power=5.0), plain, rtol=1e-12
    )
    for power in (2.0, 5.0, 8.0):
        shape = {"power": jnp.asarray(power)}
        f0, f90 = jnp.asarray(0.1), jnp.asarray(0.8)
        x, w = np.polynomial.legendre.leggauss(24)
        nodes = jnp.asarray(0.5 * (x + 1))
        low, high = fresnel.split("generalised", shape, jnp.ones(()), nodes)
        mean = float(np.sum(w * nodes * (f0 * low + f90 * high)))
        np.testing.assert_allclose(
            fresnel.average("generalised", shape, (f0, f90)), mean, rtol=1e-12
        )


@pytest.mark.parametrize("eta", [1.2, 1.5, 2.5])
def test_the_average_of_a_dielectric(eta: float):
    """The closed form of the average is that of Walsh 1926."""
    n = eta
    exact = (
        0.5
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * np.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * np.log(n)
    )
    average = fresnel.average("dielectric", {"eta": jnp.asarray(n)}, (jnp.asarray(1.0),))
    np.testing.assert_allclose(average, exact, atol=1e-6)


def test_v_cavities_shadow_as_torrance_and_sparrow_print_it():
    ti, pi, tr, pr = directions()
    g = from_angles(ti, pi, tr, pr)
    twice = 2 * np.asarray(g.hz) / np.asarray(g.cos_d)
    g2 = np.minimum(1, np.minimum(twice * g.cos_i, twice * g.cos_o))
    bare = basis("ggx(bare)", g, alpha=0.4)
    np.testing.assert_allclose(
        basis("ggx(v_cavity)", g, alpha=0.4), bare * g2 / (g.cos_i * g.cos_o), rtol=1e-12
    )


def test_shadowing_in_order():
    """Heights that belong together shadow less than independent ones; normal: the same."""
    g = from_angles(*directions())
    for lobe in ("ggx", "beckmann"):
        together = basis(lobe, g, alpha=0.7)
        apart = basis(f"{lobe}(uncorrelated)", g, alpha=0.7)
        assert np.all(apart <= together * (1 + 1e-12))
        normal = from_angles(np.zeros(9), 0.0, np.linspace(0, 1.5, 9), 0.0)
        np.testing.assert_allclose(
            basis(f"{lobe}(uncorrelated)", normal, alpha=0.7),
            basis(lobe, normal, alpha=0.7),
            rtol=1e-12,
        )


@pytest.mark.parametrize("lobe", ["ggx(retro)", "beckmann(retro)", "ggx(retro, aniso)"])
def test_retro_is_the_lobe_with_the_source_turned(lobe: str):
    ti, pi, tr, pr = directions()
    shape = {"alpha": 0.3}
    if "aniso" in lobe:
        shape = {"alpha_x": 0.2, "alpha_y": 0.5, "angle": 0.4}
    plain = lobe.replace("retro, ", "").replace("(retro)", "")
    np.testing.assert_allclose(
        basis(lobe, from_angles(ti, pi, tr, pr), **shape),
        basis(plain, from_angles(ti, pi + np.pi, tr, pr), **shape),
        rtol=1e-9,
        atol=1e-14,
    )


def test_the_back_vector_of_beckmann():
    """The published retro lobe, Beckmann of the back vector without shadowing (ALTA)."""
    ti, pi, tr, pr = directions()
    g = from_angles(ti, pi, tr, pr).turned
    a, z2 = 0.4, np.asarray(g.hz) ** 2
    published = np.exp((z2 - 1) / (a * a * z2)) / (4 * np.pi * a * a * z2**2)
    ours = basis("beckmann(retro, bare)", from_angles(ti, pi, tr, pr), alpha=a).sum(0)
    np.testing.assert_allclose(ours, published, rtol=1e-10)


def test_student_t_between_ggx_and_beckmann():
    g = from_angles(*directions())
    for alpha in (0.05, 0.5, 1.5):
        np.testing.assert_allclose(
            basis("student_t", g, alpha=alpha, gamma=2.0), basis("ggx", g, alpha=alpha),
            rtol=1e-8,
        )  # fmt: skip
    widths = {"alpha_x": 0.2, "alpha_y": 0.6, "angle": 0.3}
    np.testing.assert_allclose(
        basis("student_t(aniso)", g, **widths, gamma=2.0),
        basis("ggx(aniso)", g, **widths),
        rtol=1e-8,
    )
    near = from_angles(0.3, 0.0, np.linspace(0.1, 0.5, 20), np.pi)
    wide = basis("student_t", near, alpha=0.3, gamma=40.0)
    exact = basis("beckmann", near, alpha=0.3)
    assert np.max(np.abs(wide / exact - 1)) < 0.03


@pytest.mark.parametrize("gamma", [1.6, 2.3, 3.1, 10.0, 40.0])
def test_student_t_shadowing(gamma: float):
    """Against the hypergeometric form, in 30 digits."""
    import mpmath as mp

    half = mp.mpf(1) / 2
    with mp.workdps(30):
        g = mp.mpf(gamma)
        for cotangent in (1e-3, 0.3, 2.0):
            z = mp.mpf(cotangent)
            inner = z / mp.sqrt(g - 1)
            inner *= mp.hyp2f1(half, g - half, 3 * half, -(z**2) / (g - 1))
            first = (g - 1) ** (3 * half) * (1 + z**2 / (g - 1)) ** (3 * half - g)
            ratio = mp.gamma(g - half) / (mp.gamma(g) * mp.sqrt(mp.pi))
            exact = ratio * (first / (z * (2 * g - 3)) + (g - 1) * inner) - half
            got = shadowing.cos_lambda_student_t(
                jnp.ones(1), jnp.asarray([cotangent]), jnp.asarray(gamma)
            )
            ours = float(got[0]) / cotangent
            assert abs(1 / (1 + ours) - float(1 / (1 + exact))) < 1e-8


def test_gtr_joins():
    """``gamma = 2`` is GGX in value and shadowing; at 1 and at ``alpha = 1`` no hole."""
    g = from_angles(*directions(100))
    for alpha in (1e-3, 0.1, 0.7):
        np.testing.assert_allclose(
            basis("gtr", g, alpha=alpha, gamma=2.0), basis("ggx", g, alpha=alpha), rtol=2e-5
        )
    near = [1.0 - 1e-6, 1.0, 1.0 + 1e-6]
    around = [basis("gtr(bare)", g, alpha=0.2, gamma=gamma) for gamma in near]
    np.testing.assert_allclose(around[1], 0.5 * (around[0] + around[2]), rtol=1e-9)
    round_ = basis("gtr(bare)", g, alpha=1.0, gamma=1.0)
    np.testing.assert_allclose(round_.sum(0), 1 / (4 * np.pi), rtol=1e-12)


@pytest.mark.parametrize("gamma", [0.5, 1.0, 1.7, 3.0, 10.0])
@pytest.mark.parametrize("alpha", [1e-3, 0.1, 0.9])
def test_distributions_are_normalised(alpha: float, gamma: float):
    u = np.linspace(np.log(1e-9), np.log(1e9), 60001)
    slope = np.exp(u)
    hz = 1 / np.sqrt(1 + slope**2)
    a, g = jnp.asarray(alpha), jnp.asarray(gamma)
    h2 = jnp.asarray((slope * hz / alpha) ** 2)
    found = {"gtr": ndf.gtr(h2, jnp.asarray(hz), a, g)}
    if gamma > 1.5:
        found["student_t"] = ndf.student_t(h2, jnp.asarray(hz), a * a, g)
    for name, d in found.items():
        total = np.trapezoid(2 * np.pi * np.asarray(d) * hz**4 * slope**2, u)
        np.testing.assert_allclose(total, 1.0, rtol=2e-6, err_msg=name)


@functools.cache
def compiled_albedo(expression: str, nodes: int):
    model = Model(expression)
    return jax.jit(lambda values, mu: model_albedo(model, values, mu, nodes=nodes))


@pytest.mark.parametrize("lobe", ["ggx", "beckmann"])
@pytest.mark.parametrize("alpha", [1e-3, 0.1, 0.5, 1.0, 1.5])
def test_multiple_scattering_loses_nothing(lobe: str, alpha: float):
    """With F = 1 the albedo is 1 in every direction (Kulla and Conty 2017)."""
    values = {f"{lobe}.alpha": alpha, f"{lobe}.f0": 1.0, f"{lobe}.f90": 1.0}
    total = compiled_albedo(f"{lobe}(ms)", 64)(values, np.array([0.05, 0.1, 0.3, 0.6, 1.0]))
    np.testing.assert_allclose(total, 1.0, atol=1.2e-3)
    grey = {**values, f"{lobe}.f0": 0.5, f"{lobe}.f90": 0.5}
    assert np.all(
        compiled_albedo(f"{lobe}(ms)", 16)(grey, np.array([0.3, 1.0])) < 0.5 + 1e-4
    )


def test_options_that_exclude_each_other():
    with pytest.raises(ModelError, match="isotropic"):
        Model("ggx(ms, aniso)")
    with pytest.raises(ModelError, match="Smith"):
        Model("ggx(ms, bare)")
    with pytest.raises(ModelError, match="no option 'ms'"):
        Model("ward(ms)")
