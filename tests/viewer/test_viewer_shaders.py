"""Shaders against the model in float64, at the extremes of directions and in between.

The reference is the lobe itself as it is fitted, at the very directions and parameters
that the shader had, which are float32. An error is allowed to be 64 units of float32's
rounding of the value and of what the value changes when any of its inputs is rounded once:
components of the directions, of the half vector, and parameters, each on its own. Where the
lobe in Python loses more than that in float32, it may be 8 times that loss.
"""

from __future__ import annotations

import base64
import dataclasses
import zlib
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.geometry import Geometry, from_components
from fitting.model import Model
from fitting.stress import points
from fitting.stress.variants import Variant, registered
from fitting.viewer import assets
from fitting.viewer.glsl import shader

PAIRS = 2048
SETS = 3
EPS = 2.0**-23
ALLOWED = 64.0
TIMES_PYTHON = 8.0
# Below it factors of a value may have been too small for float32 on the way.
LEAST = 1e-28

# The modules that evaluate, and what the test calls.
DRIVER = """
const { openGraphics } = module_gl, { ShaderModel } = module_model;
const { floatsOf } = module_numbers;
const gl = openGraphics();
window.evaluate = ({ shader, glsl, sets, values, sources, detectors }) => {
  const model = new ShaderModel(gl, shader, glsl, sets);
  model.setParameters(floatsOf(values));
  const out = [];
  for (let c = 0; c < sets; ++c) {
    const sums = model.sums(new Map([[c, [1]]]), "sums");
    const all = model.evaluate(floatsOf(sources), floatsOf(detectors), sums);
    out.push(Array.from(all.filter((_, k) => k % 4 === 0), String));
  }
  if (gl.getError()) throw new Error("WebGL reports an error");
  return out;
};
"""
PAGE = "<!DOCTYPE html><title>shaders</title><script type='module'>@</script>"


@pytest.fixture(scope="module")
def shaders(browser: Any) -> Any:
    """A page that evaluates models, kept for all of them."""
    page = browser.new_page()
    script = assets.script(("numbers", "gl", "model")) + DRIVER
    page.set_content(PAGE.replace("@", script))
    yield page
    page.close()


def _base64(numbers: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers, "<f4").tobytes()).decode()


def _padded(vectors: np.ndarray) -> str:
    return _base64(np.concatenate([vectors, np.zeros((len(vectors), 1))], axis=1))


def _directions(variant: Variant) -> tuple[np.ndarray, np.ndarray]:
    """Sources and detectors ``(n, 3)``, rounded to float32."""
    g = points.stratified(variant, PAIRS, salt=" viewer").geometry
    wi = np.stack([g.wix, g.wiy, g.cos_i], axis=1)
    wo = np.stack([g.wox, g.woy, g.cos_o], axis=1)
    return wi.astype(np.float32), wo.astype(np.float32)


def _values(model: Model, seed: str) -> dict[str, np.ndarray]:
    """Sets of parameters ``(s,)``: the default, and others from where fits begin."""
    rng = np.random.default_rng(zlib.crc32(seed.encode()))
    out = {}
    for name, p in model.parameters().items():
        share = rng.uniform(0.02, 0.98, SETS)
        low, high = (0.05, 0.95) if p.coefficient else p.start
        if p.scale == "log" and not p.coefficient:
            some = low * (high / low) ** share
        else:
            some = low + (high - low) * share
        some[0] = p.default
        out[name] = some.astype(np.float32)
    return out


def _on_shader(page: Any, model: Model, values: dict, wi, wo) -> np.ndarray:
    """``(s, n)`` values that the graphics computed."""
    translated = shader(model)
    rows = np.stack([values[n] for n in translated.parameters], axis=1)
    out = page.evaluate(
        "asked => window.evaluate(asked)",
        {
            "shader": dataclasses.asdict(translated), "glsl": assets.shaders(),
            "sets": SETS, "values": _base64(rows), "sources": _padded(wi),
            "detectors": _padded(wo),
        },
    )  # fmt: skip
    return np.array(out, dtype=np.float64)


def _double(own: dict[str, np.float32]) -> dict[str, jax.Array]:
    return {n: jnp.asarray(float(v)) for n, v in own.items()}


def _geometry(wi: np.ndarray, wo: np.ndarray) -> Geometry:
    return from_components(*(jnp.asarray(c, jnp.float64) for c in (*wi.T, *wo.T)))


def _exact(model: Model, own: dict, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Values ``(n,)`` in float64."""
    with jax.enable_x64(True):
        return np.asarray(model(_double(own), _geometry(wi, wo)))


def _change(model: Model, own: dict, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """What rounding the inputs once may change of the values ``(n,)``."""
    out = np.zeros(len(wi))
    with jax.enable_x64(True):
        geometry, values = _geometry(wi, wo), _double(own)
        exact = np.asarray(model(values, geometry))
        for name in (f.name for f in dataclasses.fields(Geometry) if f.name != "polar"):
            there = [getattr(geometry, name) * (1.0 + s * EPS) for s in (-1.0, 1.0)]
            moved = [dataclasses.replace(geometry, **{name: t}) for t in there]
            both = [np.abs(np.asarray(model(values, g)) - exact) for g in moved]
            out += np.maximum(*both)
        for name, value in values.items():
            other = values | {name: value * (1.0 + EPS)}
            out += np.abs(np.asarray(model(other, geometry)) - exact)
    return out


def _in_float32(model: Model, own: dict, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Values ``(n,)`` as Python has them with the arithmetic of the shader."""
    with jax.enable_x64(False):
        geometry = from_components(*(jnp.asarray(c) for c in (*wi.T, *wo.T)))
        return np.asarray(model({n: jnp.asarray(v) for n, v in own.items()}, geometry))


class Errors(NamedTuple):
    """Largest errors in units of what is allowed for one rounding: of the shader, and of
    Python in float32 where the shader's is large."""

    shader: float
    python: float


def errors(page: Any, variant: Variant) -> Errors:
    model = variant.model
    wi, wo = _directions(variant)
    values = _values(model, str(variant))
    got = _on_shader(page, model, values, wi, wo)
    shader, python = 0.0, 0.0
    for k in range(SETS):
        own = {n: v[k] for n, v in values.items()}
        exact = _exact(model, own, wi, wo)
        error = np.abs(got[k] - exact)
        error[~np.isfinite(got[k])] = np.inf
        one = EPS * np.abs(exact) + LEAST
        # Of small errors the condition does not matter, and costs time.
        if (error > ALLOWED * one).any():
            one += _change(model, own, wi, wo)
            single = _in_float32(model, own, wi, wo).astype(np.float64)
            # Zero in both where float32 has no number as small as a factor on the way.
            error[(single == 0.0) & (got[k] == 0.0)] = 0.0
            python = max(python, float((np.abs(single - exact) / one)[single != 0.0].max()))
        shader = max(shader, float((error / one).max()))
    return Errors(shader, python)


def _assert_as_good_as_float32(found: Errors) -> None:
    # Python's own float32 is further off where terms cancel: in beckmann(ms) alone, the
    # little that a smooth surface scatters more than once.
    assert found.shader <= max(ALLOWED, TIMES_PYTHON * found.python)


ALL = {str(v): v for v in registered()}
# One of every kind of translation: plain, many terms, loops, arrays, refraction, per angle.
SOME = ("lambert", "ggx", "eon", "gtr", "rough_dielectric", "harvey_shack(spectral)")


@pytest.mark.parametrize("name", SOME)
def test_shader_agrees_with_the_model(shaders: Any, name: str) -> None:
    _assert_as_good_as_float32(errors(shaders, ALL[name]))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(ALL) - set(SOME)))
def test_every_shader_agrees_with_its_model(shaders: Any, name: str) -> None:
    _assert_as_good_as_float32(errors(shaders, ALL[name]))
